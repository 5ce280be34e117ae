"""The search for what the thesis does not print: initial outputs, readings, limits, and both chapters together."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from data.thesis import printed_numbers
from experiments.__main__ import main
from experiments.engine.simulate import Run, simulate
from experiments.runs.design_loop import design_loop
from experiments.thesis import printed_choices
from experiments.thesis.claims.printed_number import PrintedNumber
from experiments.thesis.unprinted import chapter_2_weights, joint_search, search
from experiments.thesis.unprinted.chapter_2_weights import Weights, delay_free_rows, delay_free_scan, loop_of
from experiments.thesis.unprinted.chapter_4_conditions import Conditions, Point, starting_at, with_pade_at_rest
from experiments.thesis.unprinted.joint_search import judged, together
from experiments.thesis.unprinted.printed_outcomes import (
    CLAIMS,
    READINGS,
    printed_outcomes,
    settled_s,
    with_anti_windup,
    without_anti_windup,
)
from experiments.thesis.unprinted.search import Grid, alone, approximated, every_condition, grid_of, scanned
from experiments.thesis.unprinted.where_met import where_met

COARSE = Grid(np.array([1.1, 1.2, 1.3, 1.8, 1.9]), np.array([1.001, 1.05, 1.1]), np.linspace(0.8, 1.2, 3))


@pytest.fixture(scope="module")
def by_delay() -> dict[str, Conditions]:
    return {one.delay: one for one in every_condition(["implied"])}


@pytest.fixture(scope="module")
def implied_exact(by_delay: dict[str, Conditions]) -> Conditions:
    return by_delay["exact"]


@pytest.fixture(scope="module")
def scan(implied_exact: Conditions) -> pd.DataFrame:
    return scanned([implied_exact], COARSE.scan)


@pytest.fixture(scope="module")
def separate(implied_exact: Conditions, scan: pd.DataFrame) -> pd.DataFrame:
    return alone([implied_exact], scan)


@pytest.fixture(scope="module")
def points(implied_exact: Conditions) -> pd.DataFrame:
    return grid_of([implied_exact], COARSE)


@pytest.fixture(scope="module")
def chapter_2() -> pd.DataFrame:
    return delay_free_scan(["implied"], np.array([0.88, 0.96, 0.99, 0.995, 1.05]), [Weights(), Weights(level=0.1)])


@pytest.fixture(scope="module")
def needs(chapter_2: pd.DataFrame) -> pd.DataFrame:
    return delay_free_rows(["implied"], chapter_2)


# the initial output


@pytest.mark.parametrize("delay", ["exact", "pade"])
@pytest.mark.parametrize("kind", ["none", "thesis"])
@pytest.mark.parametrize("output", [-20.0, 35.0])
def test_the_output_starts_where_it_is_put(
    by_delay: dict[str, Conditions], kind: str, delay: str, output: float
) -> None:
    one = by_delay[delay]
    run = simulate(one.loop(kind, output), (-12.0, 12.0), np.array([0.0, 1e-9, 1.0]))
    r = one.reference(np.array([0.0, 1e-9]))
    np.testing.assert_allclose(r - run.outputs["error"][:2], output, rtol=1e-6)


def test_the_output_stays_until_the_dead_time_is_over(implied_exact: Conditions) -> None:
    delay_s = implied_exact.design.plant.delay_s
    time_s = np.linspace(0.0, delay_s, 9)
    run = simulate(implied_exact.loop("none", 20.0), (-12.0, 12.0), time_s)
    np.testing.assert_allclose(implied_exact.reference(time_s) - run.outputs["error"], 20.0, rtol=1e-9)


@pytest.mark.parametrize("delay", ["exact", "pade"])
@pytest.mark.parametrize("kind", ["none", "thesis"])
def test_an_initial_output_is_an_offset_of_the_reference(
    by_delay: dict[str, Conditions], kind: str, delay: str
) -> None:
    """The plant integrates: y from y(0) after r is y(0) and y from rest after r - y(0), saturated or not."""
    one, output = by_delay[delay], 20.0
    shifted = replace(one.reference, offset=-output)
    loop = design_loop(one.design, shifted, one.design.compensator("thesis") if kind == "thesis" else None)
    if delay == "pade":
        loop = with_pade_at_rest(loop, 2)
    time_s = np.linspace(0.0, 2.0, 41)
    expected = simulate(loop, (-15.0, 15.0), time_s).outputs["error"]
    found = simulate(one.loop(kind, output), (-15.0, 15.0), time_s).outputs["error"]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_the_plant_alone_would_keep_its_output(implied_exact: Conditions) -> None:
    """With a limit of next to nothing the error is r - y(0) for ever: past inputs are zero, the modes at rest."""
    time_s = np.linspace(0.0, 3.0, 31)
    loop = starting_at(implied_exact.loop("none", 0.0).loop, implied_exact.design, 20.0)
    error = simulate(loop, (-1e-9, 1e-9), time_s).outputs["error"]
    np.testing.assert_allclose(error, implied_exact.reference(time_s) - 20.0, atol=1e-6)


# the readings


def run_of(time_s: np.ndarray, error: np.ndarray, last: float) -> Run:
    zero = np.zeros_like(time_s)
    return Run(time_s, zero, zero, {"error": error}, np.array([0.1, last]), np.array([1, 0]))


def test_readings_without_anti_windup_of_a_known_error() -> None:
    time_s = np.linspace(0.0, 10.0, 1001)
    found = without_anti_windup(run_of(time_s, -64.0 * 2.0**-time_s, 3.0), span_s=2.0)
    assert found["error_overall"] == 64.0
    assert found["error_after_1s"] == pytest.approx(32.0)
    assert found["error_after_saturation"] == pytest.approx(8.0)
    assert found["error_last_period"] == pytest.approx(0.25)
    assert found["desaturation_s"] == 3.0


def test_readings_with_anti_windup_of_a_known_error() -> None:
    """e = c + A 2^-t: it settles to b at log2(A/(b - c)), and to its offset at log2(A/b)."""
    time_s, offset = np.linspace(0.0, 40.0, 4001), 0.25
    found = with_anti_windup(run_of(time_s, offset + 64.0 * 2.0**-time_s, 3.0), amplitude=50.0, span_s=2.0)
    assert found["recovery_saturation_s"] == 3.0
    for name, share in (("recovery_1_s", 0.01), ("recovery_2_s", 0.02), ("recovery_5_s", 0.05)):
        assert found[name] == pytest.approx(math.log2(64.0 / (50 * share - offset)), abs=1e-4)
    assert found["recovery_to_offset_s"] == pytest.approx(math.log2(64.0 / 0.5), abs=1e-4)
    assert found["final_error_percent"] == pytest.approx(0.5)
    assert found["final_offset_percent"] == pytest.approx(0.5)


def test_what_never_happens_is_empty() -> None:
    time_s = np.linspace(0.0, 10.0, 101)
    error = np.full(101, 5.0)
    saturated = replace(run_of(time_s, error, 3.0), modes=np.array([1, -1]))
    assert math.isnan(without_anti_windup(saturated, 2.0)["desaturation_s"])
    assert math.isnan(without_anti_windup(saturated, 2.0)["error_after_saturation"])
    assert math.isnan(with_anti_windup(saturated, 50.0, 2.0)["recovery_1_s"])
    assert settled_s(time_s, error, 6.0) == 0.0


def test_the_band_is_left_through_the_side_that_the_error_is_on() -> None:
    assert settled_s(np.array([0.0, 1.0, 2.0]), np.array([-3.0, 0.0, 0.0]), 1.0) == pytest.approx(2 / 3)


def test_the_printed_numbers_are_the_ledgers() -> None:
    numbers = {name: (number.value, number.half_unit) for name, number in printed_outcomes().items()}
    assert numbers["error"] == (8.6, pytest.approx(0.05))
    assert numbers["desaturation"] == (4.0, pytest.approx(0.5))
    assert numbers["recovery"] == (4.46, pytest.approx(0.005))
    assert numbers["delay_free_error"] == (0.098, pytest.approx(0.0005))
    assert set(numbers) == set(CLAIMS)


# where a reading agrees with print


def test_intervals_of_a_known_reading() -> None:
    """(x - 2)^2 is 1 within 0.19 on two intervals that meet nowhere."""
    grid = np.linspace(0.0, 4.0, 9)
    found = where_met(lambda x: (x - 2) ** 2, grid, (grid - 2) ** 2, PrintedNumber(1.0, 0.19))
    ends = [(one.low, one.high) for one in found]
    assert ends == [
        (pytest.approx(2 - math.sqrt(1.19), abs=1e-4), pytest.approx(1.1, abs=1e-4)),
        (pytest.approx(2.9, abs=1e-4), pytest.approx(2 + math.sqrt(1.19), abs=1e-4)),
    ]
    assert all(one.met and one.computed == pytest.approx(1.0, abs=1e-4) for one in found)


def test_a_jump_over_the_printed_number_is_no_agreement() -> None:
    def reading(x: float) -> float:
        return 3.0 if x < math.e else 5.2

    (found,) = where_met(reading, [1.0, 2.0, 3.0, 4.0], [3.0, 3.0, 5.2, 5.2], PrintedNumber(4.0, 0.5))
    assert not found.met
    assert found.computed == 3.0


def test_never_and_no_agreement_are_told_apart() -> None:
    (never,) = where_met(lambda x: math.nan, [1.0, 2.0], [math.nan, math.nan], PrintedNumber(4.0, 0.5))
    assert math.isnan(never.closest)
    assert math.isnan(never.computed)
    (late,) = where_met(
        lambda x: math.nan if x < 2 else 6 - x / 4, [1, 2, 3], [math.nan, 5.5, 5.25], PrintedNumber(4, 0.5)
    )
    assert late.closest == 3
    assert not late.met


# chapter 4


def test_a_limit_that_gives_an_outcome_gives_it_again(implied_exact: Conditions, separate: pd.DataFrame) -> None:
    """Simulated afresh with other samples."""
    met = separate[separate["met"] == 1]
    assert {"error", "desaturation"} <= set(met["outcome"])
    for row in met.itertuples():
        kind = "thesis" if row.outcome == "recovery" else "none"
        again = implied_exact.outcomes(kind, Point(row.limit, row.initial_output), samples=1700)[row.reading]
        assert again == pytest.approx(row.computed, abs=0.2 * row.tolerance)
        assert abs(again - row.printed) <= row.tolerance


def test_beyond_an_interval_the_outcome_is_missed(implied_exact: Conditions, separate: pd.DataFrame) -> None:
    row = separate[(separate["reading"] == "error_after_1s") & (separate["initial_output"] == 0)].iloc[0]
    for limit in (row["limit_low"] * 0.999, row["limit_high"] * 1.001):
        again = implied_exact.outcomes("none", Point(limit, 0.0))["error_after_1s"]
        assert abs(again - row["printed"]) > row["tolerance"]


def test_from_rest_each_printed_outcome_wants_another_limit(separate: pd.DataFrame) -> None:
    rest = separate[(separate["initial_output"] == 0) & (separate["met"] == 1)].set_index("reading")
    assert rest["limit"]["error_after_1s"] == pytest.approx(19.43, abs=0.02)
    assert rest["limit_low"]["desaturation_s"] == pytest.approx(12.84, abs=0.01)
    assert rest["limit_high"]["desaturation_s"] == pytest.approx(13.40, abs=0.01)


def test_the_joint_search_betters_every_point_of_the_grid(
    implied_exact: Conditions, points: pd.DataFrame, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(joint_search, "EVALUATIONS", 8)
    found = together([implied_exact], points)
    for name, converging in (("together", False), ("together, converging", True)):
        grid = [
            judged(Point(row["limit"], row["initial_output"]), row, converging).miss
            for row in points.to_dict("records")
        ]
        best = found[found["search"] == name]
        assert list(best["outcome"]) == list(READINGS)
        assert best["worst_miss"].nunique() == 1
        assert best["worst_miss"].iloc[0] <= min(grid)
        again = implied_exact.both(Point(best["limit"].iloc[0], best["initial_output"].iloc[0]))
        misses = [abs(again[row.reading] / row.printed - 1) for row in best.itertuples()]
        assert max(misses) == pytest.approx(best["worst_miss"].iloc[0])


def test_no_limit_and_initial_output_give_all_that_chapter_4_prints(implied_exact: Conditions) -> None:
    """Around the nearest point of the whole search, and it is farther off than "around 4" leaves room for."""
    around = Grid(COARSE.scan, np.array([1.0012, 1.0016]), np.linspace(1.18, 1.22, 3))
    found = together([implied_exact], grid_of([implied_exact], around))
    best = found[found["search"] == "together"]
    assert 0.125 < best["worst_miss"].iloc[0] == pytest.approx(0.200, abs=0.002)
    assert best["final_error_percent"].iloc[0] > 1
    assert not best["met"].any()


def test_convergence_is_demanded(points: pd.DataFrame) -> None:
    row = points.iloc[0].to_dict() | {"final_error_percent": 1.5, "error_overall": 8.6, "desaturation_s": 4.0}
    row["recovery_1_s"] = 4.46
    assert judged(Point(1.0, 0.0), row, converging=False).miss == 0
    assert judged(Point(1.0, 0.0), row, converging=True).miss == math.inf


def test_pade_moves_the_limits_by_next_to_nothing(by_delay: dict[str, Conditions], separate: pd.DataFrame) -> None:
    known = separate[separate["reading"].isin(["error_after_1s", "desaturation_s", "recovery_saturation_s"])]
    exact = known[known["initial_output"] == 0].reset_index(drop=True)
    pade = approximated([by_delay["pade"]], exact)
    assert list(pade["met"]) == list(exact["met"]) == [1, 1, 0]
    np.testing.assert_allclose(pade[["limit_low", "limit_high"]], exact[["limit_low", "limit_high"]], rtol=2e-5)
    assert pade["limit"].iloc[2] == exact["limit"].iloc[2]
    assert pade["computed"].iloc[2] == pytest.approx(exact["computed"].iloc[2], abs=0.01)


# chapter 2


def test_no_weights_or_initial_output_give_the_error_of_chapter_2(needs: pd.DataFrame) -> None:
    least, bound = (needs[needs["search"] == search].iloc[0] for search in ("weights", "any controller"))
    assert least["limit"] == bound["limit"] == printed_numbers()["delay_free"]["limit"]
    assert 2.7 < bound["computed"] <= least["computed"] < 3.0
    assert least["computed"] > 25 * least["printed"]


def test_the_offset_free_output_betters_rest(chapter_2: pd.DataFrame) -> None:
    varied = chapter_2[chapter_2["limit"] == printed_numbers()["delay_free"]["limit"]]
    for _, rows in varied.groupby("weights"):
        rest, best = rows.iloc[-2], rows.iloc[-1]
        assert best["peak"] < rest["peak"]
        assert abs(best["offset"]) < 0.01


def test_a_misprinted_limit_would_give_the_error_of_chapter_2(needs: pd.DataFrame) -> None:
    rows = needs
    row = rows[(rows["reading"] == "peak_percent") & (rows["initial_output"] == 0) & (rows["search"] == "alone")].iloc[
        0
    ]
    assert row["limit"] == pytest.approx(10.98, abs=0.005)
    again = loop_of(printed_choices.chapter_2("implied")).errors(row["limit"], 0.0)["peak_percent"]
    assert abs(again - row["printed"]) <= row["tolerance"]


def test_weights_that_are_the_usual_ones_give_the_usual_stabiliser() -> None:
    design = printed_choices.chapter_2("implied")
    K, again = design.blocks["K"], chapter_2_weights.with_weights(design, Weights()).blocks["K"]
    s = 1j * np.geomspace(0.1, 1e3, 20)
    np.testing.assert_allclose(again(s), K(s), rtol=1e-6)
    other = chapter_2_weights.with_weights(design, Weights(level=0.1)).blocks["K"]
    assert np.abs(other(s) / K(s) - 1).max() > 0.1
    assert str(Weights(level=0.1)) == "level x 0.1"
    assert str(Weights()) == "usual"


# the tables and the command


def test_the_command_writes_both_tables(
    by_delay: dict[str, Conditions], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = Grid(np.array([1.1, 1.2]), np.array([1.002, 1.1]), np.array([0.9, 1.2]))
    monkeypatch.setattr(search, "usual_grid", lambda: small)
    monkeypatch.setattr(joint_search, "EVALUATIONS", 5)
    monkeypatch.setattr(search, "every_condition", lambda: list(by_delay.values()))
    monkeypatch.setattr(chapter_2_weights, "usual_limits", lambda: np.array([0.95, 0.99, 1.05]))
    monkeypatch.setattr(chapter_2_weights, "usual_weights", lambda: (Weights(),))
    result = CliRunner().invoke(main, ["thesis", "conditions", "--output", str(tmp_path)])
    assert result.exit_code == 0, result.output
    table, summary = (pd.read_csv(tmp_path / f"{name}.csv") for name in ("conditions", "conditions_summary"))
    assert set(table["case"]) == {"extended", "delay_free"}
    assert {"alone", "together", "weights", "any controller"} <= set(summary["search"])
    assert set(summary["outcome"]) == set(CLAIMS)
    assert set(summary["delay"]) == {"exact", "pade", "none"}
    assert summary["met"].isin([0, 1]).all()
    assert (summary["limit_low"].isna() == (summary["met"] == 0)).all()


def test_the_command_refuses_a_missing_folder(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["thesis", "conditions", "--output", str(tmp_path / "none")])
    assert result.exit_code == 2
    assert "no such folder" in result.stderr


def test_a_search_in_other_processes_is_the_same(implied_exact: Conditions) -> None:
    """Neither threads nor what is sent between processes change a digit."""
    limits = np.array([1.1, 1.3])

    def sent(work: Callable[[object], object], items: Sequence[object]) -> list[object]:
        there, received = pickle.loads(pickle.dumps((work, items)))
        return [there(item) for item in received]

    here = scanned([implied_exact], limits)
    pd.testing.assert_frame_equal(scanned([implied_exact], limits, sent), here, check_exact=True)


def test_from_rest_no_offset_settles_when_the_thesis_says(implied_exact: Conditions) -> None:
    """y + y_d is the linear response whatever saturates; less any lasting offset it settles before or after 4.46 s."""
    time_s = np.linspace(0.0, 20.0, 8001)
    error = simulate(implied_exact.loop("none", 0.0), (-np.inf, np.inf), time_s).outputs["error"]
    for band in (0.5, 1.0, 2.5):
        settled = [settled_s(time_s, error + offset, band) for offset in np.linspace(-0.999, 0.999, 401) * band]
        assert min(abs(at - 4.46) for at in settled) > 0.3


def test_without_anti_windup_the_printed_recovery_occurs_near_what_tracking_takes(implied_exact: Conditions) -> None:
    time_s = np.linspace(0.0, 12.0, 12001)
    settled = [
        settled_s(time_s, simulate(implied_exact.loop("none", 50.0), (-limit, limit), time_s).outputs["error"], 0.5)
        for limit in (10.6, 10.62)
    ]
    assert settled[0] == pytest.approx(4.47, abs=0.005)
    assert settled[1] < 4.46
