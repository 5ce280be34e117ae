"""Raw record -> frequency response: exact without noise, honest variances, independent lines."""

from __future__ import annotations

import numpy as np
import pytest
from held_plant import PLANTS, held_response, over_hold
from numpy.typing import NDArray

from identification.base.errors import InputError
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.pulse_response import aliases
from identification.sweeps.estimate_response import SweepEstimate, estimate_response
from identification.sweeps.excited_lines import period_of, whole_periods
from identification.sweeps.usable_lines import usable_lines

Real = NDArray[np.float64]
DT = 1e-3
PLANT = PlantModel(3.0, (Mode(300.0, 0.05),), (Mode(450.0, 0.04),), 4e-3)


def _sweep(samples: int, start_hz: float = 20.0, stop_hz: float = 150.0) -> Real:
    """A linear sweep, faded in and out, with a quarter of silence at the end."""
    t = np.arange(samples) * DT
    length = 0.7 * t[-1]
    x = np.clip((t - 0.02 * t[-1]) / length, 0, 1)
    fade = np.sin(np.pi / 2 * np.clip(np.minimum(x, 1 - x) / 0.03, 0, 1)) ** 2
    return fade * np.sin(2 * np.pi * length * (start_hz * x + (stop_hz - start_hz) / 2 * x**2))


def _response(u: Real) -> Real:
    """The plant's response to a band-limited input that is followed by silence, through its spectrum."""
    padded = np.concatenate([u, np.zeros(3 * u.size)])
    s = 2j * np.pi * np.fft.rfftfreq(padded.size, DT)
    # P(s) (1 - exp(-s dt)) is finite at s = 0, where it is gain dt.
    step = np.concatenate([[PLANT.gain * DT], PLANT(s[1:]) * -np.expm1(-s[1:] * DT)])
    return np.cumsum(np.fft.irfft(np.fft.rfft(padded) * step, padded.size))[: u.size]


def test_without_noise_the_response_is_the_plants() -> None:
    """A quadratic over 0.4 Hz against modes 5 Hz wide leaves 1e-4; the output does not come back to where it began."""
    u = _sweep(2**15)
    estimate = estimate_response(DT, u, _response(u))
    np.testing.assert_allclose(estimate.response, PLANT(1j * estimate.omega), rtol=2e-4)
    assert np.all(np.diff(estimate.omega) > 0)
    assert 19 < estimate.omega[0] / (2 * np.pi) < 23
    assert 147 < estimate.omega[-1] / (2 * np.pi) < 151


def test_a_record_that_is_cut_off_is_recognised() -> None:
    """Without the silence the response's tail is missing: the transient's polynomial takes its place."""
    u = _sweep(2**15)
    y = _response(u)
    end = int(0.45 * u.size)
    rng = np.random.default_rng(0)
    noisy = y[:end] + 1e-5 * rng.standard_normal(end)
    estimate = estimate_response(DT, u[:end], noisy)
    error = np.abs(estimate.response / PLANT(1j * estimate.omega) - 1)
    assert np.median(error) < 5e-3
    inside = slice(estimate.omega.size // 20, -estimate.omega.size // 20)
    assert np.max(error[inside]) < 0.05


@pytest.fixture(scope="module")
def noisy() -> tuple[Real, NDArray[np.complex128], Real, Real]:
    """Omega, errors (40, M) of forty noisy records, estimated variances (40, M), and excitation."""
    u = _sweep(2**12)
    y = _response(u)
    rng = np.random.default_rng(2)
    estimates = [estimate_response(DT, u, y + 1e-3 * rng.standard_normal(u.size)) for _ in range(40)]
    omega = _common(estimates)
    kept = [np.isin(e.omega, omega) for e in estimates]
    errors = np.array([e.response[k] - PLANT(1j * omega) for e, k in zip(estimates, kept, strict=True)])
    variances = np.array([e.variance[k] for e, k in zip(estimates, kept, strict=True)])
    return omega, errors, variances, estimates[0].excitation[kept[0]]


def _common(estimates: list[SweepEstimate]) -> Real:
    """The lines that all estimates keep."""
    return np.array(sorted(set.intersection(*(set(e.omega) for e in estimates))))


def test_variances_are_honest(noisy: tuple[Real, NDArray[np.complex128], Real, Real]) -> None:
    """40 records: each line's mean square error has a relative standard deviation of 0.16 around the mean variance."""
    _, errors, variances, _ = noisy
    ratio = np.mean(np.abs(errors) ** 2, axis=0) / np.mean(variances, axis=0)
    assert abs(np.median(ratio) - 1) < 0.05
    assert np.std(ratio) < 0.25


def test_excitation_is_how_the_variance_goes_from_line_to_line(
    noisy: tuple[Real, NDArray[np.complex128], Real, Real],
) -> None:
    _, errors, _, excitation = noisy
    ratio = np.mean(np.abs(errors) ** 2, axis=0) / excitation
    assert np.std(ratio) / np.mean(ratio) < 0.25


def test_lines_are_independent(noisy: tuple[Real, NDArray[np.complex128], Real, Real]) -> None:
    """Correlations of neighbours, the second and the third, averaged over lines: noise leaves 1/sqrt(40 lines)."""
    _, errors, variances, _ = noisy
    normalised = errors / np.sqrt(variances.mean(axis=0))
    for lag in (1, 2, 3):
        correlation = np.mean(normalised[:, lag:].conj() * normalised[:, :-lag])
        assert abs(correlation) < 4 / np.sqrt(normalised[:, lag:].size) + 0.05


def test_too_narrow_a_sweep_is_refused() -> None:
    t = np.arange(256) * DT
    with pytest.raises(InputError, match=r"the input excites \d+ spectral lines; expected 27 or more"):
        estimate_response(DT, np.sin(2 * np.pi * 50 * t) * np.hanning(256), np.cos(2 * np.pi * 50 * t))


def _multisine(samples: int, stop_hz: float, seed: int) -> Real:
    spectrum = np.zeros(samples // 2 + 1, dtype=complex)
    lines = np.arange(int(10 * samples * DT), int(stop_hz * samples * DT))
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(seed).random(lines.size))
    u = np.fft.irfft(spectrum, samples)
    return np.asarray(u / np.std(u))


@pytest.mark.parametrize("name", PLANTS)
def test_a_held_sweep_gives_the_exact_pulse_transfer_function(name: str) -> None:
    """Over the hold's factor, that is P and its aliases, to 1e-5 everywhere; the aliases come to 5 % and more."""
    plant, u = PLANTS[name], _sweep(2**14, 10.0, 350.0)
    estimate = estimate_response(DT, u, held_response(plant, DT, u), held=True)
    np.testing.assert_allclose(estimate.response, over_hold(plant, DT, estimate.omega), rtol=1e-5)
    without = estimate.response - aliases(plant, DT, estimate.omega)
    np.testing.assert_allclose(without, plant(1j * estimate.omega), rtol=2e-5)
    assert np.max(np.abs(without / estimate.response - 1)) > 0.05
    assert estimate.omega.size > 1500


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("kind", ["noise", "multisine", "four periods"])
def test_other_held_inputs(name: str, kind: str) -> None:
    """Records that end, and one that begins, in the middle of it: what is cut off leaves 3 % at worst."""
    plant = PLANTS[name]
    samples = 2**14 if plant.delay_s > 0.1 else 2**13
    u = {
        "noise": np.random.default_rng(3).standard_normal(samples),
        "multisine": _multisine(samples, 350.0, 4),
        "four periods": np.tile(_multisine(samples // 4, 350.0, 5), 4),
    }[kind]
    estimate = estimate_response(DT, u, held_response(plant, DT, u), held=True)
    inside = estimate.omega > 2 * np.pi * 10
    error = np.abs(estimate.response / over_hold(plant, DT, estimate.omega) - 1)[inside]
    assert np.max(error) < 0.03
    assert np.median(error) < 2e-3


def test_a_repeated_input_is_recognised_and_a_narrow_sweep_is_not_one() -> None:
    """A sweep over a tenth of an octave is much like itself some cycles later, not a quarter of the record later."""
    period = np.random.default_rng(11).standard_normal(330)
    u = np.tile(period, 13)[:-100]
    assert period_of(u, shortest=54) == 330
    cut, y, periods = whole_periods(u, u.copy(), 330)
    assert (periods, cut.size, y.size) == (12, 12 * 330 + 1, 12 * 330 + 1)
    np.testing.assert_array_equal(cut, u[-cut.size :])
    fraction = np.sin(2 * np.pi * np.outer(np.arange(1, 30), np.arange(5000) / 300.5)).sum(axis=0)
    assert abs(period_of(fraction, shortest=54) - 300.5) < 0.2
    narrow = _sweep(2**13, 50.0, 53.0)
    assert period_of(narrow, shortest=54) == narrow.size
    assert whole_periods(narrow, narrow, narrow.size)[2] == 1


def test_held_lines_end_below_the_nyquist_frequency() -> None:
    """There the alias is as large as P itself; band-limited channels are used as far as they are excited."""
    u = np.random.default_rng(6).standard_normal(2**12)
    y = held_response(PLANTS["integrator"], DT, u)
    assert 0.78 < estimate_response(DT, u, y, held=True).omega[-1] * DT / np.pi < 0.8
    assert estimate_response(DT, u, y).omega[-1] * DT / np.pi > 0.99


@pytest.mark.parametrize(
    ("name", "noise", "kind"),
    [("integrator", 1e-4, "sweep"), ("no integrator, real pole", 1e-4, "noise"), ("two integrators", 1e-5, "sweep")],
)
def test_variances_of_held_records_are_honest(name: str, noise: float, kind: str) -> None:
    """12 records: the mean over the lines is known to 2 %, a line's to 29 %."""
    u = _sweep(2**12, 15.0, 350.0) if kind == "sweep" else np.random.default_rng(8).standard_normal(2**12)
    y = held_response(PLANTS[name], DT, u)
    rng = np.random.default_rng(7)
    estimates = [estimate_response(DT, u, y + noise * rng.standard_normal(u.size), held=True) for _ in range(12)]
    common = _common(estimates)
    common = common[common > 60]
    assert len(common) > 300
    kept = [np.isin(e.omega, common) for e in estimates]
    pairs = list(zip(estimates, kept, strict=True))
    errors = np.array([np.abs(e.response - over_hold(PLANTS[name], DT, e.omega))[k] ** 2 for e, k in pairs])
    ratio = np.mean(errors, axis=0) / np.mean([e.variance[k] for e, k in pairs], axis=0)
    assert abs(np.median(ratio) - 1) < 0.06
    assert abs(np.mean(ratio) - 1) < 0.12
    over_excitation = np.mean([error / e.excitation[k] for error, (e, k) in zip(errors, pairs, strict=True)], axis=0)
    for each in (ratio, over_excitation):
        low, high = np.quantile(each / np.median(each), [0.1, 0.9])
        assert 0.6 < low < high < 1.6


@pytest.mark.parametrize("seconds", [8, 16])
def test_a_resonance_narrower_than_a_window(seconds: int) -> None:
    """zeta = 0.008 at 45 Hz is 0.7 Hz wide, a window of 9 lines in 8 s 1.1 Hz: quadratics miss it by 5 %."""
    plant = PlantModel(7.0, (Mode(175.0, 0.02),), (Mode(282.0, 0.008),), 8.3e-3)
    u = 5 * _sweep(1000 * seconds, 10.0, 200.0)
    y = held_response(plant, DT, u)
    rng = np.random.default_rng(9)
    worst = []
    for _ in range(5):
        estimate = estimate_response(DT, u, y + 1e-3 * rng.standard_normal(u.size), held=True)
        z = np.abs(estimate.response - over_hold(plant, DT, estimate.omega)) / np.sqrt(estimate.variance)
        near = np.abs(estimate.omega - 282) < 12
        assert near.sum() > 5
        worst.append(np.mean(z[near] ** 2))
    assert np.mean(worst) < 3.0  # F with 2 and 6 degrees of freedom has mean 1.5


def test_offset_drift_and_a_record_that_begins_in_motion() -> None:
    """A double integrator that flies off during a sweep, on top of a sensor's offset and ramp."""
    plant = PLANTS["two integrators"]
    before, u = 0.2 * np.ones(500), _sweep(2**14, 10.0, 350.0)
    commands = np.concatenate([before, u])
    y = held_response(plant, DT, commands)[before.size :] + 3.0 + 0.7 * np.arange(u.size) * DT
    estimate = estimate_response(DT, u, y, held=True)
    np.testing.assert_allclose(estimate.response, over_hold(plant, DT, estimate.omega), rtol=1e-3)
    assert np.ptp(y) > 100 * np.ptp(held_response(plant, DT, u))


def test_a_long_dead_time_does_not_bend_the_response() -> None:
    plant, u = PLANTS["half a second late"], _sweep(2**12, 20.0, 200.0)
    estimate = estimate_response(DT, u, held_response(plant, DT, u), held=True)
    np.testing.assert_allclose(estimate.response, over_hold(plant, DT, estimate.omega), rtol=1e-3)


def test_a_sweep_over_three_decades() -> None:
    """Exponential in time, its energy falls as 1/frequency; windows are narrow where frequencies are low."""
    t = np.arange(2**16) * 5 * DT
    x = np.clip(t / (0.9 * t[-1]), 0, 1)
    fade = np.sin(np.pi / 2 * np.clip(np.minimum(x, 1 - x) / 0.01, 0, 1)) ** 2
    u = fade * np.sin(2 * np.pi * 0.05 * 0.9 * t[-1] * (1000.0**x - 1) / np.log(1000))
    plant = PlantModel(3.0, (), (Mode(3.0, 0.02), Mode(150.0, 0.05)), 4e-3)
    estimate = estimate_response(5 * DT, u, held_response(plant, 5 * DT, u), held=True)
    assert estimate.omega[0] < 2 * np.pi * 0.07
    assert estimate.omega[-1] > 2 * np.pi * 40
    np.testing.assert_allclose(estimate.response, over_hold(plant, 5 * DT, estimate.omega), rtol=1e-4)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("kind", ["sweep", "noise", "itself"])
def test_units_and_signs_do_not_matter(kind: str, noise: float) -> None:
    """Input, output and time in units up to 45 decades apart, either sign; exact records too, and y = u, where nothing
    is left at all. What rounding leaves of an exact record is no variance that two units share.
    """
    u = _sweep(2**11, 20.0, 200.0) if kind == "sweep" else np.random.default_rng(14).standard_normal(2**11)
    y = u if kind == "itself" else held_response(PLANTS["integrator"], DT, u)
    y = y + noise * np.std(y) * np.random.default_rng(10).standard_normal(u.size)
    with np.errstate(over="raise", divide="raise", invalid="raise"):
        plain = estimate_response(DT, u, y, held=True)
        for step, of_u, of_y in ((1e30, 1.0, -1.0), (1e-30, 1e-30, 1e30), (1.0, -1e45, 1e-45), (1.0, 1e-45, 1e45)):
            other = estimate_response(step * DT, of_u * u, of_y * y, held=True)
            np.testing.assert_allclose(other.omega * step, plain.omega, rtol=1e-12)
            np.testing.assert_allclose(other.response, plain.response * (of_y / of_u), rtol=1e-6)
            np.testing.assert_allclose(other.excitation, plain.excitation, rtol=1e-5)
            if noise:
                np.testing.assert_allclose(other.variance, plain.variance * (of_y / of_u) ** 2, rtol=1e-5)


LOOP = PlantModel(11.8, (Mode(15.7, 0.05),), (Mode(19.5, 0.3),), 3e-3, 1)


def test_a_loop_that_follows_a_quick_sweep_shows_the_plant_and_not_its_controller() -> None:
    """A loop of unit gain goes from rest to rest, its encoder counts. At low frequencies the reference has a spectrum
    as smooth as a transient: what that leaves is -1, the controller. The lowest lines are known as well as the others,
    though their errors are larger: the response falls by two decades.
    """
    step, t = 4 * DT, np.arange(4096) * 4 * DT
    x = np.clip((t - 0.03) / 14, 0, 1)
    fade = np.sin(np.pi / 2 * np.clip(np.minimum(x, 1 - x) / 0.01, 0, 1)) ** 2
    reference = 100 * fade * np.sin(np.pi * 14 * 20 * x**2)
    pulse = held_response(LOOP, step, np.eye(1, t.size)[0])
    u, y = np.zeros(t.size), np.zeros(t.size)
    for k in range(t.size):
        y[k] = np.round(pulse[k:0:-1] @ u[:k])
        u[k] = reference[k] - y[k]
    estimate = estimate_response(step, u, y, held=True)
    error = np.abs(estimate.response / over_hold(LOOP, step, estimate.omega) - 1)
    low = estimate.omega < 2 * np.pi * 4
    assert estimate.omega[0] < 2 * np.pi
    assert low.sum() > 15
    assert np.max(error[low]) < 0.02


def test_a_record_that_is_cut_off_gives_no_lines_where_its_end_hides_the_response() -> None:
    """The lines that are left out come with a reason; those that are kept are right."""
    u = _sweep(2**14, 0.5, 80.0)[: 2**13]
    estimate = estimate_response(DT, u, held_response(PLANTS["integrator"], DT, u), held=True)
    np.testing.assert_allclose(estimate.response, over_hold(PLANTS["integrator"], DT, estimate.omega), rtol=1e-3)
    said = "; ".join(map(str, estimate.left_out))
    assert "Hz left out: the transients at the ends of the record hide the response" in said
    assert sum(lines.response.size for lines in estimate.left_out) > 50
    assert not any(np.isin(lines.omega, estimate.omega).any() for lines in estimate.left_out)


def test_noise_beyond_the_plants_band_is_left_out() -> None:
    """White noise up to the Nyquist frequency drives a plant that a sensor's noise hides from a tenth of it on."""
    u = np.random.default_rng(12).standard_normal(2**13)
    plant = PlantModel(1.0, (), (), 5e-3, 0, (), (40.0, 60.0))
    y = held_response(plant, DT, u) + 0.05 * np.random.default_rng(13).standard_normal(u.size)
    estimate = estimate_response(DT, u, y, held=True)
    error = np.abs(estimate.response / over_hold(plant, DT, estimate.omega) - 1)
    assert 2 * np.pi * 25 < estimate.omega[-1] < 2 * np.pi * 60
    assert np.median(error) < 0.2
    assert "Hz left out: noise is more than half of the response" in str(estimate.left_out[-1])
    with pytest.raises(InputError, match=r"expected 9 or more \(.*\d+ lines from .* left out: noise is more"):
        estimate_response(DT, u, np.random.default_rng(13).standard_normal(u.size), held=True)


@pytest.mark.parametrize("falls", [True, False])
def test_an_amplitude_that_falls_or_rises_by_a_decade_keeps_the_band(falls: bool) -> None:
    u = _sweep(2**13, 5.0, 150.0) * np.geomspace(1, 0.1, 2**13)[:: 1 if falls else -1]
    estimate = estimate_response(DT, u, held_response(PLANTS["integrator"], DT, u), held=True)
    assert estimate.omega[0] < 2 * np.pi * 6
    assert estimate.omega[-1] > 2 * np.pi * 145
    np.testing.assert_allclose(estimate.response, over_hold(PLANTS["integrator"], DT, estimate.omega), rtol=1e-3)


def _from_rest(samples: int, step: float, start_hz: float, stop_hz: float) -> Real:
    """A logarithmic sweep from the first sample on, with a tenth of silence at the end: a mass flies off."""
    t, length = np.arange(samples) * step, 0.9 * samples * step
    x, octaves = np.clip(t / length, 0, 1), np.log(stop_hz / start_hz)
    fade = np.sin(np.pi / 2 * np.clip(np.minimum(x, 1 - x) / 0.005, 0, 1)) ** 2
    return np.asarray(fade * np.sin(2 * np.pi * start_hz * length * np.expm1(octaves * x) / octaves))


def test_a_mass_that_flies_off_in_a_logarithmic_sweep_keeps_the_whole_band() -> None:
    """Its drift is a thousand times what the sweep moves it by at high frequencies."""
    plant = PlantModel(40.0, (Mode(210.0, 0.01),), (Mode(260.0, 0.015),), 1.1e-3, 2)
    u = _from_rest(12000, 2e-3, 0.25, 100.0)
    estimate = estimate_response(2e-3, u, held_response(plant, 2e-3, u), held=True)
    np.testing.assert_allclose(estimate.response, over_hold(plant, 2e-3, estimate.omega), rtol=1e-6)
    assert estimate.omega[0] < 2 * np.pi * 0.5
    assert estimate.omega[-1] > 2 * np.pi * 95


def test_what_is_not_known_of_a_drift_is_in_the_variance() -> None:
    """The spectrum of a linear sweep is as smooth as a drift's: in short windows one passes for the response."""
    plant, step = PlantModel(40.0, (Mode(210.0, 0.01),), (Mode(260.0, 0.015),), 1.1e-3, 2), 2e-3
    t = np.arange(12000) * step
    x = np.clip((t / t[-1] - 0.02) / 0.85, 0, 1)
    fade = np.sin(np.pi / 2 * np.clip(np.minimum(x, 1 - x) / 0.02, 0, 1)) ** 2
    u = fade * np.sin(2 * np.pi * 0.85 * t[-1] * (0.5 * x + 30 * x**2))
    y = held_response(plant, step, u)
    rng = np.random.default_rng(15)
    for _ in range(3):
        estimate = estimate_response(step, u, y + 1e-3 * np.std(y) * rng.standard_normal(y.size), held=True)
        error = np.abs(estimate.response - over_hold(plant, step, estimate.omega)) / np.sqrt(estimate.variance)
        assert np.mean(error[:12] ** 2) < 6


def _lines_of(kind: str, periods: int, mean: float = 0.0) -> Real:
    """A multisine of 200 samples a period: all of its harmonics up to 60, odd ones, or a random half; or pink ones."""
    rng = np.random.default_rng(16)
    number = np.arange(1, 61)
    number = {"odd": number[::2], "random": number[rng.random(60) < 0.5]}.get(kind, number)
    spectrum = np.zeros(101, dtype=complex)
    spectrum[number] = np.exp(2j * np.pi * rng.random(number.size)) * (1 / number if kind == "pink" else 1.0)
    u = np.fft.irfft(spectrum, 200)
    return np.tile(mean + u / np.std(u), periods)


@pytest.mark.parametrize(
    ("kind", "first", "lines"), [("all", 1, 60), ("odd", 1, 30), ("random", 2, 0), ("pink", 1, 60)]
)
@pytest.mark.parametrize("integrators", [0, 1, 2])
def test_a_repeated_input_tells_the_response_at_each_of_its_harmonics(
    kind: str, first: int, lines: int, integrators: int
) -> None:
    """From the first on, from rest, while integrators fly off: a ramp and a parabola are exact."""
    plant, step = PlantModel(24.0, (), (), 0.0, integrators, (), (30.0,)), 5e-3
    u = _lines_of(kind, 7, 0.3)
    estimate = estimate_response(step, u, held_response(plant, step, u), held=True)
    number = estimate.omega * 200 * step / (2 * np.pi)
    assert round(number[0]) == first
    assert number.size == (lines or round(np.count_nonzero(np.abs(np.fft.rfft(u[:200]))[1:] > 1)))
    np.testing.assert_allclose(number, np.rint(number), rtol=1e-12)
    np.testing.assert_allclose(estimate.response, over_hold(plant, step, estimate.omega), rtol=1e-6)


@pytest.mark.parametrize(("periods", "of_input"), [(2, 0.0), (4, 0.0), (9, 0.03)])
def test_the_scatter_of_the_periods_tells_the_error(periods: int, of_input: float) -> None:
    """From rest, so that the beginning has a transient; with a noisy input, too. 40 records: a mean is known to 3 %."""
    plant, step, rng = PlantModel(24.0, (), (), 0.0, 1, (), (30.0,)), 5e-3, np.random.default_rng(17)
    u = _lines_of("pink", periods, 0.1)
    y = held_response(plant, step, u)
    ratios = []
    for _ in range(40):
        noise = 1e-3 * rng.standard_normal(u.size), of_input * rng.standard_normal(u.size)
        estimate = estimate_response(step, u + noise[1], y + noise[0], held=True)
        ratios.append(np.abs(estimate.response - over_hold(plant, step, estimate.omega)) ** 2 / estimate.variance)
        assert estimate.omega.size > 10
        assert estimate.omega[0] * 200 * step < 2 * np.pi * 1.01
    assert 0.8 < np.mean(np.concatenate(ratios)) < 1.35
    assert np.mean([ratio[:4] for ratio in ratios]) < 2


def test_lines_below_the_first_window_are_named() -> None:
    """A sweep from 0.1 Hz on, in 8 s: none of its lines up to 1 Hz makes a window."""
    u = np.random.default_rng(18).standard_normal(2**13)
    estimate = estimate_response(DT, u, held_response(PLANTS["no integrator, real pole"], DT, u), held=True)
    assert "8 lines from 0.1221 to 0.9767 Hz left out: closer to 0 Hz than the width of a window of lines" in str(
        [str(lines) for lines in estimate.left_out]
    )


def test_a_repeated_input_of_few_harmonics_is_refused() -> None:
    u = np.tile(np.sin(2 * np.pi * np.arange(200) / 100) + np.sin(2 * np.pi * np.arange(200) / 40), 5)
    with pytest.raises(InputError, match="repeats itself every 200 samples and excites 2 harmonics of that; exp"):
        estimate_response(DT, u, np.roll(u, 3))


def test_a_band_that_makes_no_long_window() -> None:
    """Of 36 lines, no drift is told in windows of 45."""
    u, plant = _multisine(2**13, 14.5, 19), PLANTS["no integrator, real pole"]
    estimate = estimate_response(DT, u, held_response(plant, DT, u), held=True)
    assert 9 <= estimate.omega.size <= 12
    np.testing.assert_allclose(estimate.response, over_hold(plant, DT, estimate.omega), rtol=1e-2)


def test_a_refusal_gives_a_reason_where_no_line_was_left_out() -> None:
    whole = np.full((2, 3), 1.0)
    omega = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    with pytest.raises(InputError, match=r"^6 spectral lines can .* 9 or more \(a longer record or a wider sweep\)$"):
        usable_lines(omega, whole + 0j, 1e-6 * whole, 1e-6 * whole, np.ones(2))
