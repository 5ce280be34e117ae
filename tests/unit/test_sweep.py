"""Raw record -> frequency response: exact without noise, honest variances, independent lines."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.files import InputError
from identification.plant import Mode, PlantModel
from identification.sweep import estimate_response

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
    """Omega, errors (60, M) of sixty noisy records, estimated variances (60, M), and excitation."""
    u = _sweep(2**13)
    y = _response(u)
    rng = np.random.default_rng(2)
    estimates = [estimate_response(DT, u, y + 1e-3 * rng.standard_normal(u.size)) for _ in range(60)]
    omega = estimates[0].omega
    errors = np.array([e.response - PLANT(1j * omega) for e in estimates])
    return omega, errors, np.array([e.variance for e in estimates]), estimates[0].excitation


def test_variances_are_honest(noisy: tuple[Real, NDArray[np.complex128], Real, Real]) -> None:
    """60 records: each line's mean square error has a relative standard deviation of 0.13 around the mean variance."""
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
    """Correlations of neighbours, the second and the third, averaged over lines: noise leaves 1/sqrt(60 lines)."""
    _, errors, variances, _ = noisy
    normalised = errors / np.sqrt(variances.mean(axis=0))
    for lag in (1, 2, 3):
        correlation = np.mean(normalised[:, lag:].conj() * normalised[:, :-lag])
        assert abs(correlation) < 4 / np.sqrt(normalised[:, lag:].size) + 0.05


def test_too_narrow_a_sweep_is_refused() -> None:
    t = np.arange(256) * DT
    with pytest.raises(InputError, match=r"the input excites \d+ spectral lines; expected 27 or more"):
        estimate_response(DT, np.sin(2 * np.pi * 50 * t) * np.hanning(256), np.cos(2 * np.pi * 50 * t))
