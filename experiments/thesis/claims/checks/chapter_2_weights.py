"""What the thesis states of chapter 2's loop, with our weights W_1 and W_2 and with others, since it prints none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from data.thesis import printed_numbers
from design.blocks.block import Block
from design.design_file import Design
from design.hinf.mixed_sensitivity import mixed_sensitivity
from experiments.engine.simulate import Run
from experiments.runs.compare_anti_windups import SETTLED, run_all
from experiments.runs.design_loop import design_loop
from experiments.thesis.claims.checks.statements import unanimous
from experiments.thesis.claims.inputs import Inputs
from experiments.thesis.printed_choices import chapter_2, thesis_reference

PERIODS = 50  # of the reference: what grows shows it by then
GROWTH = 1.1  # from the first half of a run to the second
DECAY_RATE = 0.1  # of the other weights, in 1/s


def delay_free_runs(inputs: Inputs) -> dict[str, float]:
    """Section 2.4 under the printed limits, from rest, see :func:`over_weights`.

    Without anti-windup the loop becomes unstable: its control grows by more than a tenth from the first half of
    :data:`PERIODS` periods to the second; the output cannot follow: the last period's error exceeds a tenth of the
    amplitude. With the thesis's the loop stays stable, by the same measure, and u is truncated at the limits, which it
    exceeds by 1 % at most. And (section 3.2) the scheme cannot be applied with a dead time: (2.5) for that plant is
    F_2 = (Lambda - A)/(B exp(-T_d s)), which looks ahead.
    """
    chosen = printed_numbers()["delay_free"]
    limit, amplitude = chosen["limit"], chosen["reference"]["amplitude"]

    def cannot_follow(weights: str) -> bool:
        error = long_run(weights, None).outputs["error"]
        return bool(np.max(np.abs(error[-(len(error) // PERIODS) :])) > amplitude / 10)

    return {
        "statement.unstable_without": over_weights(lambda weights: grows(long_run(weights, None))),
        "statement.cannot_follow": over_weights(cannot_follow),
        "statement.stays_stable": over_weights(lambda weights: not grows(long_run(weights, "thesis"))),
        "statement.truncated": over_weights(
            lambda weights: bool(np.max(np.abs(long_run(weights, "thesis").control)) <= (1 + SETTLED) * limit)
        ),
        "statement.no_dead_time": float(chapter_2().blocks["F2"].delay_s - chapter_2().plant.delay_s < 0),
    }


def over_weights(holds: Callable[[str], bool]) -> float:
    """Whether a statement holds with all of :data:`DESIGNS`; NaN where they disagree."""
    return unanimous(holds(weights) for weights in DESIGNS)


@cache
def other_chapter_2() -> Design:
    """Chapter 2 with our W_2, the multiplicative bound itself, and a W_1 that asks for less.

    It has the poles of the reference, damped, as Remark 1 says, and one more, and is 1 at high frequencies times their
    product.
    """
    design = chapter_2()
    assert design.hinf is not None
    (omega,) = design.reference_omegas
    poles = (-3 * DECAY_RATE + 1j * omega, -3 * DECAY_RATE - 1j * omega, complex(-3 * DECAY_RATE))
    K, _ = mixed_sensitivity(design.blocks["G_A"], Block(1.0, (), poles), design.hinf.W2, DECAY_RATE)
    return replace(design, blocks={**design.blocks, "K": K})


DESIGNS: dict[str, Callable[[], Design]] = {"ours": chapter_2, "others": other_chapter_2}
"""Chapter 2 with each choice of weights."""


@cache
def long_run(weights: str, anti_windup: str | None) -> Run:
    """One of :data:`DESIGNS` under the printed limits, from rest, over :data:`PERIODS` periods of the reference.

    Parameters
    ----------
    weights
        "ours" or "others".
    anti_windup
        "thesis", or None for none.
    """
    design = DESIGNS[weights]()
    reference = thesis_reference("delay-free", design.reference_omegas)
    time_s = np.linspace(0.0, PERIODS * reference.period_s, 500 * PERIODS + 1)
    loop = design_loop(design, reference, design.compensator(anti_windup) if anti_windup else None)
    return run_all({"run": loop}, printed_numbers()["delay_free"]["limit"], time_s)["run"]


def grows(run: Run) -> bool:
    """Whether the largest |u| grows by more than a tenth from the first half of a run to the second."""
    half = len(run.time_s) // 2
    first, second = (np.max(np.abs(part)) for part in (run.control[:half], run.control[half:]))
    return not second <= GROWTH * first  # NaN, after a divergence, grows
