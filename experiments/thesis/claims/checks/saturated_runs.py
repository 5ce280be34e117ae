"""What the thesis says of its simulated runs: the PID benchmark, the chapter 2 error and the chapter 4 loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from data.thesis import model_named, printed_numbers
from design.blocks.block import Block
from design.chapters_3_4.design_extended import design_extended
from design.stability.characteristic_roots import rightmost_roots
from design.stability.delay_loop import DelayLoop
from experiments.engine.simulate import simulate
from experiments.physical_limits.integrator_bound import least_peak_error
from experiments.runs.compare_anti_windups import SETTLED
from experiments.runs.design_loop import design_loop
from experiments.runs.metrics import last_saturation, over_last, settling_time
from experiments.thesis.claims.checks.statements import NOTHING, unanimous
from experiments.thesis.claims.inputs import Inputs, plant_of
from experiments.thesis.printed_choices import chapter_4, thesis_reference
from experiments.thesis.studies.chapter_4 import extended_tables
from experiments.thesis.studies.desaturation import PERIODS
from experiments.thesis.studies.pid import BACK_CALCULATION, HORIZON_S, STEP, pid_loop, pid_tables, printed_benchmark

BACK_CALCULATIONS = (BACK_CALCULATION, 100 * BACK_CALCULATION)  # in 1/s


def pid(inputs: Inputs) -> dict[str, float]:
    """The gains of C = P + I/s for which section 2.2 describes the loop, and the overshoot with those printed.

    Without anti-windup Fig. 2.2 has a step response with an overshoot; of the printed gains and the swapped ones
    those are taken that end nearer to the step. The overshoot, in percent, is the one with back-calculation.

    Statements: the printed gains stabilise the plant; without anti-windup the output overshoots, and the control
    settles outside the actuator's range, with either gains; with it u and sat(u) coincide (:func:`_coincide`), and the
    output settles sooner, with the gains that are taken.
    """
    tables = pid_tables()
    runs, summary = tables["pid"], tables["pid_summary"].iloc[0]
    gains = printed_numbers()["pid"]["printed_proportional"], printed_numbers()["pid"]["printed_integral"]
    time_s = runs["time_s"].to_numpy()
    ripple = {
        name: over_last(time_s, runs[f"output_{name}_none"].to_numpy() - STEP, 20.0)[1]
        for name in ("printed", "swapped")
    }
    taken = min(ripple, key=lambda name: ripple[name])
    proportional, integral = gains if taken == "printed" else gains[::-1]
    limit = printed_numbers()["pid"]["limit"]
    wound_up = []
    for name in ripple:
        middle, half = over_last(time_s, runs[f"control_{name}_none"].to_numpy(), 20.0)
        wound_up.append(half < SETTLED * limit and abs(middle) > (1 + SETTLED) * limit)
    without, with_it = (
        settling_time(time_s, runs[f"output_{taken}_{kind}"].to_numpy() - STEP, 2 * SETTLED * STEP)
        for kind in ("none", "back_calculation")
    )
    return {
        "pid.proportional": proportional,
        "pid.integral": integral,
        "pid.overshoot": float(summary["overshoot_printed_back_calculation"]),
        "statement.pid_stabilises": float(bool(np.all(rightmost_roots(_pid_linear_loop(*gains), 1).roots.real < 0))),
        "statement.pid_overshoot": float(min(summary[f"overshoot_{name}_none"] for name in ripple) > 0),
        "statement.pid_wound_up": float(any(wound_up)),
        "statement.pid_coincide": _coincide(proportional, integral),
        "statement.pid_sooner": float(with_it < without),
    }


def _coincide(proportional: float, integral: float) -> float:
    """Whether u and sat(u) coincide to 1 % of the limit from 1 s on, for every one of :data:`BACK_CALCULATIONS`.

    Section 2.2 does not print the gain, see :func:`experiments.thesis.claims.checks.statements.unanimous`.
    """
    benchmark = replace(printed_benchmark(), proportional=proportional, integral=integral)
    time_s, limit = np.linspace(0.0, HORIZON_S, 3001), benchmark.limit

    def coincide(gain: float) -> bool:
        run = simulate(pid_loop(benchmark, gain), (-limit, limit), time_s)
        excess = np.abs(run.control - run.saturated_control)[time_s >= 1.0]
        return bool(excess.max() < SETTLED * limit)

    return unanimous(coincide(gain) for gain in BACK_CALCULATIONS)


def _pid_linear_loop(proportional: float, integral: float) -> DelayLoop:
    """The benchmark's plant with C = P + I/s, without saturation."""
    values = printed_numbers()["pid"]
    lag = 1 / values["time_constant_s"]
    plant = Block(values["gain"] * lag, (), (complex(-lag),), values["delay_s"])
    return DelayLoop(plant, Block(proportional, (complex(-integral / proportional),), (0j,)), Block(0.0), 0.0)


def delay_free(inputs: Inputs) -> dict[str, float]:
    """The least tracking error in percent of the amplitude that +-10 at the plant's input allows in chapter 2."""
    chosen = printed_numbers()["delay_free"]
    reference = chosen["reference"]
    omega = 2 * np.pi / reference["period_s"]
    least = least_peak_error(plant_of(inputs), chosen["limit"], reference["amplitude"], omega)
    return {"delay_free.tracking_error": 100 * least / reference["amplitude"]}


def extended(inputs: Inputs) -> dict[str, float]:
    """Chapter 4 from rest, under the limits for which the loop without anti-windup saturates until 4 s.

    ``extended.tracking_error``: the largest error after the first second without anti-windup.
    ``extended.recovery_s``: when the loop with the thesis's anti-windup leaves saturation for good.

    Statements: without anti-windup the output differs from the reference by more than 1 % of its amplitude after the
    first second; with the thesis's its error stays below 1 % in the last period, and below that without anti-windup;
    half the dead time leaves saturation at another time; y + y_d is the linear response (Lemma 2).
    """
    summary = extended_tables(chapter_4())["extended_summary"].set_index("run")
    last, limit = summary["relative_error_percent"], float(summary["limit"]["thesis"])
    amplitude = printed_numbers()["extended"]["reference"]["amplitude"]
    return {
        "extended.tracking_error": float(summary["peak_error_after_1s"]["none"]),
        "extended.recovery_s": float(summary["last_saturation_s"]["thesis"]),
        "statement.difference_without": float(summary["peak_error_after_1s"]["none"] > SETTLED * amplitude),
        "statement.delay_matters": float(abs(_recovery(0.5, limit) - summary["last_saturation_s"]["thesis"]) > 1e-3),
        "statement.error_converges": float(last["thesis"] < 100 * SETTLED),
        "statement.minimises_error": float(last["thesis"] < last["none"]),
        "statement.lemma_2": float(_y_lin_is_linear(limit)),
    }


def _recovery(share: float, limit: float) -> float:
    """``extended.recovery_s`` under +-limit of a design for the plant with this share of its dead time."""
    design = chapter_4()
    model = model_named("implied")
    shorter = replace(model.plant, delay_s=share * model.plant.delay_s)
    other = design_extended(replace(model, plant=shorter), design.reference_omegas, design.free.a, design.free.pairs)
    reference = thesis_reference("extended", design.reference_omegas)
    loop = design_loop(other, reference, other.compensator("thesis"))
    return last_saturation(simulate(loop, (-limit, limit), np.array([0.0, PERIODS * reference.period_s])))


def _y_lin_is_linear(limit: float) -> bool:
    """Whether y + y_d under saturation is y without, chapter 4 with the thesis's anti-windup, over two periods."""
    design = chapter_4()
    reference = thesis_reference("extended", design.reference_omegas)
    loop = design_loop(design, reference, design.compensator("thesis"))
    time_s = np.linspace(0.0, 2 * reference.period_s, 1001)
    cut, linear = (simulate(loop, (-size, size), time_s) for size in (limit, np.finfo(float).max))
    saturated = np.max(np.abs(cut.control - cut.saturated_control)) > 0
    distance = np.max(np.abs(cut.outputs["y_lin"] - linear.outputs["output"]))
    return bool(saturated and distance < NOTHING * reference.amplitude)
