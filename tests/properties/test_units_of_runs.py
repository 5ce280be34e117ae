"""A run is the same in other units of time, output and input, whatever the sign of the plant's gain.

A finished design is scaled, and with powers of 2 every number of it exactly. Then only logarithms and eigenvalues
round differently, and the limits of what the engine claims hold: 1e-11 of the largest value of a signal.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from other_units import Units, same

from design.__main__ import main as design_main
from design.blocks.block import Block
from design.design_file import Design, read_design
from experiments.__main__ import main as experiments_main
from experiments.drive.sampled_loop import Drive, SampledRun, simulate_sampled
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import DivergenceError, Run, simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.guarantee import guarantee
from experiments.runs.references import Reference, SampledReference
from experiments.runs.sector_promise import judge_run
from experiments.runs.verdict import Verdict
from experiments.runs.words import sector_text
from identification.model.modes import Mode
from identification.model.plant import PlantModel

SIGNS = st.sampled_from([-1.0, 1.0])
POWERS = st.builds(
    Units,
    st.integers(-30, 30).map(lambda n: 2.0**n),
    st.builds(lambda n, sign: sign * 2.0**n, st.integers(-25, 25), SIGNS),
    st.builds(lambda n, sign: sign * 2.0**n, st.integers(-25, 25), SIGNS),
)
ANY = st.builds(
    Units,
    st.floats(-9, 9).map(lambda n: 10.0**n),
    st.builds(lambda n, sign: sign * 10.0**n, st.floats(-7.5, 7.5), SIGNS),
    st.builds(lambda n, sign: sign * 10.0**n, st.floats(-7.5, 7.5), SIGNS),
)
REFERENCES: dict[str, Reference | SampledReference] = {
    "sinusoid": Reference((5.0,), (0.5,), (0.3,), 1.0),
    "several": Reference((5.0, -2.0), (0.5, 1.7), (0.3, 1.0), 1.0),
    "constant": Reference((8.0,), (0.0,), (1.2,), 1.0),
    "ramp": Reference((3.0,), (0.5,), (0.0,), 0.0, 1.5),
    "file": SampledReference(np.array([0.4, 1.0, 3.1, 3.3, 7.0]), np.array([1.0, -4.0, 3.0, 3.0, -2.0])),
}
TRUE_PLANTS = {
    "its own": None,
    "another": PlantModel(2.0, (Mode(3.1, 0.05),), (Mode(3.9, 0.05),), 0.25),
    "two integrators": PlantModel(0.5, (), (Mode(4.0, 0.5),), 0.01, 2),
}
RUNAWAY = Block(1.0, (-0.7 + 0j,), (0.7 + 0j,))
LIMITS = ((-1.5, 1.5), (-2.0, 0.7), (-np.inf, 1.0))
TIME_S = np.linspace(0.0, 12.0, 97)
quick = settings(
    max_examples=10, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def scaled(units: Units, reference: Reference | SampledReference) -> Reference | SampledReference:
    return units.reference(reference) if isinstance(reference, Reference) else units.samples(reference)


def simulated(
    design: Design, units: Units, kind: str, reference: str, plant: str, limits: tuple[float, float]
) -> tuple[Run, Verdict | None]:
    """A run of a design in given units, and whether its guarantee covers it."""
    own, asked, true = units.design(design), scaled(units, REFERENCES[reference]), TRUE_PLANTS[plant]
    anti_windup = None if kind == "none" else own.compensator(kind)
    true = None if true is None else units.plant(true)
    low, high = sorted(limit * units.input for limit in limits)
    loop = design_loop(own, asked, anti_windup, true)
    run = simulate(loop, (low, high), TIME_S * units.time)
    if anti_windup is None or plant == "two integrators":
        return run, None
    found = judge_run(guarantee(own, anti_windup, true), loop, (low, high), run, asked, true or own.loop_plant)
    return run, found


def same_runs(found: Run, expected: Run, units: Units, share: float) -> None:
    same(found.control / units.input, expected.control, share)
    for name in ("output", "error", "y_lin"):
        same(found.outputs[name] / units.output, expected.outputs[name], share)
    same(found.events_s / units.time, expected.events_s, share)
    np.testing.assert_array_equal(found.modes * np.sign(units.input), expected.modes)


def same_verdicts(found: Verdict | None, expected: Verdict | None, units: Units, share: float) -> None:
    if found is None or expected is None:
        assert found is expected
        return
    size = abs(units.input)
    assert (found.covered, found.guarantee.missing) == (expected.covered, expected.guarantee.missing)
    assert found.guarantee.sector == pytest.approx(expected.guarantee.sector, rel=share)
    assert found.needed_sector == pytest.approx(expected.needed_sector, rel=share, abs=share)
    assert found.largest_control / size == pytest.approx(expected.largest_control, rel=share)
    steady, limits = (np.sort(np.array(each) / units.input) for each in (found.steady, found.limits))
    assert steady == pytest.approx(np.array(expected.steady), rel=share, abs=share * np.abs(expected.steady).max())
    assert limits == pytest.approx(np.array(expected.limits), rel=share)


@pytest.mark.parametrize(("units", "share"), [(POWERS, 1e-11), (ANY, 1e-10)], ids=["powers of 2", "any"])
def test_a_run_is_the_same(small_designs: dict[str, Design], units: st.SearchStrategy[Units], share: float) -> None:
    @quick
    @given(
        units=units,
        design=st.sampled_from(["extended", "delay-free"]),
        kind=st.sampled_from(["none", "thesis", "corrected"]),
        reference=st.sampled_from(list(REFERENCES)),
        plant=st.sampled_from(list(TRUE_PLANTS)),
        limits=st.sampled_from(LIMITS),
        delay=st.sampled_from([0.2, 0.0, 1e-4]),
    )
    def check(
        units: Units,
        design: str,
        kind: str,
        reference: str,
        plant: str,
        limits: tuple[float, float],
        delay: float,
    ) -> None:
        own = small_designs[design]
        own = replace(own, plant=replace(own.plant, delay_s=delay))
        expected = simulated(own, Units(), kind, reference, plant, limits)
        found = simulated(own, units, kind, reference, plant, limits)
        same_runs(found[0], expected[0], units, share)
        same_verdicts(found[1], expected[1], units, share)

    check()


@quick
@given(units=ANY, kind=st.sampled_from(["none", "thesis", "corrected"]), method=st.sampled_from(["tustin", "exact"]))
def test_a_sampled_run_is_the_same(small_designs: dict[str, Design], units: Units, kind: str, method: str) -> None:
    """Tustin's theta1~ makes the thesis's control chatter at the limits, which costs it three digits."""

    def run(units: Units) -> SampledRun:
        own, size = units.design(small_designs["extended"]), abs(units.input)
        drive = Drive(
            8 / units.time, method, (-1.5 * size, 1.5 * size), 0.01 * size, 5 * size / units.time, 0.05 * units.time
        )
        anti_windup = None if kind == "none" else own.compensator(kind)
        return simulate_sampled(own, scaled(units, REFERENCES["several"]), anti_windup, drive, 12 * units.time)

    found, expected = run(units), run(Units())
    same(found.output / units.output, expected.output, 1e-11)
    same(found.control / units.input, expected.control, 1e-8)


def integrators(time: float) -> SaturatedLoop:
    """x' = sat(u) of a control that is a ramp: nothing in it has a time constant."""
    A = np.zeros((3, 3))
    A[0, 1] = 1.0
    u, _, x = np.eye(3)
    start, none = np.array([-1.0, 1 / time, 0.0]), np.zeros(1)
    outputs = {"x": (x, none)}
    return SaturatedLoop(
        A=A, B=x, C=u, D=np.zeros((3, 1)), E=none, Z=x[None, :], delays=none, x0=start, outputs=outputs
    )


@pytest.mark.parametrize("time", [2.0**-30, 2.0**30, 1e9])
def test_integrators_alone(time: float) -> None:
    """The step of a loop without time constants is no number of seconds."""
    runs = {T: simulate(integrators(T), (-0.5, 0.7), np.linspace(0, 3, 7) * T) for T in (1.0, time)}
    same(runs[time].outputs["x"] / time, runs[1.0].outputs["x"], 1e-14)
    same(runs[time].events_s / time, runs[1.0].events_s, 1e-14)


@pytest.mark.parametrize("units", [Units(2.0**-30, 1.0, 2.0**50), Units(1.0, 2.0**40, 2.0**-40)], ids=str)
def test_a_loop_diverges_at_the_same_time(small_designs: dict[str, Design], units: Units) -> None:
    """In multiples of the limits: a number of the user's unit is no bound."""

    def found(units: Units, sampled: bool) -> float:
        own, limit = units.design(small_designs["extended"]), 2.0 * units.input
        asked = scaled(units, REFERENCES["sinusoid"])
        unstable = replace(own, blocks={**own.blocks, "K": own.blocks["K"] * units.block(RUNAWAY)})
        drive = Drive(8 / units.time, "exact", (-limit, limit))
        with pytest.raises(DivergenceError, match="times the limits") as caught:
            _ = (
                simulate_sampled(unstable, asked, None, drive, 500 * units.time)
                if sampled
                else simulate(design_loop(unstable, asked, None), drive.limits, np.array([500.0]) * units.time)
            )
        return caught.value.time_s / units.time

    for sampled in (False, True):
        assert found(units, sampled) == pytest.approx(found(Units(), sampled), rel=1e-12)


def test_a_sector_of_1_is_said_as_1(small_designs: dict[str, Design]) -> None:
    """s/(s + b) has every sector below 1; rounding left 1 - 2e-16 of it, which "covered" a control of 1e17."""
    for time in (1.0, 1e9, 3e-5):
        own = Units(time, 7.0, -0.3).design(small_designs["delay-free"])
        found = guarantee(own, own.compensator("corrected"))
        assert (found.sector, sector_text(found.sector)) == (1.0, "1")


@pytest.mark.parametrize("units", [Units(1e-9, 1e15, 1.0), Units(1e9, 1.0, -1e-15)], ids=str)
def test_the_commands_say_the_same(small_designs: dict[str, Design], units: Units, tmp_path: Path) -> None:
    """``simulate``, ``sampled`` and ``design anti-windup``: their tables to 12 digits, the verdict word for word."""
    said = {}
    for each in (Units(), units):
        own, out, T = tmp_path / "design.json", tmp_path / "run.csv", each.time
        own.write_text(each.design(small_designs["extended"]).to_json(), encoding="utf-8")
        added = ["anti-windup", str(own), "--name", "mine", f"--numerator={-2 / T!r}", f"--denominator=1 {2 / T!r}"]
        result = CliRunner().invoke(design_main, [*added, "--output", str(own.with_name("added.json"))])
        assert result.exit_code == 0, result.output
        judged = read_design(own.with_name("added.json")).added["mine"].judgement
        numbers = [judged.f / abs(each.gain), (judged.f_omega or 0.0) * T, judged.popov_sector or 0.0]
        numbers += [judged.theta1_tilde_at_zero, judged.recovery_s / T, judged.theta2_stable]
        options = ["--limit", repr(1.5 * abs(each.input)), "--until", repr(8 * T), "--amplitude", repr(5 * each.output)]
        options += ["--phase", repr(math.pi / 2)]
        for more in (
            ["simulate", "--sample-time", repr(0.5 * T)],
            ["sampled", "--rate", repr(8 / T), "--method", "exact"],
        ):
            command, *rest = more
            arguments = [command, str(own.with_name("added.json")), *options, *rest, "--anti-windup", "mine"]
            result = CliRunner().invoke(experiments_main, [*arguments, "--output", str(out)])
            assert result.exit_code == 0, result.output
            table = np.genfromtxt(out, delimiter=",", skip_header=1)
            table /= [T, *(each.output,) * 3, *(each.input,) * 2]
            numbers += list(table.ravel())
        in_own_time = re.sub(r"([\d.e+-]+) Hz", lambda rate, T=T: f"{float(rate[1]) * T:.3g} Hz", result.output)
        said[each] = np.array(numbers, dtype=float), in_own_time.split(" at t = ")[0]
    (found, words), (expected, usual) = said[units], said[Units()]
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-9)
    assert words == usual
