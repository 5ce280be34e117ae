"""The chapter 4 loop against python-control with Pade, jitcdde, DOP853 by the method of steps, and plain C."""

from __future__ import annotations

import gc
import os
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_c import c_run
from peers import SAID_OF_JITCDDE, collapsed_response, jitcdde_run, pade_response

from data.thesis import model_named
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.engine.pade import with_pade
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import Run, simulate
from experiments.runs.batch import simulate_many
from experiments.runs.design_loop import design_loop
from experiments.thesis.printed_choices import thesis_reference

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "unit"))
from oracle import reference_run

LIMIT = 12.0
LIMITS = (-LIMIT, LIMIT)
WHOLE_S = 30.0
PADE_S = 10.0  # python-control takes seconds for each second


@pytest.fixture(scope="module")
def design() -> Design:
    model = model_named("implied")
    return design_extended(model, [1.5], 4.0, [(2.0, 1.0)])


@pytest.fixture(scope="module")
def loop(design: Design) -> SaturatedLoop:
    """The loop with the thesis's anti-windup, from rest."""
    return design_loop(design, thesis_reference("extended", [1.5]), design.compensator("thesis"))


def times(horizon_s: float) -> np.ndarray:
    """Every millisecond up to the horizon."""
    return np.linspace(0.0, horizon_s, round(1000 * horizon_s) + 1)


def output_alone(loop: SaturatedLoop) -> SaturatedLoop:
    """The same loop, asked for y, as the peers are."""
    return replace(loop, outputs={"output": loop.outputs["output"]})


def off(values: np.ndarray, exact: np.ndarray) -> float:
    """The largest difference, as a share of the largest exact value."""
    return float(np.abs(values - exact).max() / np.abs(exact).max())


@pytest.mark.parametrize("horizon_s", [PADE_S, WHOLE_S], ids=lambda horizon: f"{horizon:g}_s")
def test_ours_alone(benchmark: Any, loop: SaturatedLoop, horizon_s: float) -> None:
    """Thirty rounds of one run: the spread is the noise of the machine."""
    time_s = times(horizon_s)
    simulate(loop, LIMITS, time_s)
    benchmark.pedantic(lambda: simulate(loop, LIMITS, time_s), rounds=30, iterations=1)


@pytest.mark.parametrize("form", ["interconnected", "collapsed"])
def test_against_python_control(design: Design, loop: SaturatedLoop, against: Callable[..., None], form: str) -> None:
    """Ten seconds with second-order Pade: blocks joined by interconnect, and the whole loop as one function."""
    time_s = times(PADE_S)
    pade = simulate(with_pade(loop, 2), LIMITS, time_s).outputs["output"]
    if form == "interconnected":
        peer = pade_response(design, LIMIT, time_s, tolerance=1e-6)
    else:
        peer = collapsed_response(with_pade(loop, 2), LIMIT, time_s, tolerance=1e-6)

    def error(ours: Run, output: np.ndarray) -> str:
        exact = ours.outputs["output"]
        return (
            f"{PADE_S:g} s, rtol = atol = 1e-6: {off(output, exact):.1e} of y, "
            f"of which Pade {off(pade, exact):.1e}, its solver {off(output, pade):.1e}"
        )

    alone = output_alone(loop)
    against(lambda: simulate(alone, LIMITS, time_s), peer, rounds=1, error=error)


def test_against_jitcdde(loop: SaturatedLoop, against: Callable[..., None]) -> None:
    """The whole run, a sample every 10 ms; compiling is not in the ratio."""
    time_s = times(WHOLE_S)[50::10]
    loop = output_alone(loop)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        peer, compile_s = jitcdde_run(loop, LIMIT, time_s, tolerance=1e-8)

        def error(ours: Run, delayed: np.ndarray) -> str:
            return f"{WHOLE_S:g} s, {SAID_OF_JITCDDE}: {off(delayed, exact):.1e} of y; compiled in {compile_s:.2g} s"

        # its states give y ahead of the dead time
        exact = simulate(loop, LIMITS, time_s + loop.delays[0]).outputs["output"]
        against(lambda: simulate(loop, LIMITS, time_s), peer, error=error)
        del peer
        gc.collect()  # jitcdde leaves its folder to the garbage collector, which warns


def test_against_dop853_by_steps(loop: SaturatedLoop, against: Callable[..., None]) -> None:
    """Half a second at 1e-9."""
    time_s = np.linspace(0.0, 0.5, 51)

    def error(ours: Run, theirs: tuple[np.ndarray, dict[str, np.ndarray]]) -> str:
        return f"0.5 s, rtol = atol = 1e-9: {off(theirs[0], ours.control):.1e} of u"

    against(
        lambda: simulate(loop, LIMITS, time_s),
        lambda: reference_run(loop, LIMITS, time_s, 1e-9),
        rounds=1,
        error=error,
    )


@pytest.mark.parametrize("kind", ["none", "thesis"])
def test_against_c(design: Design, against: Callable[..., None], kind: str) -> None:
    """The whole run, a sample a millisecond: all of ours, its setting up too, against straight C code for this loop."""
    loop = design_loop(design, thesis_reference("extended", [1.5]), kind)
    time_s = times(WHOLE_S)

    def error(ours: Run, theirs: np.ndarray) -> str:
        return f"{WHOLE_S:g} s: {off(theirs, np.array(list(ours.outputs.values()))):.1e} of all outputs"

    against(lambda: simulate(loop, LIMITS, time_s), c_run(loop, LIMIT, time_s), rounds=30, error=error)


def test_a_batch_against_single_runs(design: Design, against: Callable[..., None]) -> None:
    """A hundred runs of 30 s in one call, on all cores, against one after the other on one."""
    reference, names, time_s = thesis_reference("extended", [1.5]), ["thesis", "corrected"], times(WHOLE_S)[::10]
    kinds = {name: design.compensator(name) for name in names}
    plants = [replace(design.plant, gain=design.plant.gain * factor) for factor in np.linspace(0.9, 1.1, 50)]

    def single() -> list[Run]:
        loops = [design_loop(design, reference, kind, plant) for plant in plants for kind in kinds.values()]
        return [simulate(loop, LIMITS, time_s) for loop in loops]

    def batch() -> list[object]:
        return [run for _, run in simulate_many(design, plants, [reference], kinds, [LIMIT], time_s)]

    def error(ours: list[Run], theirs: list[Run]) -> str:
        same = all(np.array_equal(a.control, b.control) for a, b in zip(ours, theirs, strict=True))
        return f"{os.cpu_count()} cores: {'the same' if same else 'other'} numbers to the last bit"

    against(batch, single, our_rounds=5, error=error)
