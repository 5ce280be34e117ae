"""The tables of the experiments, the campaign and the fit are the same in other units.

How nearly is what each claims: runs 1e-11 of a signal, norms and peaks what their searches leave, f of an anti-windup
its 1 %. The thesis's reference has a fixed size: where it is run, only the units of time and of the input change.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from other_units import Units, same, small_delay_free, small_extended
from scipy.signal import chirp, cont2discrete, dlsim

from design.design_file import Design
from experiments.campaign.draw_plants import PlantsWithin
from experiments.campaign.run_plants import Campaign, run_chunk
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies import f_gamma, hidden_modes, interpolation, trade_off
from experiments.thesis.studies.additive_error import additive_error_tables
from experiments.thesis.studies.chapter_2 import delay_free_tables
from experiments.thesis.studies.chapter_4 import extended_tables, usual_limit
from experiments.thesis.studies.desaturation import desaturation
from experiments.thesis.studies.f_gamma import f_gamma_tables
from experiments.thesis.studies.hidden_modes import hidden_modes_tables
from experiments.thesis.studies.interpolation import interpolation_tables
from experiments.thesis.studies.robustness import robustness_tables
from experiments.thesis.studies.sampled_rates import sampled_rates_tables
from experiments.thesis.studies.trade_off import trade_off_tables
from identification.bound.bound_residuals import bound_residuals
from identification.fitting.fit_plant import FitResult, fit_plant
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.reports import BoundReport
from identification.model.structure import Wanted
from identification.output.fit_facts import table as fit_table
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.response import FrequencyResponse

Tables = Mapping[str, pd.DataFrame]
LIMIT = 40.0
TIMES_AND_INPUTS = [Units(1e9, 1.0, 1e15), Units(1e-9, 1.0, -1e-15), Units(2.0**-20, 1.0, 2.0**10)]
OF_TIME = {"time_s", "alpha", "beta", "beta_best", "delay_s"}
OF_RATE = {"omega", "peak_omega", "a", "lowest", "highest", "rate_hz", "root", "shown_hz", "bandwidth", "fastest"}
OF_RATE |= {"largest_ratio_omega"}
OF_OUTPUT = ("reference", "output_", "error_", "offset", "ripple", "peak_error", "steady_error")
OF_DRIFT = ("drift", "largest_drift", "expected_drift")  # outputs, far smaller than the reference
OF_INPUT = ("control_", "saturated_", "required", "largest_control", "covered_control", "quantum", "resolution")
OF_GAIN = {"f", "f_best", "error", "bound", "plant"}


def factor(column: str, units: Units) -> float:
    """Of the numbers of a column, by its name."""
    if column in OF_TIME or column.endswith("_s"):
        return units.time
    if column in OF_RATE or column.startswith(("zero_omega", "pole_omega", "real_")):
        return 1 / units.time
    if column == "lasting_offset":  # of a windup, an input times a time, of 1
        return units.gain / units.time
    if column == "gain":
        return units.gain / units.time
    if column in OF_GAIN:
        return abs(units.gain)
    if column.startswith(OF_INPUT) or column == "limit":
        return units.input if column.startswith(("control_", "saturated_")) else abs(units.input)
    return units.output if column.startswith((*OF_OUTPUT, *OF_DRIFT)) else 1.0


def same_tables(found: Tables, expected: Tables, units: Units, share: float, but: tuple[str, ...] = ()) -> None:
    """All columns, within a share of the largest of each, or of the largest output for errors that have died away."""
    assert list(found) == list(expected)
    for name, table in expected.items():
        assert list(found[name].columns) == list(table.columns)
        for column in table.columns.difference(but):
            other = found[name][column]
            if not pd.api.types.is_numeric_dtype(table[column]):
                assert list(other) == list(table[column])
                continue
            values, others = (np.asarray(cells, dtype=float) for cells in (table[column], other))
            of_size = 50.0 if factor(column, Units(1.0, 2.0, 2.0)) == 2.0 and column.startswith(OF_OUTPUT) else 0.0
            same(np.append(others / factor(column, units), of_size), np.append(values, of_size), share)


Once = Callable[[str, Callable[[], Tables]], Tables]


@pytest.fixture(scope="module")
def once() -> Once:
    """The tables of a name in the usual units, made when they are first asked for."""
    made: dict[str, Tables] = {}

    def once(name: str, make: Callable[[], Tables]) -> Tables:
        if name not in made:
            made[name] = make()
        return made[name]

    return once


@pytest.mark.parametrize("units", TIMES_AND_INPUTS, ids=str)
def test_the_two_chapters(small_designs: dict[str, Design], once: Once, units: Units) -> None:
    """All columns but the error after one second, which is the thesis's; empty where the run is shorter."""
    kinds = {"extended": extended_tables, "delay-free": delay_free_tables}
    for kind, tables in kinds.items():
        own, size = small_designs[kind], abs(units.input)
        found = tables(units.design(own), LIMIT * size)
        usual = once(kind, lambda tables=tables, own=own: tables(own, LIMIT))  # type: ignore[misc]
        same_tables(found, usual, units, 1e-10, ("peak_error_after_1s",))
        after = found[f"{kind.replace('-', '_')}_summary"]["peak_error_after_1s"]
        assert after.isna().all() == (units.time < 1e-3)


@pytest.mark.parametrize("units", TIMES_AND_INPUTS, ids=str)
def test_the_limit_of_chapter_4(small_designs: dict[str, Design], units: Units) -> None:
    """It is found to 1e-6 of itself from a share of the reference's period, which the thesis's 4 seconds are."""
    own = small_designs["extended"]
    assert desaturation(2 * np.pi / 1.5) == 4.0
    assert usual_limit(units.design(own)) / abs(units.input) == pytest.approx(usual_limit(own), rel=2e-6)


@pytest.mark.parametrize("units", TIMES_AND_INPUTS[:2], ids=str)
def test_sampled_rates(small_designs: dict[str, Design], once: Once, units: Units) -> None:
    own = small_designs["extended"]
    found = sampled_rates_tables(units.design(own), LIMIT * abs(units.input))
    same_tables(found, once("sampled rates", lambda: sampled_rates_tables(own, LIMIT)), units, 1e-8)


@pytest.mark.parametrize("units", [Units(1e9, 1.0, 1e15), Units(2.0**-20, 1.0, 2.0**10)], ids=str)
def test_hidden_modes(
    small_designs: dict[str, Design], once: Once, units: Units, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The input keeps its sign: to cut down is to cut up with the other."""
    monkeypatch.setattr(hidden_modes, "PERIODS", 20)
    own = small_designs["extended"]
    found = hidden_modes_tables(units.design(own), LIMIT * units.input)
    same_tables(found, once("hidden modes", lambda: hidden_modes_tables(own, LIMIT)), units, 1e-8)


@pytest.mark.parametrize("kind", ["extended", "delay-free"])
@pytest.mark.parametrize("units", TIMES_AND_INPUTS[:2], ids=str)
def test_a_campaign(small_designs: dict[str, Design], once: Once, kind: str, units: Units) -> None:
    def rows(each: Units) -> Tables:
        design = each.design(small_designs[kind])
        reference = thesis_reference(kind, design.reference_omegas)
        limit = LIMIT * abs(each.input)
        campaign = Campaign(design, str(each), 1, reference, (-limit, limit), 5)
        return {"": pd.DataFrame(run_chunk(campaign, (0, 2)))}

    found, expected = rows(units), once(f"campaign of {kind}", lambda: rows(Units()))
    assert list(found[""]["plant"]) == list(expected[""]["plant"]) == [0, 0, 0, 1, 1, 1]
    same_tables(found, expected, units, 1e-9, ("plant",))


@pytest.mark.parametrize("units", [Units(2.0**30), Units(1e9, -1e-15), Units(1e-9, 1.0, 1e-15)], ids=str)
def test_plants_within_the_bound(units: Units) -> None:
    """Where W_a bounds the dead time, too: how far one may go is found from the same first step in any unit of time."""
    plant = PlantModel(2.0, (Mode(3.0, 0.3),), (Mode(4.0, 0.3),), 1.5, 0, (), (1.0,))
    bound = AdditiveBound(0.3, (), (), (), (30.0,))
    expected = PlantsWithin(plant, bound)
    found = PlantsWithin(units.plant(plant), units.bound(bound))
    for index in range(4):
        one, other = (within.draw(3, index) for within in (expected, found))
        assert other.distance == pytest.approx(one.distance, rel=1e-11)
        drawn = units.plant(one.plant)
        assert other.plant.delay_s == pytest.approx(drawn.delay_s, rel=1e-11)
        assert other.plant.zero_modes[0].omega == pytest.approx(drawn.zero_modes[0].omega, rel=1e-11)


@pytest.mark.parametrize("units", [Units(1e9, -1e-15, 1.0), Units(1e-9, 1e7, -1e-8)], ids=str)
def test_designs_of_the_scaled_model(
    small_model: IdentifiedModel, small_designs: dict[str, Design], units: Units
) -> None:
    """The controllers to 1e-9, what is judged of the anti-windups to the 1 % that f claims; and the robustness."""
    model = units.model(small_model)
    designed = {"extended": small_extended(model, units.time), "delay-free": small_delay_free(model, units.time)}
    s = 1j * np.geomspace(0.02, 50.0, 40)
    for kind, found in designed.items():
        expected = units.design(small_designs[kind])
        for part, usual in zip(found.controller_parts(), expected.controller_parts(), strict=True):
            np.testing.assert_allclose(part(s / units.time), usual(s / units.time), rtol=1e-6, atol=0)
        for name in ("thesis", "corrected"):
            own, usual = found.anti_windup[name], expected.anti_windup[name]
            for number in ("f", "recovery_s"):
                here, there = (getattr(each.judgement, number) for each in (own, usual))
                assert here == pytest.approx(there, rel=1e-2)
            assert own.judgement.theta2_stable == usual.judgement.theta2_stable
            assert own.kind.one_plus.is_stable
        tables = [robustness_tables({"one": each})["robustness_summary"] for each in (found, small_designs[kind])]
        same_tables({"": tables[0]}, {"": tables[1]}, units, 1e-6)


@pytest.mark.parametrize("units", [Units(1e9, 1.0, 1e-15), Units(1e-9, 1e15, 1.0)], ids=str)
def test_where_the_designs_of_q_work(
    small_designs: dict[str, Design], units: Units, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Zeros and poles; the thesis's Lagrange denominator (s + 1)^(n - 1) has its root at 1 rad/s in any unit."""
    monkeypatch.setattr(interpolation, "FREQUENCIES", 12)
    own = small_designs["extended"]
    found, expected = (interpolation_tables(each.design(own)) for each in (units, Units()))
    for tables in (found, expected):
        for name in ("interpolation", "interpolation_summary"):
            tables[name] = tables[name][tables[name]["method"] != "lagrange"]
    same_tables(found, expected, units, 1e-7)


def test_f_and_its_trade_off(small_designs: dict[str, Design], monkeypatch: pytest.MonkeyPatch) -> None:
    """The least f to 1e-6 and where it is to 1e-3, since it is flat there; the corrected class to the 1 % of its f."""
    units, usual = Units(1e-9, 1e15, 1.0), f_gamma.beta_grid
    monkeypatch.setattr(f_gamma, "beta_grid", lambda alpha: usual(alpha)[:1])
    monkeypatch.setattr(trade_off, "RECOVERIES", 2)
    monkeypatch.setattr(trade_off, "SECTORS", (0.95,))
    own = small_designs["extended"]
    found, expected = (f_gamma_tables(each.design(own).additive_bound) for each in (units, Units()))
    places = ("beta_best", "gamma_best")
    same_tables(found, expected, units, 1e-6, places)
    same_tables(*({"": each["f_gamma_summary"]} for each in (found, expected)), units, 1e-3)
    same_tables(*(trade_off_tables(each.design(own)) for each in (units, Units())), units, 1e-2)


def measured(plant: PlantModel, units: Units, count: int) -> list[FrequencyResponse]:
    """Tests of a plant with 1 % noise on 60 lines."""
    rng, omega = np.random.default_rng(3), np.linspace(0.5, 12.0, 60)
    tests = []
    for number in range(count):
        noise = 1 + 0.01 * (rng.standard_normal((2, omega.size)).T @ [1, 1j])
        response = plant(1j * omega) * noise * units.gain
        tests.append(FrequencyResponse(omega / units.time, response, None, f"test {number}"))
    return tests


@cache
def fitted(units: Units, count: int) -> tuple[FitResult, BoundReport, Tables]:
    """Of so many tests: the fit, the bound and the table of the errors."""
    tests = measured(PlantModel(2.0, (Mode(3.0, 0.05),), (Mode(5.0, 0.05),), 0.05), units, count)
    fit = fit_plant(tests)
    report = bound_residuals(fit.plant, tests, [test.plant for test in fit.tests], 2)
    return fit, report, additive_error_tables(IdentifiedModel(fit.plant, report.bound), tests)


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("units", [Units(1e6, 1e6), Units(1e-6, -1e-6), Units(2.0**15, 1.0, 2.0**-19)], ids=str)
def test_the_fit_and_the_additive_error(units: Units, count: int) -> None:
    """The structure, the plant to 1e-6 (the likelihood is flat to 1e-14 there), and the bound to its 1e-3."""
    found, bound, errors = fitted(units, count)
    expected, usual, usual_errors = fitted(Units(), count)
    assert found.structure == expected.structure
    omega = np.linspace(0.5, 12.0, 60)
    s = 1j * omega / units.time
    np.testing.assert_allclose(found.plant(s), expected.plant(1j * omega) * units.gain, rtol=1e-6)
    np.testing.assert_allclose(np.abs(bound.bound(s) / units.gain), np.abs(usual.bound(1j * omega)), rtol=1e-2)
    assert bound.largest_excess == pytest.approx(usual.largest_excess, rel=5e-3)
    same_tables(errors, usual_errors, units, 1e-2, ("largest_ratio_omega",))
    assert len(fit_table(found).splitlines()) == len(fit_table(expected).splitlines())


@pytest.mark.parametrize("units", [Units(1e6, -1e-6), Units(1e-6, 1.0, 1e6)], ids=str)
def test_the_fit_of_a_raw_record(units: Units, tmp_path: Path) -> None:
    """A held input, whose aliases, hold and transients go with the unit of time: the plant to 1e-6."""
    plant = PlantModel(2.0, (), (Mode(6.0, 0.1),), 0.0)
    sampling, count = 0.1, 2048
    A, b = np.array([[0.0, 1.0, 0.0], [-36.0, -1.2, 0.0], [1.0, 0.0, 0.0]]), np.array([[0.0], [72.0], [0.0]])
    discrete = cont2discrete((A, b, np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 1))), sampling)
    rng, time_s = np.random.default_rng(5), sampling * np.arange(count)
    u = chirp(time_s, 0.05, time_s[-1], 3.0)
    y = dlsim((*discrete[:4], sampling), u)[1][:, 0] + 1e-4 * rng.standard_normal(count)
    found = []
    for each in (units, Units()):
        table = {"time_s": time_s * each.time, "input_held": u * each.input, "output": y * each.output}
        pd.DataFrame(table).to_csv(tmp_path / "record.csv", index=False)
        found.append(fit_plant(read_sweeps([tmp_path / "record.csv"]), Wanted(1, (0, 1), (0, 0))))
    assert found[1].plant.pole_modes[0].omega == pytest.approx(plant.pole_modes[0].omega, rel=1e-3)
    s = 1j * np.linspace(0.5, 12.0, 40)
    np.testing.assert_allclose(found[0].plant(s / units.time), found[1].plant(s) * units.gain, rtol=1e-6)


def test_a_fit_with_narrow_intervals_shows_them() -> None:
    """ "7.1050 ... 7.1050" is no interval: as many digits as show its width."""
    rng, omega = np.random.default_rng(1), np.linspace(0.5, 12.0, 400)
    plant = PlantModel(7.105, (), (Mode(5.0, 0.05),), 0.05)
    noise = 1 + 1e-6 * (rng.standard_normal((2, omega.size)).T @ [1, 1j])
    fit = fit_plant([FrequencyResponse(omega, plant(1j * omega) * noise, None, "one")])
    for line in fit_table(fit).splitlines()[1:]:
        if " ... " in line:
            low, high = (float(end.split()[at]) for end, at in zip(line.split(" ... "), (-1, 0), strict=True))
            assert low < high
