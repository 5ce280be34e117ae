"""Responses as strangers' rigs give them: noise at the ends of the band, other signs, roots outside, few lines."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import identification
from identification.__main__ import main
from identification.base.errors import InputError
from identification.fit_model import fit_model
from identification.fitting.dead_time import same_turn, spacing_of
from identification.fitting.fit_plant import fit_plant
from identification.fitting.other_classes import FEWEST
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.structure import Structure, Wanted
from identification.output.cautions import _dead_time, cautions
from identification.sweeps.as_fitted import as_fitted
from identification.sweeps.kept_responses import read_responses, write_responses
from identification.sweeps.noise_lines import within, without_noise
from identification.sweeps.response import FrequencyResponse

PAIR = PlantModel(0.5, (Mode(120.0, 0.02),), (Mode(200.0, 0.03),), 8e-3)
OMEGA = 2 * np.pi * np.arange(0.2, 80.1, 0.2)
FEWER = OMEGA[3::4]
A_PAIR = Wanted(1, (1, 1), (0, 0))


def measured(
    plant: PlantModel,
    omega: np.ndarray = OMEGA,
    *,
    relative: float = 0.02,
    floor: float = 0.0,
    seed: int = 0,
    name: str = "one",
) -> FrequencyResponse:
    """SYNTHETIC: a plant's response with complex errors, ``floor`` in its unit."""
    exact = plant(1j * omega)
    normal = np.random.default_rng(seed).standard_normal((omega.size, 2)) @ [1, 1j] / np.sqrt(2)
    return FrequencyResponse(omega, exact + np.hypot(relative * np.abs(exact), floor) * normal, None, name)


def said(tests: Sequence[FrequencyResponse]) -> str:
    model = fit_model(tests).model
    assert model.fit is not None
    return "\n".join(model.fit.cautions)


# dead times


@pytest.mark.parametrize("delay_s", [0.0, 0.97, 3.5, 4.5, 4.9])
def test_equal_lines_tell_a_dead_time_up_to_a_turn(delay_s: float) -> None:
    omega = 1.25 * np.arange(1, 401)
    test = measured(replace(PAIR, delay_s=delay_s), omega)
    result = fit_plant([test], A_PAIR)
    assert result.plant.delay_s == pytest.approx(delay_s, abs=1e-4)
    assert "any multiple of 5.027 s can be added" in "\n".join(cautions(result, [test]))


@pytest.mark.parametrize("delay_s", [6.0, 11.0])
def test_lines_beside_the_multiples_of_their_spacing_tell_turns_apart(delay_s: float) -> None:
    omega = 1.0 + 1.25 * np.arange(400)
    test = measured(replace(PAIR, delay_s=delay_s), omega)
    result = fit_plant([test], A_PAIR)
    assert result.plant.delay_s == pytest.approx(delay_s, abs=1e-4)
    assert "any multiple" not in "\n".join(cautions(result, [test]))


def test_a_dead_time_of_a_whole_turn_is_none() -> None:
    """Lines k d do not see it, and the shortest of the dead times that look alike is taken."""
    omega = 1.25 * np.arange(1, 401)
    result = fit_plant([measured(replace(PAIR, delay_s=2 * np.pi / 1.25 + 0.004), omega)], A_PAIR)
    assert result.plant.delay_s == pytest.approx(0.004, abs=1e-4)


def test_the_spacing_of_lines() -> None:
    assert spacing_of(np.array([3.0, 5.0, 9.0])) == pytest.approx(2.0)
    assert spacing_of(np.geomspace(1.0, 100.0, 50)) is None
    assert same_turn(2.0 * np.arange(1, 9)) == pytest.approx(np.pi)
    assert same_turn(2.0 * np.arange(1, 9) - 1.0) == pytest.approx(np.pi)  # half a turn is the gain's sign
    assert same_turn(2.0 * np.arange(1, 9) - 0.5) is None


@pytest.mark.parametrize("seed", range(3))
def test_without_a_dead_time_the_plant_printed_is_the_plant_fitted(seed: int) -> None:
    """A dead time that cannot be told from none is 0 in the fit itself, and the misfit is that of this plant."""
    plant = PlantModel(1.0, (), (), 0.0, 0, (), (170.0, 1200.0))
    test = measured(plant, np.geomspace(6.0, 6000.0, 150), relative=0.03, seed=seed)
    result = fit_plant([test])
    assert result.plant.delay_s == 0
    apart = np.abs(test.response - result.plant(1j * test.omega)) / np.abs(test.response)
    assert result.distances == (pytest.approx(float(np.median(apart)), rel=1e-12),)
    assert result.tests[0].distance == pytest.approx(result.distances[0], rel=1e-6)
    upper = result.nominal.intervals[1][-1]
    assert f"it is at most {upper:.3g} s" in "\n".join(cautions(result, [test]))


# the class


def test_two_real_poles_are_real_poles() -> None:
    plant = PlantModel(1.0, (), (), 1e-4, 0, (), (170.0, 1200.0))
    result = fit_plant([measured(plant, np.geomspace(6.0, 6000.0, 300))])
    assert result.plant.real_poles == pytest.approx(plant.real_poles, rel=0.03)
    assert not result.plant.pole_modes
    lower, upper = result.nominal.intervals
    values = [parameter.value for parameter in plant.parameters]
    assert np.all((lower < values) & (values < upper))


def test_three_real_roots_of_each_kind_are_asked_for_and_found() -> None:
    plant = PlantModel(2.0, (), (), 2e-4, 0, (30.0, 400.0, 2000.0), (100.0, 900.0, 5000.0))
    test = measured(plant, np.geomspace(3.0, 30000.0, 200), relative=1e-3)
    result = fit_plant([test], Wanted(0, (0, 0), (3, 3)))
    assert result.plant.real_poles == pytest.approx(plant.real_poles, rel=0.05)
    assert result.plant.real_zeros == pytest.approx(plant.real_zeros, rel=0.05)


@pytest.mark.parametrize("count", [-2, -1, 0, 1, 2])
def test_poles_and_zeros_at_the_origin_are_counted(count: int) -> None:
    plant = PlantModel(1e-3, (), (Mode(200.0, 0.03),), 1e-3, count)
    found = fit_plant([measured(plant, FEWER)]).plant
    assert found.integrators == count
    assert found.pole_modes[0].omega == pytest.approx(200.0, rel=1e-3)
    assert not found.zero_modes
    assert not found.real_zeros


def test_a_slow_pole_outside_the_band_is_named() -> None:
    """At 2 % noise a pole at a sixth of the lowest line shows; it is named, and so is what it is like."""
    plant = PlantModel(3.0, (), (Mode(200.0, 0.03),), 1e-3, 0, (), (2.0,))
    text = said([measured(plant, np.linspace(12.0, 400.0, 200), relative=0.0035)])
    assert re.search(r"real pole is (1\.|2\.)\d* rad/s, below all lines \(12 to 400 rad/s\): .* one at s = 0", text)


def test_a_pole_where_the_search_ends_is_one_at_the_origin() -> None:
    """Residuals that are no noise must not choose a pole a hundred times below the band before s = 0."""
    plant = PlantModel(3600.0, (), (Mode(346.0, 0.0114),), 8.5e-4, 2)
    test = measured(plant, np.linspace(12.6, 510.0, 200), relative=0.02)
    ripple = 1 + 0.04 * np.exp(1j * 0.05 * test.omega) - 0.02j * 12.6 / test.omega
    found = fit_plant([replace(test, response=test.response * ripple)]).plant
    assert (found.integrators, found.real_poles) == (2, ())


def test_zeros_below_the_lines_do_not_hide_integrators() -> None:
    """A flat response at the lowest lines is no double integrator over a slow zero mode."""
    hertz = np.array([0.5, 1, 1.5, 2, 3, 3.5, 3.8, 4, 4.2, 4.5, 5, 6, 8, 10, 12, 13, 15, 18])
    plant = PlantModel(0.85, (), (Mode(2 * np.pi * 4.5, 0.35),), 0.02, 0)
    found = fit_plant([measured(plant, 2 * np.pi * hertz, relative=0.08, seed=3)]).plant
    assert found.integrators == 0


def test_structures_that_the_data_hardly_tell_apart_are_named() -> None:
    plant = PlantModel(3.0, (), (Mode(100.0, 0.1),), 1e-3, 0, (), (600.0,))
    result = fit_plant([measured(plant, np.linspace(10.0, 150.0, 60), relative=0.03)])
    assert result.alike
    assert all(abs(more) < 6 for more in result.alike.values())
    assert "structures within 6 of its BIC: " in "\n".join(cautions(result, [measured(plant)]))


@pytest.mark.parametrize(("zeros", "stands_in"), [((), False), ((-400.0,), True)])
def test_a_zero_in_the_right_half_plane_can_stand_in_for_a_dead_time(zeros: tuple[float, ...], stands_in: bool) -> None:
    """To first order 1 - s/400 is exp(-s/400)."""
    plant = PlantModel(3.0, (), (Mode(100.0, 0.1),), 0.0, 0, zeros)
    nominal = SimpleNamespace(intervals=([0.0], [1.4e-3]))
    result = SimpleNamespace(plant=plant, structure=SimpleNamespace(delayed=False), nominal=nominal)
    (said,) = _dead_time(result, [measured(plant, np.geomspace(10.0, 900.0, 40))])  # type: ignore[arg-type]
    assert "in this structure it is at most 0.0014 s" in said
    assert said.endswith("a zero in the right half plane can replace one") == stands_in


# sign and stability


def test_a_reversed_phase_is_named_and_undone() -> None:
    tests = [measured(PAIR, FEWER, seed=k, name=f"day {k}") for k in range(2)]
    reversed_tests = [replace(test, response=test.response.conj()) for test in tests]
    fitted = fit_model(reversed_tests, A_PAIR)
    assert fitted.model.plant == fit_model(tests, A_PAIR).model.plant
    assert fitted.record.conjugated
    assert re.search(r"the conjugate fits at 1\.\d %, the response as it is", fitted.record.cautions[0])
    np.testing.assert_array_equal(fitted.tests[0].response, tests[0].response)


def test_a_phase_as_it_should_be_is_left() -> None:
    assert not fit_model([measured(PAIR, FEWER)]).record.conjugated


@pytest.mark.parametrize(("rate", "lines", "wanted"), [(30.0, FEWEST, None), (90.0, 60, Wanted(0, (0, 1), (0, 1)))])
def test_an_unstable_plant_is_refused_by_name(rate: float, lines: int, wanted: Wanted | None) -> None:
    """K/(1 - s/a): a stable plant's phase falls where this one's rises, whatever structure it is given."""
    omega = np.geomspace(5.0, 500.0, lines)
    stable = measured(PlantModel(2.0, (), (Mode(200.0, 0.05),), 4e-3, 0), omega)
    test = replace(stable, response=stable.response / (1 - 1j * omega / rate))
    with pytest.raises(InputError, match=r"an unstable plant, with poles at [238]\d\.\d* rad/s, fits to 1\.\d %"):
        fit_model([test], wanted)


@pytest.mark.parametrize("times", [10.0, -1.0])
def test_an_outlier_is_named_and_hardly_counts(times: float) -> None:
    omega = np.linspace(12.0, 1200.0, 100)
    plant = PlantModel(40.0, (Mode(195.0, 0.03),), (Mode(340.0, 0.025),), 1.2e-3)
    test = measured(plant, omega)
    response = test.response.copy()
    response[40] *= times
    fitted = fit_model([replace(test, response=response)])
    assert fitted.model.plant.integrators == 1
    assert fitted.model.plant.gain == pytest.approx(40.0, rel=0.02)
    assert not fitted.record.conjugated
    if fitted.record.loss == "soft-L1":
        hertz = f"{omega[40] / (2 * np.pi):.4g}"
        assert any(f"the plant misses the line at {hertz} Hz by" in caution for caution in fitted.record.cautions)


def test_tests_of_different_bands_are_of_one_plant() -> None:
    plant = PlantModel(40.0, (Mode(195.0, 0.03),), (Mode(340.0, 0.025),), 1.2e-3)
    bands = [np.geomspace(3.0, 120.0, 40), np.linspace(60.0, 630.0, 91), np.linspace(380.0, 1900.0, 121)]
    tests = [measured(plant, omega, seed=k, name=str(k)) for k, omega in enumerate(bands)]
    found = fit_model(tests).model.plant
    assert found.integrators == 1
    assert found.gain == pytest.approx(40.0, rel=0.02)
    assert [mode.omega for mode in found.pole_modes] == [pytest.approx(340.0, rel=0.01)]


def test_what_is_asked_for_is_never_dropped() -> None:
    """Modes that the data do not ask for: the plant has them all the same."""
    plant = PlantModel(0.7, (), (Mode(660.0, 0.6),), 2e-4, 0)
    test = measured(plant, 2 * np.pi * np.geomspace(1.0, 1000.0, 50))
    found = fit_plant([test], Wanted(modes=(1, 2))).plant
    assert (len(found.zero_modes), len(found.pole_modes)) == (1, 2)


# the band


def noisy_tail() -> FrequencyResponse:
    plant = PlantModel(500.0, (Mode(60.0, 0.02),), (Mode(90.0, 0.02),), 1e-3, 2)
    omega = np.arange(3.0, 3000.0, 4.0)
    return measured(plant, omega, floor=float(abs(plant(900j))))


def test_noise_at_the_ends_of_the_band_is_left_out() -> None:
    test = noisy_tail()
    (kept,) = without_noise([test])
    assert 700 < kept.omega[-1] < 1600
    assert kept.omega[0] == test.omega[0]
    assert sum(lines.omega.size for lines in kept.left_out) + kept.omega.size == test.omega.size
    fitted = fit_model([test])
    assert fitted.model.plant.integrators == 2
    assert fitted.model.plant.pole_modes[0].omega == pytest.approx(90.0, rel=0.01)
    assert re.search(
        r"\d+ lines from .* to 477.\d Hz left out: noise exceeds the response", fitted.record.tests[0].left_out[0]
    )


@pytest.mark.parametrize("seed", range(4))
def test_resonances_and_long_dead_times_are_no_noise(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plant = PlantModel(1.0, (Mode(rng.uniform(20, 460), 0.002),), (Mode(rng.uniform(20, 460), 0.002),), 0.3 * seed, 0)
    assert not without_noise([measured(plant, relative=0.1, seed=seed)])[0].left_out


def test_coherence_tells_noise() -> None:
    test = measured(PAIR)
    coherence = np.where(OMEGA > 300.0, 0.2, 0.98)
    (kept,) = without_noise([replace(test, coherence=coherence)])
    assert kept.omega[-1] == pytest.approx(300.0, abs=8.0)


def test_the_scatter_of_tests_tells_noise() -> None:
    """On lines too few for their neighbours to say it."""
    omega = np.geomspace(5.0, 500.0, 40)
    plant = PlantModel(100.0, (), (), 1e-3, 2)
    tests = [measured(plant, omega, floor=float(abs(plant(60j))), seed=k) for k in range(6)]
    kept = without_noise(tests)
    assert all(40.0 < test.omega[-1] < 160.0 for test in kept)


def test_a_band_is_asked_for(tmp_path: Path) -> None:
    test = within(measured(PAIR), 1.0, 50.0)
    assert (test.omega[0], test.omega[-1]) == (pytest.approx(2 * np.pi), pytest.approx(100 * np.pi))
    model = identification.fit([measured(PAIR)], modes=1, real=0, band=(1.0, 50.0))
    assert model.fit is not None
    assert model.fit.tests[0].band == (test.omega[0], test.omega[-1])
    with pytest.raises(InputError, match=r"has lines from 0.2 to 80 Hz; expected some .* 90 to 100 Hz"):
        within(measured(PAIR), 90.0, 100.0)
    with pytest.raises(InputError, match="the band is 50 to 1 Hz; expected the lower frequency first"):
        identification.fit([measured(PAIR)], band=(50.0, 1.0))
    write_responses(tmp_path / "kept.npz", [test])
    (again,) = read_responses(tmp_path / "kept.npz")
    assert [str(lines) for lines in again.left_out] == [str(lines) for lines in test.left_out]


def test_a_band_that_is_none_is_a_mistake(tmp_path: Path) -> None:
    sweep = tmp_path / "sweep.csv"
    sweep.write_text("frequency_hz,real,imag\n1,1,0\n")
    done = CliRunner().invoke(main, ["fit", str(sweep), "--output", str(tmp_path / "m.json"), "--band", "9", "3"])
    assert done.exit_code == 2
    assert "the band is 9 to 3 Hz" in done.output


# units


@pytest.mark.parametrize(("count", "of_response", "of_time"), [(1, 1e-30, 1e15), (3, -1e30, 1e-15)])
def test_units_and_sign_do_not_matter(count: int, of_response: float, of_time: float) -> None:
    """The plant to 1e-6, W_a to its own 1e-3, and as many sentences, over sixty and thirty decades."""
    tests = [measured(PAIR, FEWER, seed=k, name=f"day {k}") for k in range(count)]
    usual = fit_model(tests)
    other = fit_model([replace(t, omega=t.omega / of_time, response=t.response * of_response) for t in tests])
    s = 1j * np.geomspace(3.0, 400.0, 50)
    np.testing.assert_allclose(other.model.plant(s / of_time), usual.model.plant(s) * of_response, rtol=1e-6)
    found, expected = (abs(m.model.additive_bound(s / t)) for m, t in ((other, of_time), (usual, 1.0)))
    np.testing.assert_allclose(found, expected * abs(of_response), rtol=1e-3)
    assert len(other.record.cautions) == len(usual.record.cautions)


# few lines


def test_intervals_over_few_lines_hold_what_they_say() -> None:
    """Eight lines, three tests, 60 sets, of which 57 are expected to be held: intervals too narrow by 10 % hold 51."""
    omega, truth = np.geomspace(1.0, 1000.0, 8), np.array([0.7, 0.1])
    plant, wanted = PlantModel(0.7, (), (), 0.1, 1), Wanted(1, (0, 0), (0, 0))
    hits = np.zeros(2)
    for k in range(60):
        tests = [measured(plant, omega, seed=[k, i], name=str(i)) for i in range(3)]
        lower, upper = fit_plant(tests, wanted).nominal.intervals
        hits += (lower <= truth) & (truth <= upper)
    assert np.all(hits >= 54)


def test_a_structure_says_what_it_has() -> None:
    structure = Structure(-1, 2, 3, right=1, delayed=False, real_pairs=(0, 0, 1))
    assert str(structure) == ("1 differentiator, 1 zero mode, 1 right-half-plane real zero, 3 real poles, no dead time")


# what is compared with the plant afterwards


def test_a_plant_is_compared_with_the_tests_as_its_fit_used_them(tmp_path: Path) -> None:
    """Sweeps that are read again are turned and cut as the fit did; those that it kept are so already."""
    right = measured(PAIR, FEWER)
    test = replace(right, response=right.response.conj(), name="reversed")
    fitted = fit_model([test], band=(1.0, 50.0))
    write_responses(tmp_path / "kept.npz", fitted.tests)
    kept = read_responses(tmp_path / "kept.npz")
    for tests in ([test], kept, as_fitted(fitted.model, [test])):
        (used,) = as_fitted(fitted.model, tests)
        np.testing.assert_array_equal(used.response, fitted.tests[0].response)
        assert sum(lines.omega.size for lines in used.left_out) == test.omega.size - used.omega.size
        assert used.conjugated
    again = fit_model(kept, A_PAIR)
    assert again.record.conjugated
    assert again.record.cautions[0].startswith("the sign of the phase is reversed")


def test_a_test_of_another_name_is_left_with_all_its_lines() -> None:
    model = fit_model([measured(PAIR, name="day 1")], A_PAIR, band=(1.0, 50.0)).model
    (used,) = as_fitted(model, [measured(PAIR, name="day 2")])
    assert used.omega.size == OMEGA.size


def test_noise_alone_is_refused() -> None:
    rng = np.random.default_rng(1)
    noise = FrequencyResponse(OMEGA, rng.standard_normal((OMEGA.size, 2)) @ [1, 1j], None, "noise")
    with pytest.raises(InputError, match="noise: noise exceeds the response at every line"):
        fit_model([noise])


def test_tests_of_different_plants_are_not_cut_as_noise() -> None:
    plants = [replace(PAIR, gain=gain, delay_s=delay) for gain, delay in ((0.1, 1e-3), (1.0, 9e-3), (4.0, 20e-3))]
    kept = without_noise([measured(plant, name=str(plant.gain)) for plant in plants])
    assert all(not test.left_out for test in kept)


def test_a_reversal_is_kept_for_each_test() -> None:
    """A test that a fit turned and one that it did not, fitted together: each is compared as it was used."""
    right = measured(PAIR, FEWER, seed=1, name="right")
    turned = fit_model([replace(right, response=right.response.conj(), name="turned")], A_PAIR).tests[0]
    tests = [turned, right]
    compared = as_fitted(fit_model(tests, A_PAIR).model, tests)
    for test, used in zip(tests, compared, strict=True):
        np.testing.assert_array_equal(used.response, test.response)


def test_sweeps_of_a_joined_fit_are_joined_again() -> None:
    bands = [np.geomspace(3.0, 160.0, 60), np.geomspace(100.0, 500.0, 60)]
    tests = [measured(PAIR, omega, seed=k, name=str(k)) for k, omega in enumerate(bands)]
    fitted = fit_model(tests, A_PAIR)
    (used,) = as_fitted(fitted.model, tests)
    assert used.name == fitted.tests[0].name == "0 and 1"
    np.testing.assert_array_equal(used.response, fitted.tests[0].response)


def test_lines_left_out_are_named_side_by_side() -> None:
    sentences = [str(lines) for lines in within(measured(PAIR), 1.0, 50.0).left_out]
    assert [sentence.split(" left")[0] for sentence in sentences] == [
        "4 lines from 0.2 to 0.8 Hz",
        "150 lines from 50.2 to 80 Hz",
    ]


def test_a_plain_reversal_is_found_beside_a_simple_unstable_plant() -> None:
    plant = PlantModel(7.0, (Mode(180.0, 0.03), Mode(600.0, 0.05)), (Mode(280.0, 0.02), Mode(750.0, 0.05)), 8e-3)
    test = measured(plant, 2 * np.pi * np.geomspace(0.3, 160.0, 100))
    fitted = fit_model([replace(test, response=test.response.conj())], Wanted(1, (2, 2), (0, 0)))
    assert fitted.record.conjugated
    assert fitted.model.plant.gain == pytest.approx(7.0, rel=0.01)
