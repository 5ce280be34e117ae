"""Which lines at the ends of a test's band are noise: they say nothing of the plant and would widen its bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.base.arrays import Complex, Flags, Real
from identification.base.errors import InputError
from identification.sweeps.response import FrequencyResponse, LeftOut

WINDOW = 9  # lines in which a response is a quadratic of its place and the rest is noise
POOLED = 27  # lines whose noise is taken together
FEWEST = 3 * POOLED  # lines: of fewer, a resonance may be a good part
HALF = 0.5  # share of the power that is noise, above which a line says nothing
COHERENT = 0.5  # coherence below which more than half of the output's power is noise
SAID = 3.0  # lines of noise that one line of signal outweighs
LEAST = 12.0  # lines of noise, less SAID for each other one, that are left out
AGREE, QUARTER = 0.3, 0.25  # scatter over the mean of tests of one plant, at a share of the lines at least
FEWEST_TESTS = 3  # whose scatter tells noise


def within(test: FrequencyResponse, low_hz: float, high_hz: float) -> FrequencyResponse:
    """The test's lines from ``low_hz`` to ``high_hz``; the others are left out.

    Raises
    ------
    InputError
        The two are no band, or no line is within.
    """
    if not 0 <= low_hz < high_hz:
        raise InputError(f"the band is {low_hz:.12g} to {high_hz:.12g} Hz; expected the lower frequency first")
    low, high = 2 * np.pi * low_hz * (1 - 1e-12), 2 * np.pi * high_hz * (1 + 1e-12)
    kept = (test.omega >= low) & (test.omega <= high)
    if not kept.any():
        first, last = test.omega[[0, -1]] / (2 * np.pi)
        raise InputError(
            f"{test.name}: has lines from {first:.6g} to {last:.6g} Hz; expected some in the given band, "
            f"{low_hz:.6g} to {high_hz:.6g} Hz"
        )
    return only(test, kept, "outside the given band")


def without_noise(tests: Sequence[FrequencyResponse]) -> list[FrequencyResponse]:
    """The tests without the lines at both ends of their bands that are mostly noise.

    Raises
    ------
    InputError
        All lines of a test are.

    Notes
    -----
    A line is mostly noise where more than HALF of the power of the lines about it is no smooth response, which is a
    quadratic in windows of WINDOW lines after the typical dead time is taken off; where the coherence, smoothed alike,
    is below COHERENT; or where tests on the same lines differ by more than their mean. A resonance can look so too, but
    has lines of signal on both sides: only what reaches the end of the band is left out, the longest run there in which
    one line of signal is outweighed by SAID lines of noise.
    """
    scatter = _scattered(tests)
    return [_trimmed(test, _noisy(test) | scatter) for test in tests]


def _noisy(test: FrequencyResponse) -> Flags:
    noisy = np.zeros(test.omega.size, dtype=bool)
    if test.omega.size < FEWEST:
        return noisy
    if test.coherence is not None:
        noisy |= _running(np.nan_to_num(test.coherence, nan=0.0), WINDOW) < COHERENT
    if test.record is None:  # that of a record is smooth by how it is estimated
        noisy |= _share_of_noise(test.omega, test.response) > HALF
    return noisy


def _share_of_noise(omega: Real, response: Complex) -> Real:
    """(M,) the share of the power about each line that no smooth response explains."""
    step = np.angle(response[1:] * response[:-1].conj())
    delay = -np.median(step / np.diff(omega))
    level = _running(np.abs(response), POOLED)
    rows = np.exp(1j * omega * delay) * response / np.where(level > 0, level, 1.0)
    place = np.linspace(-1, 1, WINDOW)
    q, _ = np.linalg.qr(place[:, None] ** np.arange(3))
    windows = np.lib.stride_tricks.sliding_window_view(rows, WINDOW)
    power = np.sum(np.abs(windows) ** 2, axis=1)
    left = np.maximum(power - np.sum(np.abs(windows @ q) ** 2, axis=1), 0.0) * WINDOW / (WINDOW - 3)
    shares = np.where(power > 0, left / np.where(power > 0, power, 1.0), 1.0)
    return _running(np.pad(shares, WINDOW // 2, mode="edge"), POOLED)


def _running(values: Real, width: int) -> Real:
    """Median (M,) of ``values`` (M,) over ``width`` neighbours."""
    padded = np.pad(values, width // 2, mode="reflect")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=1))


def _scattered(tests: Sequence[FrequencyResponse]) -> Flags:
    """(M,) where tests on the same lines differ by more than their mean; False without such tests."""
    none = np.zeros(1, dtype=bool)
    if len(tests) < FEWEST_TESTS or tests[0].omega.size < WINDOW:
        return none
    if not all(np.array_equal(test.omega, tests[0].omega) for test in tests):
        return none
    responses = np.array([test.response for test in tests])
    scatter, mean = responses.std(axis=0, ddof=1), np.abs(responses.mean(axis=0))
    ratio = np.divide(scatter, mean, out=np.where(scatter > 0, np.inf, 0.0), where=mean > 0)
    of_one_plant = np.quantile(ratio, QUARTER) < AGREE
    return _running(ratio, WINDOW) > 1 if of_one_plant else none


def _trimmed(test: FrequencyResponse, noisy: Flags) -> FrequencyResponse:
    score = np.where(np.broadcast_to(noisy, test.omega.shape), 1.0, -SAID)
    kept = np.ones(test.omega.size, dtype=bool)
    for side in (slice(None), slice(None, None, -1)):
        total = np.cumsum(score[side])
        if total.max() >= LEAST:
            kept[side][: int(np.argmax(total)) + 1] = False
    if not kept.any():
        raise InputError(f"{test.name}: noise exceeds the response at every line; expected less noise")
    return only(test, kept, "noise exceeds the response")


def only(test: FrequencyResponse, kept: Flags, reason: str) -> FrequencyResponse:
    """The test's lines where ``kept`` (M,) holds, which are some; the others are left out for the ``reason``."""
    if kept.all():
        return test
    first, last = np.flatnonzero(kept)[[0, -1]]
    place = np.arange(kept.size)
    parts = [~kept & side for side in (place < first, (place > first) & (place < last), place > last)]
    rest = [LeftOut(test.omega[part], test.response[part], reason) for part in parts if part.any()]
    return replace(
        test,
        omega=test.omega[kept],
        response=test.response[kept],
        coherence=None if test.coherence is None else test.coherence[kept],
        excitation=None if test.excitation is None else test.excitation[kept],
        left_out=(*test.left_out, *rest),
    )
