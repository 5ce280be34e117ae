"""Every anti-windup of a design beside none: what does harm is told first."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from design.anti_windup.compensator import anti_windup
from design.anti_windup.judge import Compensator, judge
from design.blocks.block import Block
from design.design_file import Design
from experiments.runs.against_none import against_none
from experiments.runs.references import sinusoid
from experiments.runs.simulate_design import simulate_design


@pytest.fixture(scope="module")
def with_harm(extended_design: Design) -> Design:
    """A theta1~ with a slow lightly damped mode: the loop rings long after the saturation."""
    kind = anti_windup(Block(-1.0, (), (-0.02 + 1j, -0.02 - 1j)))
    judgement = judge(extended_design.loop_plant, extended_design.additive_bound, kind)
    return replace(extended_design, added={"ringing": Compensator(kind, judgement)})


def test_what_does_harm_is_told_first(with_harm: Design) -> None:
    found = against_none(with_harm, sinusoid(50.0, 1.5, math.pi / 2), (-12.0, 12.0))
    assert found.is_worse("ringing")
    assert not found.is_worse("corrected")
    first, *_ = str(found).splitlines()
    assert first.startswith(("ringing is WORSE", "thesis is WORSE"))
    assert [("WORSE" in line) for line in str(found).splitlines()[:-2]] == sorted(
        [found.is_worse(name) for name in found.outcomes if name != "none"], reverse=True
    )


def test_the_outcomes_are_those_of_the_runs(with_harm: Design) -> None:
    reference, until = sinusoid(50.0, 1.5, math.pi / 2), 10 * 2 * math.pi / 1.5
    found = against_none(with_harm, reference, (-12.0, 12.0))
    free = simulate_design(with_harm, math.inf, reference, None, until_s=until)
    for name, outcome in found.outcomes.items():
        run = simulate_design(with_harm, 12.0, reference, name, until_s=until)
        off = np.abs(run.outputs["output"] - free.outputs["output"]) / 50.0
        assert outcome.largest_control >= np.abs(run.control).max() / 12.0 * (1 - 1e-9)
        assert outcome.last_error == pytest.approx(off[run.time_s >= until - 2 * math.pi / 1.5].max())
        if math.isfinite(outcome.recovery_s):
            at = int(np.argmin(np.abs(run.time_s - outcome.recovery_s)))
            assert off[at] > 0.01 >= off[at + 1 :].max()


def test_a_sentence_says_whose_limits_they_are_and_the_corrected_one_comes_first(extended_design: Design) -> None:
    found = against_none(extended_design)
    needed = abs(1 / extended_design.plant(1.5j))
    calm = replace(
        found,
        outcomes=dict.fromkeys(("none", "thesis", "corrected"), replace(found.outcomes["none"], largest_control=2.0)),
    )
    first, second, without, conditions = str(calm).splitlines()
    assert first.startswith(("corrected is no worse", "corrected does not help"))
    assert second.startswith(("thesis is no worse", "thesis does not help"))
    assert without.startswith("without anti-windup the loop ")
    where = f"under the limits +-{1.2 * needed:.4g}, 1.2 times what a reference of amplitude 1 takes"
    assert conditions.startswith(f"compared {where}")
    assert "begins at its crest" in conditions
    given = str(against_none(extended_design, sinusoid(50.0, 1.5, math.pi / 2), (-12.0, 12.0)))
    assert given.endswith("\ncompared under the limits +-12, from rest under the reference")
    assert "crest" not in str(against_none(replace(extended_design, reference_omegas=(0.0,))))


def test_the_limits_are_what_the_reference_needs_and_more(extended_design: Design) -> None:
    found = against_none(extended_design)
    needed = sinusoid(1.0, 1.5).required(extended_design.plant).value
    assert found.limits == pytest.approx((-1.2 * needed, 1.2 * needed), rel=1e-12)
    constant = replace(extended_design, reference_omegas=(0.0,))  # an integrator needs no control for it
    assert 0 < against_none(constant).limits[1] < math.inf
