"""The H-infinity synthesis against slycot's on problems that slycot solves."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from math import tau

import control
import pytest

from data.thesis import model_named
from design.blocks.block import Block
from design.chapter_2.design_delay_free import design_delay_free
from design.hinf.mixed_sensitivity import infimum, mixed_sensitivity

# G, W1 and W_u; W2 = W_u/G. The first is Example 2.17 of S. Skogestad and I. Postlethwaite, Multivariable Feedback
# Control, Wiley 2005
PROBLEMS = {
    "textbook": (Block(8000.0, (), (-0.1, -20.0, -20.0)), Block(1 / 1.5, (-15.0,), (-1e-3,)), Block(1.0)),
    "resonant": (Block(5.0, (), (-0.03 + 3j, -0.03 - 3j)), Block(0.5, (-2.0,), (-0.01,)), Block(0.2)),
    "unstable": (Block(3.0, (4.0,), (-2.0, 0.5)), Block(0.5, (-2.0,), (-0.01,)), Block(0.1, (-3.0,), (-30.0,))),
}


def to_control(block: Block) -> control.TransferFunction:
    return control.zpk(block.zeros, block.poles, block.gain)


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
def test_against_slycot(against: Callable[..., object], problem: tuple[Block, Block, Block]) -> None:
    """The optimum of S/KS; slycot's comes without a check of the norm, ours with it."""
    G, W1, W_u = problem
    with warnings.catch_warnings():  # augw calls what its own library deprecates
        warnings.simplefilter("ignore", FutureWarning)
        plant = control.augw(*(to_control(block) for block in problem))
    against(lambda: mixed_sensitivity(G, W1, W_u * G.inverse(), 0.0), lambda: control.hinfsyn(plant, 1, 1))


def test_chapter_two_synthesis(benchmark) -> None:  # type: ignore[no-untyped-def]
    """The synthesis alone; slycot does not come back on it."""
    model = model_named("implied")
    design = design_delay_free(model, [tau / 4.0], 1e-4)
    assert design.hinf is not None
    W1, W2, decay_rate = design.hinf.W1, design.hinf.W2, design.hinf.decay_rate
    benchmark(mixed_sensitivity, design.blocks["G_A"], W1, W2, decay_rate)


def test_chapter_two_infimum(benchmark) -> None:  # type: ignore[no-untyped-def]
    """The decay rate driven down until the infimum of (2.8) is known to 1 %."""
    model = model_named("implied")
    design = design_delay_free(model, [tau / 4.0], 1e-4)
    assert design.hinf is not None
    W1, W2, decay_rate = design.hinf.W1, design.hinf.W2, design.hinf.decay_rate
    benchmark(infimum, design.blocks["G_A"], W1, W2, decay_rate)


def test_chapter_two(benchmark) -> None:  # type: ignore[no-untyped-def]
    """The whole delay-free design."""
    model = model_named("implied")
    benchmark(design_delay_free, model.plant, model.additive_bound, 4.0, 1e-4)
