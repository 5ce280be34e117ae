"""The PID benchmark of section 2.2 (Fig. 2.2 to 2.4), with its gains as printed and swapped."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from data.thesis import printed_numbers
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import simulate

# Section 2.2 prints neither of these three; the first is the default of Simulink's PID block.
BACK_CALCULATION = 1.0
STEP = 10.0
HORIZON_S = 150.0


@dataclass(frozen=True)
class PidBenchmark:
    """Section 2.2: gain/(time_constant_s s + 1) exp(-delay_s s) under proportional + integral/s, a step of r."""

    gain: float
    time_constant_s: float
    delay_s: float
    proportional: float
    integral: float
    limit: float
    step: float


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
    values = printed_numbers()["pid"]
    return PidBenchmark(
        gain=values["gain"],
        time_constant_s=values["time_constant_s"],
        delay_s=values["delay_s"],
        proportional=values["printed_proportional"],
        integral=values["printed_integral"],
        limit=values["limit"],
        step=STEP,
    )


def pid_loop(benchmark: PidBenchmark, back_calculation: float) -> SaturatedLoop:
    """The PI loop of section 2.2 with back-calculation: u = P e + x_I, x_I' = I e + K_b (sat(u) - u).

    Parameters
    ----------
    benchmark
        First-order plant with dead time, PI gains, step of the reference.
    back_calculation
        K_b in 1/s; 0 is no anti-windup. Simulink's default, which the thesis does not print, is 1.
    """
    K_p, K_i, K_b = benchmark.proportional, benchmark.integral, back_calculation
    lag = 1 / benchmark.time_constant_s
    # states: r, plant, integrator; w = y
    r, plant, integrator = np.eye(3)
    u_x, u_w = K_p * r + integrator, np.array([-K_p])
    A = np.diag([0.0, -lag, 0.0])
    A[2] += K_i * r - K_b * u_x
    D = np.array([[0.0], [0.0], [-K_i + K_b * K_p]])
    return SaturatedLoop(
        A=A,
        B=benchmark.gain * lag * plant + K_b * integrator,
        C=u_x,
        D=D,
        E=u_w,
        Z=plant[None, :],
        delays=np.array([benchmark.delay_s]),
        x0=benchmark.step * r,
        outputs={
            "reference": (r, np.zeros(1)),
            "output": (np.zeros(3), np.ones(1)),
            "error": (r, -np.ones(1)),
        },
    )
