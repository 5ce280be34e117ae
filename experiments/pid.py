"""The PID benchmark of section 2.2 (Fig. 2.2 to 2.4), with its gains as printed and swapped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from experiments.closed_loop import simulate
from experiments.loops import pid_loop
from experiments.scenarios import PidBenchmark
from identification.thesis import printed

# Section 2.2 prints neither of these three; the first is the default of Simulink's PID block.
BACK_CALCULATION = 1.0
STEP = 10.0
HORIZON_S = 150.0


def pid_tables() -> dict[str, pd.DataFrame]:
    """Simulate the benchmark with and without back-calculation.

    Returns
    -------
    dict
        ``pid``: time_s, reference and, for the gains ``printed`` (0.5 + 4.5/s) and ``swapped`` (4.5 + 0.5/s),
        output_GAINS_KIND, control_GAINS_KIND, saturated_GAINS_KIND with KIND ``none`` or ``back_calculation``.
        ``pid_summary``: one row; overshoot_GAINS_KIND in percent and the settings.

    Notes
    -----
    As printed the loop limit-cycles, and it still oscillates with back-calculation; the text's description fits the
    swapped gains.
    """
    as_printed = printed_benchmark()
    swapped = replace(as_printed, proportional=as_printed.integral, integral=as_printed.proportional)
    time_s = np.linspace(0.0, HORIZON_S, 3001)
    columns: dict[str, np.ndarray] = {"time_s": time_s, "reference": np.full(len(time_s), STEP)}
    summary: dict[str, float] = {"step": STEP, "back_calculation": BACK_CALCULATION, "limit": as_printed.limit}
    for gains, benchmark in (("printed", as_printed), ("swapped", swapped)):
        for kind, K_b in (("none", 0.0), ("back_calculation", BACK_CALCULATION)):
            run = simulate(pid_loop(benchmark, K_b), (-benchmark.limit, benchmark.limit), time_s)
            columns[f"output_{gains}_{kind}"] = run.outputs["output"]
            columns[f"control_{gains}_{kind}"] = run.control
            columns[f"saturated_{gains}_{kind}"] = run.saturated_control
            summary[f"overshoot_{gains}_{kind}"] = 100 * (run.outputs["output"].max() / STEP - 1)
    return {"pid": pd.DataFrame(columns), "pid_summary": pd.DataFrame([summary])}


def printed_benchmark() -> PidBenchmark:
    """Plant, limits and gains of section 2.2 as printed, with a step of :data:`STEP`."""
    values = printed()["pid"]
    return PidBenchmark(
        gain=values["gain"],
        time_constant_s=values["time_constant_s"],
        delay_s=values["delay_s"],
        proportional=values["printed_proportional"],
        integral=values["printed_integral"],
        limit=values["limit"],
        step=STEP,
    )
