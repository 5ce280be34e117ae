"""The search over more conditions of chapter 4: each condition does what its name says, and the page's numbers."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from experiments.__main__ import main
from experiments.engine.simulate import simulate
from experiments.thesis.unprinted import wide_search
from experiments.thesis.unprinted.printed_outcomes import CONVERGED_PERCENT, after_saturation
from experiments.thesis.unprinted.wide_conditions import CASES, Axis, Case
from experiments.thesis.unprinted.wide_loops import as_printed, cancelling, plant_4_8, printed_C_aw, without_integrator
from experiments.thesis.unprinted.wide_search import Tried

NAMED = {case.name: case for case in CASES}
PAGE = Path(__file__).resolve().parents[2] / "docs" / "thesis" / "unprinted_conditions.md"
STUCK = 1e-9  # a limit under which the plant gets no input


def moved_by(case: Case, **values: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, and by how much conditions move y and u while the plant gets no input."""
    time_s = np.linspace(0.0, 2.0, 401)
    usual = dict.fromkeys(("initial_output", *case.added), 0.0) | {"disturbance_s": 1.0}
    runs = [simulate(case.started("none", usual | more), (-STUCK, STUCK), time_s) for more in ({}, values)]
    still, moved = runs
    return time_s, still.outputs["error"] - moved.outputs["error"], moved.control - still.control


def test_a_mode_rings_from_where_it_is_put() -> None:
    case = NAMED["modes"]
    plant = case.loops().plant
    time_s, y, _ = moved_by(case, mode_1=3.0, mode_1_quarter=-2.0)
    mode, after = plant.pole_modes[0], np.maximum(time_s - plant.delay_s, 0.0)
    turned = mode.omega * math.sqrt(1 - mode.zeta**2) * after
    expected = np.exp(-mode.zeta * mode.omega * after) * (3 * np.cos(turned) - 2 * np.sin(turned))
    np.testing.assert_allclose(y, expected, atol=1e-6)


def test_the_controller_goes_on_with_the_control_that_it_holds() -> None:
    """But for its first dead time, in which it remembers a constant."""
    case = NAMED["controller"]
    omega = case.reference.omegas[0]
    time_s, _, u = moved_by(case, controller_held=4.0, controller_cosine=3.0, controller_sine=-2.0)
    expected = 4 + 3 * np.cos(omega * time_s) - 2 * np.sin(omega * time_s)
    np.testing.assert_allclose(u, expected, atol=0.1)
    held = moved_by(case, controller_held=4.0)[2]
    np.testing.assert_allclose(held, 4.0, atol=1e-6)


def test_a_disturbance_is_a_step_of_the_output() -> None:
    time_s, y, _ = moved_by(NAMED["disturbance"], disturbance=8.6, disturbance_s=0.5025)
    np.testing.assert_allclose(y, np.where(time_s > 0.5025, 8.6, 0.0), atol=1e-6)


def test_the_lower_limit_is_its_own() -> None:
    """What the control never reaches moves nothing; what it reaches does."""
    case, values = NAMED["unequal limits"], {"upper": 10.6, "initial_output": 50.0}
    equal, wide, wider = (case.outcomes("none", values | {"lower": lower}) for lower in (10.6, 40.0, 50.0))
    assert wide == wider != equal
    assert equal == NAMED["equal limits"].outcomes("none", values)


def test_under_a_wide_lower_limit_its_windup_is_brief() -> None:
    """At the nearest converging point of the page."""
    case, values = NAMED["unequal limits"], {"upper": 10.564, "initial_output": 60.2396}
    time_s = np.linspace(0.0, 2.0, 3)
    wide, equal = (
        simulate(case.started("thesis", values), (-lower, values["upper"]), time_s) for lower in (21.8668, 10.564)
    )
    (first,) = np.flatnonzero(wide.modes == -1)
    assert wide.events_s[first + 1] - wide.events_s[first] == pytest.approx(0.002, abs=5e-4)
    assert equal.events_s[-1] == pytest.approx(1.4, abs=0.05)


def test_the_printed_blocks_are_those_of_the_text() -> None:
    s = np.array([0.3, 40.0, 200j + 1, 900j])
    zeros = (1 + 0.016 * s / 175 + (s / 175) ** 2) * (1 + 0.08 * s / 930 + (s / 930) ** 2)
    poles = s * (1 + 0.04 * s / 285 + (s / 285) ** 2) * (1 + 0.21 * s / 960 + (s / 960) ** 2)
    np.testing.assert_allclose(plant_4_8()(s), 7.1 * zeros / poles * np.exp(-8.1e-3 * s), rtol=1e-12)
    above = 0.52137 * (s + 0.6618) * (s**2 + 2.352 * s + 2.359) * (s**2 + 11 * s + 7.952e4)
    np.testing.assert_allclose(printed_C_aw()(s), above / (s * (s**2 + 2.25) * (s**2 + 2.8 * s + 3.062e4)), rtol=1e-12)
    assert as_printed().thesis.theta.A.shape == (7, 7)


def test_theta2_is_stable_once_its_integrator_is_cancelled() -> None:
    for loops, unstable in ((as_printed(), 1), (cancelling(), 0), (without_integrator(), 0)):
        poles = np.linalg.eigvals(loops.thesis.theta.A)
        assert np.sum(poles.real > -1e-6) == unstable


@pytest.mark.parametrize(("upper", "output"), [(10.6, 50.0), (12.9, 0.0), (20.0, -30.0)])
def test_without_the_factor_1_over_s_the_loop_diverges(upper: float, output: float) -> None:
    """Wherever the control saturates: y + y_d is no longer the linear response."""
    case = NAMED["theta2 without 1/s"]
    found = case.outcomes("thesis", {"upper": upper, "initial_output": output})
    assert all(math.isnan(value) for value in found.values())


def test_settling_is_counted_from_the_last_saturation() -> None:
    outcomes = {"recovery_saturation_s": 1.5, "recovery_1_s": 5.0, "recovery_2_s": math.nan, "recovery_5_s": 1.0}
    found = after_saturation(outcomes | {"recovery_to_offset_s": 2.0})
    assert (found["recovery_1_s_after"], found["recovery_5_s_after"]) == (3.5, -0.5)
    assert math.isnan(found["recovery_2_s_after"])


def test_limits_crowd_towards_what_they_exceed() -> None:
    axis = Axis("upper", 10.01, 11.0, above=10.0)
    assert [axis.at(share) for share in (0.0, 0.5, 1.0)] == [10.01, 10.1, 11.0]
    assert Axis("y", -50.0, 100.0).at(1 / 3) == 0.0


def nearest_points() -> list[tuple[str, ...]]:
    """The rows of the page's tables of nearest points: condition, error, miss, last error, where."""
    _, _, after = PAGE.read_text(encoding="utf-8").partition("### The nearest points")
    lines = [line for line in after.partition("\n## ")[0].splitlines() if line.startswith("| `")]
    rows = [[cell.strip(" `") for cell in line.split("|")[1:-1]] for line in lines]
    where = {(name, error): points for name, error, *rest in rows if len(rest) == 1 for points in rest}
    found = [(name, error, *rest[-2:]) for name, error, *rest in rows if len(rest) > 1]
    return [(*row, where[row[0], row[1]]) for row in found if row[2] != "diverges"]


@pytest.mark.parametrize("row", nearest_points(), ids=lambda row: f"{row[0]}, {row[1]}")
def test_the_nearest_points_of_the_page_miss_by_what_it_says(row: tuple[str, ...]) -> None:
    """Run again with other samples."""
    name, error, miss, final, where = row
    case = NAMED[name]
    values = {key: float(value) for key, value in re.findall(r"(\w+)` (-?[\d.]+)", where)}
    assert set(values) == {axis.name for axis in case.axes}
    assert all(axis.low <= values[axis.name] <= axis.high for axis in case.axes)
    again = Tried(case, np.zeros(0), values, case.outcomes("none", values, 700) | case.outcomes("thesis", values, 700))
    assert 100 * again.miss(converging=False) == pytest.approx(float(miss.split()[0]), abs=0.5)
    assert again.outcomes["final_error_percent"] == pytest.approx(float(final.split()[0]), rel=0.05, abs=0.01)
    assert again.outcomes["final_error_percent"] < CONVERGED_PERCENT or error == "any"


def test_what_a_case_adds_brings_it_no_farther(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command, of a search that is over soon."""
    for name, value in {"COVERING": 4, "STARTS": 1, "EVALUATIONS": 3}.items():
        monkeypatch.setattr(wide_search, name, value)
    names = "equal limits", "unequal limits", "theta2 without 1/s"
    monkeypatch.setattr(wide_search, "CASES", [NAMED[name] for name in names])
    result = CliRunner().invoke(main, ["thesis", "wide-conditions", "--output", str(tmp_path)])
    assert result.exit_code == 0, result.output
    table = pd.read_csv(tmp_path / "wide_conditions.csv").set_index("case")
    miss = table[table["converging"] == 0]["worst_miss"]
    assert miss["unequal limits"] <= miss["equal limits"] < 1
    assert (table["final_error_percent"][table["converging"] == 1] < CONVERGED_PERCENT).all()
    assert "theta2 without 1/s" not in table.index
    assert table["lower"].notna().equals(pd.Series(table.index == "unequal limits", table.index))
