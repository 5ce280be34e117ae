"""The floor of the peak error: closed forms, laws, certificates by other means, and no run below it."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from held_plant import PLANTS, held_response

from design.design_file import Design
from experiments.__main__ import main
from experiments.engine.simulate import simulate
from experiments.physical_limits import least_peak_error
from experiments.physical_limits import limits_tables as module
from experiments.physical_limits.certificates import Samples, reached, whole
from experiments.physical_limits.intervals import Interval
from experiments.physical_limits.least_peak_error import RestLimit, periodic_limit
from experiments.physical_limits.limits_tables import limits_tables
from experiments.physical_limits.peak_program import PeakProgram
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference, sinusoid
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies.conditions import several_limits
from identification.base.errors import InputError
from identification.model.modes import Mode
from identification.model.plant import PlantModel

CHAPTER_2 = sinusoid(50.0, math.pi / 2, math.pi / 2, -50.0)
CHAPTER_4 = sinusoid(50.0, 1.5, math.pi / 2, 0.0)
RESONANT = PlantModel(3.0, (Mode(30.0, 0.05),), (Mode(45.0, 0.02),), 0.03)


def integrator(gain: float, delay_s: float = 0.0) -> PlantModel:
    return PlantModel(gain, (), (), delay_s)


def floor_of_integrator(gain: float, reference: Reference, limit: float) -> float:
    """a (sqrt(1 - rho^2) - rho arccos(rho))."""
    rho = abs(gain) * limit / (reference.amplitude * reference.omegas[0])
    return reference.amplitude * (math.sqrt(1 - rho**2) - rho * math.acos(rho))


def floor_of_slopes(
    reference: Reference, slope: float, start_s: float, end_s: float, leaves_zero_s: float = -math.inf
) -> float:
    """From start_s to end_s, the distance of r from what has at most a slope, and is 0 until a time: brute force."""
    time_s = np.linspace(start_s, end_s, 2001)
    r = reference(time_s)
    between = np.abs(r[:, None] - r) - slope * np.abs(time_s[:, None] - time_s)
    away = np.abs(r) - slope * np.maximum(0.0, time_s - leaves_zero_s)
    return max(0.0, float(between.max()) / 2, float(away.max()))


def holds(interval: Interval, value: float, width: float) -> None:
    """The value is inside, and the interval no wider than that."""
    assert interval.lower - 1e-9 <= value <= interval.upper + 1e-9
    assert interval.upper - interval.lower < width


@pytest.mark.parametrize(
    ("gain", "reference", "limit", "known"),
    [
        (7.105, CHAPTER_2, 10.0, 1.395),
        (7.105, CHAPTER_4, 10.0, 0.571),
        (-0.3, sinusoid(-2.0, 11.0, 0.4, 30.0), 40.0, None),
        (40.0, sinusoid(1.0, 0.01, -2.0, 1.0), 1e-4, None),
    ],
)
def test_periodic_floor_of_an_integrator(gain: float, reference: Reference, limit: float, known: float | None) -> None:
    exact = floor_of_integrator(gain, reference, limit)
    assert known is None or exact == pytest.approx(known, abs=1e-3)
    holds(periodic_limit(integrator(gain), reference, limit), exact, 3e-4 * reference.amplitude)


def test_several_harmonics_and_a_constant() -> None:
    reference = Reference((3.0, 1.0, 7.0), (2.0, 6.0, 0.0), (0.3, 1.1, 0.5), -4.0)
    exact = floor_of_slopes(reference, 2.0 * 2.5, 0.0, 1.5 * math.pi)
    assert exact > 0.1
    found = periodic_limit(integrator(2.0), reference, 2.5)
    assert found.lower - 1e-5 <= exact <= found.upper + 1e-9  # the brute force looks every 2 ms
    assert found.upper - found.lower < 0.001


def test_stable_plant_must_hold_the_constant_too() -> None:
    """A lag far faster than r: y = K u, and the peak of |r| is out of reach by what K L lacks of it."""
    lag = PlantModel(2.0, (), (), 0.0, 0, (), (400.0,))
    reference = sinusoid(3.0, 1.0, 0.0, -2.0)
    interval = periodic_limit(lag, reference, 2.0)
    assert 0.999 < interval.lower <= 1.0 + 1e-9
    assert 1.0 <= interval.upper < 1.01
    assert periodic_limit(lag, reference, 2.51) == Interval(0.0, 0.0)
    assert periodic_limit(lag, reference, 2.49).lower > 0


def test_double_integrator_needs_the_acceleration() -> None:
    """By a u of one harmonic and its third, dense over amplitude and phase, it does no better, and not much worse."""
    plant, reference = PlantModel(2.0, (), (), 0.0, 2), sinusoid(5.0, 3.0, 0.7, 8.0)
    required = reference.required(plant).value
    assert required == pytest.approx(5.0 * 9.0 / 2.0)
    interval = periodic_limit(plant, reference, 0.9 * required)
    time_s = np.linspace(0, 2 * math.pi / 3, 401)
    wave, third = (np.sin(k * (3 * time_s + 0.7)) for k in (1, 3))
    best = math.inf
    for share in np.linspace(0.9, 1.1, 41):
        for other in np.linspace(-0.1, 0.3, 81):
            if np.abs(share * wave + other * third).max() <= 0.9:
                best = min(best, 5.0 * np.abs((1 - share) * wave - other / 9 * third).max())
    assert interval.lower <= best
    assert interval.upper <= 1.001 * best
    assert interval.upper - interval.lower < 0.01 * interval.upper


@pytest.mark.parametrize("plant", [integrator(7.105, 0.3), RESONANT])
def test_nothing_is_out_of_reach_from_the_required_amplitude_on(plant: PlantModel) -> None:
    required = CHAPTER_4.required(plant).value
    assert periodic_limit(plant, CHAPTER_4, required * (1 + 1e-12)) == Interval(0.0, 0.0)
    assert periodic_limit(plant, CHAPTER_4, 0.97 * required).lower > 0


def test_floor_scales_with_amplitude_and_limit_together_and_ignores_dead_time_offset_and_sign() -> None:
    limit = 0.93 * CHAPTER_4.required(RESONANT).value
    one = periodic_limit(RESONANT, CHAPTER_4, limit)
    large = periodic_limit(RESONANT, sinusoid(7.3 * 50.0, 1.5, math.pi / 2, 0.0), 7.3 * limit)
    assert (large.lower, large.upper) == pytest.approx((7.3 * one.lower, 7.3 * one.upper), rel=1e-4)
    weak = PlantModel(-RESONANT.gain / 4, RESONANT.zero_modes, RESONANT.pole_modes, 0.0)
    for other in (
        periodic_limit(weak, CHAPTER_4, 4 * limit),
        periodic_limit(RESONANT, sinusoid(50.0, 1.5, -0.4, 17.0), limit),
    ):
        assert other.lower <= one.upper
        assert one.lower <= other.upper
        assert (other.lower, other.upper) == pytest.approx((one.lower, one.upper), rel=5e-3)


def test_interval_of_a_resonant_plant_is_narrow_and_falls_with_the_limit() -> None:
    required = CHAPTER_4.required(RESONANT).value
    found = [periodic_limit(RESONANT, CHAPTER_4, share * required) for share in (0.7, 0.8, 0.9, 0.97)]
    for interval in found:
        assert 0 < interval.lower <= interval.upper
        assert interval.upper - interval.lower < max(0.01 * interval.upper, 2e-4 * 50.0)
    for weak, strong in pairwise(found):
        assert strong.upper < weak.lower


def test_resonance_much_faster_than_a_step() -> None:
    plant = PlantModel(7.105, (), (Mode(6e3, 0.01),), 0.0)
    exact = floor_of_integrator(7.105, CHAPTER_4, 10.0)
    interval = periodic_limit(plant, CHAPTER_4, 10.0)
    assert interval.lower == pytest.approx(exact, rel=0.01)
    assert interval.upper == pytest.approx(exact, rel=0.01)
    assert interval.lower <= interval.upper


@pytest.mark.parametrize("name", [name for name, plant in PLANTS.items() if plant.relative_degree > 0])
def test_no_held_input_betters_the_floor_and_the_optimum_reaches_what_it_says(name: str) -> None:
    """Held inputs, random and saturated trackers, by partial fractions: none is below; the program's own is at E."""
    plant = PLANTS[name].without_delay()
    omega = 12.0
    reference = sinusoid(3.0, omega, 0.8, 0.0)
    period = 2 * math.pi / omega
    limit = 0.9 * reference.required(plant).value
    program = PeakProgram(plant, Fraction(2 * period), 120, periodic=False)
    r, first = reference(program.time_s), 30 * program.fineness
    interval = program.solve(reference, (-limit, limit), first)
    counted = slice(first, program.counted)

    def peak(u: np.ndarray) -> float:
        y = held_response(plant, program.cell_s, np.append(u, 0.0))
        return float(np.abs(r - y)[counted].max())

    rng = np.random.default_rng(4)
    middle = program.time_s[:-1] + program.cell_s / 2
    angle = np.angle(complex(plant(1j * omega)))
    tracker = 3.0 / abs(complex(plant(1j * omega))) * np.sin(omega * middle + 0.8 - angle)
    for trial in range(6):
        pushed = tracker * (1 + trial / 4) + limit * trial / 4 * np.sin(rng.uniform(1, 40) * middle)
        assert peak(np.clip(pushed, -limit, limit)) >= interval.lower
    u, _ = program._optimum(r / 3.0, limit / 3.0, (-1.0, 1.0), slice(first, len(r)))
    assert np.abs(u).max() <= 1.0
    cells, samples = program._cells, Samples(r / 3.0, 1e-15, 0.0)
    claimed = 3.0 * reached(cells, whole(u, centred=False), samples, limit / 3.0, counted)
    assert peak(limit * u) == pytest.approx(claimed, rel=0.02)
    assert interval.lower <= peak(limit * u) <= claimed + 1e-9


@pytest.mark.parametrize(("limit", "delay_s"), [(10.0, 0.3), (14.0, 0.0)])
def test_error_from_rest_of_an_integrator(limit: float, delay_s: float) -> None:
    rest = RestLimit(integrator(7.105, delay_s), CHAPTER_4, limit, steps=100)
    slope = 7.105 * limit
    for index in (-1, 0, 40, 48, 100, 400):
        exact = floor_of_slopes(CHAPTER_4, slope, rest.start_s(index), rest.horizon_s, delay_s)
        found = rest.at(index)
        assert found.lower - 0.02 <= exact <= found.upper + 0.02  # of the brute force
        assert found.upper - found.lower < 0.5
    assert rest.start_s(-1) == 0.0
    assert rest.start_s(0) == pytest.approx(delay_s)
    assert rest.at(-1).lower == pytest.approx(50.0)


def test_first_time_within_a_band_from_rest() -> None:
    rest = RestLimit(integrator(7.105, 0.3), CHAPTER_4, 14.0, steps=60)
    found = rest.settling(0.5)
    starts = np.linspace(0.3, 1.5, 481)
    exact = starts[bisect_left(starts, -0.5, key=lambda t: -floor_of_slopes(CHAPTER_4, 7.105 * 14.0, t, 4.0, 0.3))]
    assert found.lower <= exact <= found.upper + starts[1] - starts[0]
    assert found.upper - found.lower <= 2.01 * (rest.start_s(1) - rest.start_s(0))
    assert rest.settling(51.0) == Interval(0.0, 0.0)


def test_no_first_time_where_the_floor_is_above_the_band() -> None:
    found = RestLimit(integrator(7.105), CHAPTER_4, 8.0, steps=60).settling(0.5)
    assert math.isnan(found.lower)
    assert math.isnan(found.upper)


def test_table_of_the_start_from_rest_falls_and_is_finest_where_it_falls() -> None:
    ticks: list[int] = []
    rest = RestLimit(
        RESONANT, CHAPTER_4, 1.1 * CHAPTER_4.required(RESONANT).value, steps=60, tick=lambda: ticks.append(1)
    )
    table = rest.table()
    assert (table["rest_lower"] <= table["rest_upper"]).all()
    assert (np.diff(table["rest_lower"]) <= 0).all()
    assert (np.diff(table["rest_upper"]) <= 0).all()
    assert (np.diff(table["start_s"]) > 0).all()
    assert table["start_s"].iloc[:2].tolist() == [0.0, pytest.approx(0.03)]
    assert table["rest_lower"].iloc[0] == pytest.approx(50.0)
    assert table["rest_upper"].iloc[-1] < 0.5
    assert len(ticks) <= 20 <= len(table) < 60
    falling = table["start_s"][table["rest_upper"] > 0.5]
    assert np.diff(falling).min() < 0.02


@pytest.mark.parametrize(
    ("plant", "reference", "limit", "words"),
    [
        (PlantModel(-2.0, (), (), 0.1, 0), CHAPTER_4, 1.0, "the plant is a constant gain of -2, whose least error"),
        (PlantModel(1.0, (), (Mode(5.0, -0.1),), 0.0, 0), CHAPTER_4, 1.0, "of real part 0.5 rad/s; expected none"),
        (integrator(1.0), CHAPTER_4, (2.0, -3.0), "limits are 2 and -3; expected the lower one first"),
        (integrator(1.0), CHAPTER_4, (0.0, 3.0), "limits are 0 and 3; expected a negative and a positive one for"),
        (integrator(1.0), sinusoid(1.0, 0.0, 1.57, 1.0), 1.0, "the reference is a constant"),
        (PlantModel(2.0, (), (), 0.0, 0, (), (4.0,)), sinusoid(3.0, 0.0, 1.57), 1.0, "steady control of 1.5"),
        (integrator(1.0), Reference((1.0, 1.0), (2.0, 3.0), (0.0, 0.0), 0.0), 1.0, "frequencies 2, 3 rad/s"),
        (integrator(1.0), CHAPTER_4, 0.0, "the saturation limit is 0; expected a positive number"),
        (integrator(1.0), CHAPTER_4, math.inf, "limits are -inf and inf; expected finite ones"),
        (integrator(1.0), CHAPTER_4, math.nan, "the saturation limit is nan"),
        (PlantModel(1.0, (), (), 0.0, 1, (), (1e9,)), CHAPTER_4, 1.0, "1e\\+09 rad/s, is too fast for"),
    ],
)
def test_refusals(plant: PlantModel, reference: Reference, limit: float | tuple[float, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        periodic_limit(plant, reference, limit)
    with pytest.raises(InputError, match=words):
        RestLimit(plant, reference, limit).at(0)


def test_an_actuator_of_one_sign_on_a_plant_that_follows_at_once() -> None:
    """y = K u, 0 <= u <= 2: of r between -2 and 4 the error is 2 below, and nothing more above than K = 1.5 leaves."""
    lag, reference = PlantModel(1.5, (), (), 0.0, 0, (), (4e3,)), sinusoid(3.0, 1.0, 0.0, 1.0)
    for limits, exact in (((0.0, 2.0), 2.0), ((-1.5, 2.0), 1.0), ((-1.5, 2.7), 0.0)):
        holds(periodic_limit(lag, reference, limits), exact, 0.01)
    mirrored = sinusoid(-3.0, 1.0, 0.0, -1.0)
    assert periodic_limit(lag, mirrored, (-2.0, 1.5)).lower == pytest.approx(1.0, rel=0.01)


def test_two_integrators_with_a_zero_in_the_right_half_plane_have_a_floor() -> None:
    """HiGHS leaves programs of this plant unsolved, by its simplex and by its interior points."""
    plant = PlantModel(1.0, (), (), 0.1, 2, (-5.0,), (10.0, 8.0))
    rest = RestLimit(plant, sinusoid(1.0, 0.1 * math.pi), 1.0, 40)
    first, last = rest.at(0), rest.at(rest.last)
    assert last.upper < 1e-3
    assert 0.19 < first.lower <= first.upper < 0.21
    assert first.upper - first.lower < 0.01


@pytest.mark.parametrize("band", [0.0, math.nan])
def test_band_must_be_positive(band: float) -> None:
    with pytest.raises(InputError, match="expected a positive number"):
        RestLimit(integrator(1.0), CHAPTER_4, 1.0).settling(band)


@pytest.fixture(scope="module")
def tables(extended_design: Design) -> dict[str, pd.DataFrame]:
    patch = pytest.MonkeyPatch()
    patch.setattr(least_peak_error, "STARTS", 4)
    patch.setattr(module, "FEWER_STEPS", 40)
    patch.setattr(module, "RUN_PERIODS", 4)
    found = limits_tables(extended_design, thesis_reference("extended", (1.5,)), [12.5, 9.5])
    patch.undo()
    return found


def test_no_run_betters_the_floor(tables: dict[str, pd.DataFrame]) -> None:
    rows, rest = tables["limits_extended"], tables["limits_extended_summary"]
    for run in ("none", "thesis", "corrected"):
        assert (rows[f"peak_{run}"] >= rows["periodic_lower"]).all()
        assert rows[f"ratio_{run}"][0] == pytest.approx(rows[f"peak_{run}"][0] / rows["periodic_lower"][0])
        assert (rest[f"tail_{run}"] >= rest["rest_lower"] - 1e-9).all()
        assert (rest[f"tail_{run}"] >= rest["rest_upper"] - 1e-9).all(), "its control is one that was found"
        assert (np.diff(rest[f"tail_{run}"]) <= 0).all()
        settled = rows[f"settling_{run}_s"]
        assert np.isnan(settled[0])
        assert np.isnan(settled[1]) or settled[1] >= rows["settling_upper_s"][1] >= rows["settling_lower_s"][1]
    assert rows["ratio_none"].isna().tolist() == [False, True]


def test_rows_are_ascending_and_the_summary_is_for_the_first_limit(tables: dict[str, pd.DataFrame]) -> None:
    rows, rest = tables["limits_extended"], tables["limits_extended_summary"]
    assert rows["limit"].tolist() == [9.5, 12.5]
    assert set(rest["limit"]) == {12.5}
    assert rows["required"].tolist() == pytest.approx([10.556] * 2, abs=1e-3)
    assert rows["periodic_upper"].tolist()[1] == 0.0
    assert rows["periodic_lower"][0] == pytest.approx(1.4956, rel=5e-3)
    assert rows["settling_lower_s"].isna().tolist() == [True, False]
    assert 0.42 < rows["settling_lower_s"][1] <= rows["settling_upper_s"][1] < 0.48


def test_rows_of_unequal_limits(delay_free_design: Design, monkeypatch: pytest.MonkeyPatch) -> None:
    """Solved without a program; the runs are those under the same limits."""
    monkeypatch.setattr(module, "periodic_limit", lambda *_: Interval(9.0, 9.0))
    monkeypatch.setattr(module, "RUN_PERIODS", 2)
    monkeypatch.setattr(RestLimit, "at", lambda *_: Interval(1.0, 2.0))
    monkeypatch.setattr(RestLimit, "_known", lambda *_: Interval(1.0, 2.0))
    reference = thesis_reference("delay-free", delay_free_design.reference_omegas)
    found = limits_tables(delay_free_design, reference, [(-9.0, 12.0), 10.0])
    rows, summary = found["limits_delay_free"], found["limits_delay_free_summary"]
    assert rows[["lower_limit", "limit"]].to_numpy().tolist() == [[-10.0, 10.0], [-9.0, 12.0]]
    assert summary["lower_limit"].unique() == [-9.0]
    period = reference.period_s
    loop = design_loop(delay_free_design, reference, None)
    error = simulate(loop, (-9.0, 12.0), np.linspace(0.0, 2 * period, 4001)).outputs["error"]
    assert rows["peak_none"][1] == pytest.approx(np.abs(error[2000:]).max(), rel=1e-4)


def test_usual_limits(delay_free_design: Design, monkeypatch: pytest.MonkeyPatch) -> None:
    """The printed one, for which the summary is, and multiples of the required one; nothing is solved here."""
    monkeypatch.setattr(module, "periodic_limit", lambda *_: Interval(9.0, 9.0))
    monkeypatch.setattr(module, "RUN_PERIODS", 1)
    monkeypatch.setattr(RestLimit, "at", lambda *_: Interval(1.0, 2.0))
    monkeypatch.setattr(RestLimit, "_known", lambda *_: Interval(1.0, 2.0))
    monkeypatch.setattr(least_peak_error, "HORIZON", 1)
    reference = thesis_reference("delay-free", delay_free_design.reference_omegas)
    found = limits_tables(delay_free_design, reference, several_limits(delay_free_design))
    required = found["limits_delay_free"]["required"][0]
    shares = found["limits_delay_free"]["limit"] / required
    assert shares.tolist() == pytest.approx([0.8, 0.9, 10.0 / required, 0.95, 0.98, 1.05, 1.2, 1.5])
    assert set(found["limits_delay_free_summary"]["limit"]) == {10.0}
    assert found["limits_delay_free"]["settling_lower_s"].isna().all()


def test_command_line(extended_design: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def found(
        design: Design, reference: Reference, limits: Sequence[float], tick: object, *runs: object, scheduler: str
    ) -> dict[str, pd.DataFrame]:
        asked.append((design.kind, reference, limits, *runs, scheduler))
        return {"limits_extended": pd.DataFrame({"limit": [2.0]}), "limits_extended_summary": pd.DataFrame({"a": [1]})}

    monkeypatch.setattr("experiments.physical_limits.limits_tables.limits_tables", found)
    path = tmp_path / "design.json"
    path.write_text(extended_design.to_json(), encoding="utf-8")
    own = ["limits", "--limit", "9", "--limit", "-3", "12.5", "--amplitude", "7", "--offset", "2", "--rate-limit", "4"]
    for given in (["thesis", "limits", "--scheduler", "tcp://host:8786"], own):
        result = CliRunner().invoke(main, [*given, str(path), "--output", str(tmp_path)])
        assert (result.exit_code, result.output) == (0, "")
    assert asked == [
        ("extended", thesis_reference("extended", (1.5,)), several_limits(extended_design), "tcp://host:8786"),
        ("extended", Reference((7.0,), (1.5,), (0.0,), 2.0), ((9.0,), (-3.0, 12.5)), ("none", "corrected"), 4.0, None),
    ]
    assert sorted(file.name for file in tmp_path.glob("*.csv")) == [
        "limits_extended.csv",
        "limits_extended_summary.csv",
    ]


@pytest.mark.parametrize("limit", ["-3", "0", "nan", "inf"])
def test_command_line_refuses_limits(extended_design: Design, tmp_path: Path, limit: str) -> None:
    path = tmp_path / "design.json"
    path.write_text(extended_design.to_json(), encoding="utf-8")
    result = CliRunner().invoke(
        main, ["limits", str(path), "--limit", "9", "--limit", limit, "--amplitude", "50", "--output", str(tmp_path)]
    )
    assert result.exit_code == 2
    positive = f"Error: the saturation limit is {limit}; expected a positive number, or a lower and an upper one\n"
    finite = "Error: the saturation limits are -inf and inf; expected finite ones\n"
    assert result.stderr == (finite if limit == "inf" else positive)
    assert not list(tmp_path.glob("*.csv"))
