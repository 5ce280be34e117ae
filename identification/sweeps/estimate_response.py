"""Raw record of a sweep -> frequency response with the variance of each line (local models of windows of lines)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.base.arrays import Complex, Flags, Real, Whole
from identification.base.errors import InputError
from identification.model.pulse_response import hold
from identification.sweeps.drift import find_drift
from identification.sweeps.excited_lines import excited_band, period_of, whole_periods
from identification.sweeps.local_models import (
    COEFFICIENTS,
    RESOLVED,
    SIGNIFICANT,
    TOGETHER,
    LocalFit,
    Windows,
    fit_windows,
    mistaken,
    windows_of,
)
from identification.sweeps.periodic_response import periodic_response
from identification.sweeps.response import LeftOut
from identification.sweeps.usable_lines import SweepEstimate, usable_lines

SHORTEST_WINDOW = COEFFICIENTS + 3  # three degrees of freedom left for the variance
LONG_WINDOW = 5 * SHORTEST_WINDOW  # in which a drift is told from the response
WINDOWS = 600  # aimed at; a longer record makes longer windows
HELD = 300_000  # lines that are fitted at a time
RELATIVE_WIDTH = 1 / 64  # of a window, at most, of its frequency where the shortest window allows it
BELOW_NYQUIST = 0.8  # of the Nyquist frequency: the part that analysers use; beyond, a held input's alias is as large
TRUNCATED = 2.0  # F ratio of neighbouring windows together; noise alone gives 1.0 +- 0.3
EVIDENT = 4.0  # the same, where a transient would cost most of what the windows say about the response
MATERIAL = 1e-9  # of the output's power
END, STILL = 200, 0.01  # of the samples, at each end, and motion there over that of the record: it rests
APART = 2.0  # variances with and without transient, where the two can be told apart


def estimate_response(dt: float, u: Real, y: Real, *, held: bool = False) -> SweepEstimate:
    """Estimate the response from input ``u`` to output ``y``, both (N,), sampled every ``dt`` seconds.

    Parameters
    ----------
    held
        False: both channels are band-limited alike before they are sampled, as in a signal analyser, and the ratio
        of their spectra is the continuous-time P(j omega). True: ``u`` is the command of a converter that holds
        each value until the next sample, and the ratio, the pulse transfer function, is divided by the factor
        of the hold. What stays in it besides P are the aliases, :func:`identification.model.pulse_response.aliases`.

    Raises
    ------
    InputError
        Too few lines are excited, or the output never changes.

    Notes
    -----
    First differences of both channels bring an integrator's output back to rest. Their spectra are divided by that
    of the difference again, so that white noise on the output stays white. In each window of W lines the output is
    a smooth response times the input, plus, where it explains more than noise does, a smooth transient: what
    the record cuts off at its ends. A resonance narrower than the window takes a pole, see
    :func:`identification.sweeps.local_models.fit_windows`. The response's quadratic is that of (1 - 1/z) H exp(j omega
    tau), tau the typical group delay: neither an integrator nor a long dead time bends it.

    The response is given at the three zeros of the cubic orthogonal on the window's lines: there the errors of
    a quadratic fitted by least squares are uncorrelated, so that nothing of the record is lost, and the
    cubic term leaves no bias. Windows do not overlap. An input that repeats itself is used at the harmonics of its
    period; where that is a whole number of samples, the response is the ratio of the spectra there, without windows:
    :func:`identification.sweeps.periodic_response.periodic_response`.

    Under feedback the input answers the output's noise, too: where that is not small against what the reference does,
    the response errs towards the inverse of the controller.

    A second integrator goes on drifting after the first difference: see
    :func:`identification.sweeps.drift.find_drift`. The delay is that of second differences, where its drift is
    a constant, and where (1 - 1/z)^2 H is clearly smoother, the quadratic is that one's.
    """
    if np.ptp(y) == 0:
        raise InputError("the output never changes; expected the response to a sweep")
    period = period_of(u, shortest=6 * SHORTEST_WINDOW)
    if period.is_integer() and 2 * period <= u.size:
        return _of_harmonics(dt, u, y, int(period), held=held)
    u, y, periods = whole_periods(u, y, period)
    omega: Real = 2 * np.pi * periods * np.arange(1.0, (u.size - 1) // (2 * periods)) / ((u.size - 1) * dt)
    difference = -np.expm1(-1j * omega * dt)
    big_u, big_y = (
        np.fft.rfft(np.diff(x))[periods : periods * (omega.size + 1) : periods] / difference for x in (u, y)
    )
    band = excited_band(np.abs(big_u) ** 2, smoothing=2 * SHORTEST_WINDOW + 1)
    low = band[(band + 1 < SHORTEST_WINDOW) & (big_u[band] != 0)]  # no local model holds there
    below = LeftOut(omega[low], big_y[low] / big_u[low], "closer to 0 Hz than the width of a window of lines")
    band = band[(band + 1 >= SHORTEST_WINDOW) & (not held or omega[band] < BELOW_NYQUIST * np.pi / dt)]
    if band.size < 3 * SHORTEST_WINDOW:
        raise InputError(
            f"the input excites {band.size} spectral lines; expected {3 * SHORTEST_WINDOW} or more "
            "(a longer record or a wider sweep)"
        )
    step = float(omega[1] - omega[0])
    twice_u, twice_y = (np.fft.rfft(np.diff(x, 2), u.size - 1)[periods * (band + 1)] for x in (u, y))
    tau = _group_delay(twice_u, twice_y, step)

    def bend(at: Real, poles: int) -> Complex:
        """What H is when (1 - 1/z)^poles H exp(j omega tau) is 1."""
        return np.asarray(np.exp(-1j * at * tau) / (-np.expm1(-1j * at * dt)) ** poles)

    tiles = _tiles(band, SHORTEST_WINDOW)
    looks = tiles, _tiles(band, min(LONG_WINDOW, band.size - 1))
    once, twice = (find_drift(difference, big_u * bend(omega, poles), big_y, looks, u.size) for poles in (1, 2))
    drift, poles = (twice, 2) if once.misfit - twice.misfit > SIGNIFICANT else (once, 1)
    bent = big_u * bend(omega, poles)
    groups = windows_of(tiles, bent, big_y - drift.columns @ drift.size)
    fit, rest, cut = _fit(groups, y, held=held)
    if drift.size.size and cut[0]:  # it was no drift, which is largest there, but a transient that looks like it above
        drift, groups = drift.none(), windows_of(tiles, bent, big_y)
        fit, rest, cut = _fit(groups, y, held=held)
    at_nodes: Real = np.concatenate(
        [_frequencies(omega[tile], group.nodes) for tile, group in zip(tiles, groups, strict=True)]
    )
    doubt = _doubt(groups, [drift.columns[tile] for tile in tiles], drift.covariance, cut)
    power = np.concatenate([np.mean(np.abs(group.output) ** 2, axis=1) for group in groups])
    tiny = np.finfo(float).tiny
    factor = bend(at_nodes, poles) / (hold(at_nodes, dt) if held else 1.0)
    gain = (fit.gain + doubt / (fit.noise + RESOLVED * power + tiny)[:, None]) * np.abs(factor) ** 2
    response = fit.response * factor
    alone = rest.gain * np.abs(factor) ** 2
    return usable_lines(at_nodes, response, gain, alone, fit.noise, (below,) if low.size else ())


def _of_harmonics(dt: float, u: Real, y: Real, period: int, *, held: bool) -> SweepEstimate:
    """The response at the harmonics of an input that is repeated every ``period`` samples."""
    top = (BELOW_NYQUIST if held else 1.0) * period / 2
    found = periodic_response(u, y, period, below=top)
    omega = np.asarray(2 * np.pi / (period * dt) * found.number)
    factor = hold(omega, dt) if held else np.ones(omega.size)
    gain = (found.gain / np.abs(factor) ** 2)[:, None]
    return usable_lines(omega[:, None], (found.response / factor)[:, None], gain, gain, found.noise)


def _fit(groups: Sequence[Windows], y: Real, *, held: bool) -> tuple[LocalFit, LocalFit, Flags]:
    """The windows' fit, that without transients, and in which windows (C,) the former has one."""
    truncated, rest = fit_windows(groups, transient=True), fit_windows(groups, transient=False)
    blind = not held or _still(y, float(np.median(truncated.noise)))
    cut = _needs_transient(truncated, rest, groups, blind=blind)
    return truncated.where(cut, rest), rest, cut


def _doubt(groups: Sequence[Windows], drifts: Sequence[Complex], covariance: Real, cut: Flags) -> Real:
    """Variance (C, 3) of the response at the nodes that the drift's (k, k) makes; ``cut`` (C,) have a transient."""
    parts = []
    for transient in (False, True):
        wrong = [mistaken(group, drift, transient=transient) for group, drift in zip(groups, drifts, strict=True)]
        parts.append(np.concatenate([np.einsum("cni,ij,cnj->cn", w.conj(), covariance, w).real for w in wrong]))
    return np.where(cut[:, None], parts[1], parts[0])


def _still(y: Real, noise: float) -> bool:
    """Whether the output rests at both ends of the record, but for white noise of this power density."""
    moves = np.diff(y) ** 2
    ends = max(1, moves.size // END)
    most = STILL**2 * np.mean(moves) + 2 * TRUNCATED * noise / y.size
    return bool(np.mean(moves[:ends]) < most and np.mean(moves[-ends:]) < most)


def _needs_transient(truncated: LocalFit, rest: LocalFit, groups: Sequence[Windows], *, blind: bool) -> Flags:
    """In which windows the transient explains more than noise does: F ratio of neighbouring windows together.

    What is left must also be a material part of the output's power: a local model is never quite the response.
    Windows in which response and transient can hardly be told apart follow the nearest others, where the
    evidence is strong; ``blind`` says that they have no say of their own. A transient, which is free of the input's
    noise, explains the output better there than a noisy input does. And if the record begins and ends at rest, but the
    input comes from a controller, what is as smooth as a transient is the loop's reference, a quick sweep:
    what it leaves is the inverse of the controller.
    """
    power = np.concatenate([np.sum(np.abs(group.output) ** 2, axis=1) for group in groups])
    apart = np.mean(truncated.gain, axis=1) < APART * np.mean(rest.gain, axis=1)
    needs = np.zeros(apart.size, dtype=bool)
    if apart.any():
        telling = np.flatnonzero(apart)
        ratio = _pooled_ratio(truncated, rest, power, telling)
        nearest = np.argmin(np.abs(np.arange(apart.size)[:, None] - telling), axis=1)
        needs = ratio[nearest] > np.where(apart, TRUNCATED, EVIDENT)
    if not blind:
        needs |= _pooled_ratio(truncated, rest, power, np.arange(apart.size)) > TRUNCATED
    return needs


def _pooled_ratio(truncated: LocalFit, rest: LocalFit, power: Real, windows: Whole) -> Real:
    """F ratio of ``windows`` (K,), each with its neighbours among them; 0 where nothing material is left."""
    left_with, left_without, free_with, free_without, total = (
        np.convolve(x[windows], np.ones(min(TOGETHER, windows.size)), mode="same")
        for x in (truncated.left, rest.left, truncated.freedom, rest.freedom, power)
    )
    per_coefficient = (left_without - left_with) / np.maximum(free_without - free_with, 1)
    exact = left_with <= 0
    ratio = np.where(exact, np.inf, per_coefficient * free_with / np.where(exact, 1.0, left_with))
    return np.where(left_without > MATERIAL * total, ratio, 0.0)


def _frequencies(omega: Real, nodes: Real) -> Real:
    """The nodes' frequencies (C, 3) in windows of lines ``omega`` (C, W)."""
    centre, half_width = (omega[:, -1:] + omega[:, :1]) / 2, (omega[:, -1:] - omega[:, :1]) / 2
    return np.asarray(centre + half_width * nodes)


def _tiles(band: Whole, shortest: int) -> list[Whole]:
    """The band's lines in windows of odd width, (C, W), HELD lines at most; narrower where frequencies are low."""
    widest = max(shortest, band.size // WINDOWS) // 2 * 2 + 1
    tiles, first = [], 0
    while first < band.size:
        width = min(widest, max(shortest, int(band[first] * RELATIVE_WIDTH)) // 2 * 2 + 1)
        last = width == widest
        lines = band.size - first if last else min(band.size - first, max(width, int(band[first])))
        count = lines // width
        spare = (lines - count * width) // 2 if last else 0
        if count:
            tile = band[first + spare : first + spare + count * width].reshape(count, width)
            tiles += np.array_split(tile, 1 + tile.size // HELD)
        first = band.size if last or not count else first + count * width
    return tiles


def _group_delay(u: Complex, y: Complex, step: float) -> float:
    """Median group delay in seconds from spectrum ``u`` (L,) to ``y`` on lines ``step`` rad/s apart, not negative."""
    cross = y * u.conj()
    return max(0.0, -float(np.median(np.angle(cross[1:] * cross[:-1].conj()))) / step)
