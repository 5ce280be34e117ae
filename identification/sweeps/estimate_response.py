"""Raw record of a sweep -> frequency response with the variance of each line (local models of windows of lines)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.base.arrays import Complex, Flags, Real, Whole
from identification.base.errors import InputError
from identification.model.pulse_response import hold
from identification.sweeps.excited_lines import excited_band, whole_periods
from identification.sweeps.local_models import (
    COEFFICIENTS,
    TOGETHER,
    LocalFit,
    Windows,
    fit_windows,
    pooled,
    unexplained,
)
from identification.sweeps.response import LeftOut
from identification.sweeps.usable_lines import usable_lines

SHORTEST_WINDOW = COEFFICIENTS + 3  # three degrees of freedom left for the variance
WINDOWS = 600  # aimed at; a longer record makes longer windows
HELD = 300_000  # lines that are fitted at a time
RELATIVE_WIDTH = 1 / 64  # of a window, at most, of its frequency where the shortest window allows it
BELOW_NYQUIST = 0.8  # of the Nyquist frequency: the part that analysers use; beyond, a held input's alias is as large
TRUNCATED = 2.0  # F ratio of neighbouring windows together; noise alone gives 1.0 +- 0.3
EVIDENT = 4.0  # the same, where a transient would cost most of what the windows say about the response
MATERIAL = 1e-9  # of the output's power
FEWEST = 9  # lines of a response: three windows
END, STILL = 200, 0.01  # of the samples, at each end, and motion there over that of the record: it rests
DRIFTS = 30.0  # of a line's noise: what a drift explains in all windows; one that is not there moves the lowest lines
APART = 2.0  # variances with and without transient, where the two can be told apart


@dataclass(frozen=True)
class SweepEstimate:
    """A response at M lines whose errors are independent; within a window that takes a pole they correlate by 0.3.

    Parameters
    ----------
    omega
        (M,) rad/s, increasing.
    response
        (M,) output unit per input unit.
    variance
        (M,) estimate of E|error|^2, from what the local models leave.
    excitation
        (M,) how the error's variance goes from line to line on account of the excitation alone: the variance is
        this times the power density of the noise. Its median is 1.
    left_out
        Lines that say too little about the plant, see :func:`identification.sweeps.usable_lines.usable_lines`.
    """

    omega: Real
    response: Complex
    variance: Real
    excitation: Real
    left_out: tuple[LeftOut, ...]


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
    cubic term leaves no bias. Windows do not overlap. An input that repeats itself is used at the lines of its period.

    Under feedback the input answers the output's noise, too: where that is not small against what the reference does,
    the response errs towards the inverse of the controller.

    A second integrator goes on drifting after the first difference: see :func:`_without_drift`.
    """
    if np.ptp(y) == 0:
        raise InputError("the output never changes; expected the response to a sweep")
    u, y, periods = whole_periods(u, y, shortest=6 * SHORTEST_WINDOW)
    omega: Real = 2 * np.pi * periods * np.arange(1.0, (u.size - 1) // (2 * periods)) / ((u.size - 1) * dt)
    difference = -np.expm1(-1j * omega * dt)
    big_u, big_y = (
        np.fft.rfft(np.diff(x))[periods : periods * (omega.size + 1) : periods] / difference for x in (u, y)
    )
    band = excited_band(np.abs(big_u) ** 2, smoothing=2 * SHORTEST_WINDOW + 1)
    # Nearer to zero than a window is wide no local model holds.
    band = band[(band + 1 >= SHORTEST_WINDOW) & (not held or omega[band] < BELOW_NYQUIST * np.pi / dt)]
    if band.size < 3 * SHORTEST_WINDOW:
        raise InputError(
            f"the input excites {band.size} spectral lines; expected {3 * SHORTEST_WINDOW} or more "
            "(a longer record or a wider sweep)"
        )
    step = float(omega[1] - omega[0])
    tau = _group_delay(*(np.fft.rfft(np.diff(x, 2), u.size - 1)[periods * (band + 1)] for x in (u, y)), step)

    def bend(at: Real) -> Complex:
        """What H is when (1 - 1/z)^2 H exp(j omega tau) is 1."""
        return np.asarray(np.exp(-1j * at * tau) / np.expm1(-1j * at * dt) ** 2)

    bent = big_u * bend(omega)
    tiles = _tiles(band)
    groups = [Windows(bent[tile], big_y[tile], *_places(tile.shape[1])) for tile in tiles]
    at_nodes: Real = np.concatenate(
        [_frequencies(omega[tile], group.nodes) for tile, group in zip(tiles, groups, strict=True)]
    )
    fit, alone = _without_drift(groups, [difference[tile] for tile in tiles], y, noisy_input=not held)
    factor = bend(at_nodes) / (hold(at_nodes, dt) if held else 1.0)
    gain, response = fit.gain * np.abs(factor) ** 2, fit.response * factor
    usable, left_out = usable_lines(at_nodes, response, gain, alone * np.abs(factor) ** 2, fit.noise)
    if usable.sum() < FEWEST:
        why = "; ".join(map(str, left_out))
        raise InputError(f"{usable.sum()} spectral lines tell of the plant; expected {FEWEST} or more ({why})")
    return SweepEstimate(
        omega=at_nodes[usable],
        response=response[usable],
        variance=(gain * fit.noise[:, None])[usable],
        excitation=(gain / np.median(gain[usable]))[usable],
        left_out=left_out,
    )


def _without_drift(
    groups: Sequence[Windows], differences: Sequence[Complex], y: Real, *, noisy_input: bool
) -> tuple[LocalFit, Real]:
    """The windows' fit after taking out a drift of the output that no local model sees, if there is one.

    The second is the gain (C, 3) without transient, which is the excitation's alone.

    An output whose slope differs at the record's two ends, as a double integrator's does, adds b/(1 - 1/z)^2 to its
    spectrum, and one that ends elsewhere than it began a/(1 - 1/z), with real a and b. The differences leave no
    more of the latter than the noise of two samples. Both follow from all windows together; they are
    taken out if that explains significantly more, and spares windows the transient or leaves none that needs it.
    """
    truncated, rest = fit_windows(groups, transient=True), fit_windows(groups, transient=False)
    blind = noisy_input or _still(y, float(np.median(truncated.noise)))
    cut = _needs_transient(truncated, rest, groups, blind=blind)
    chosen = truncated.where(cut, rest)
    power = np.concatenate([np.mean(np.abs(group.output) ** 2, axis=1) for group in groups])
    noise = np.maximum(pooled(chosen.noise), np.finfo(float).eps ** 2 * power) + np.finfo(float).tiny
    usable = ~truncated.resonant
    for _ in range(2):
        if not usable.any():
            return chosen, rest.gain
        weights = np.split(usable / noise, np.cumsum([len(group.input) for group in groups])[:-1])
        moved = _less_drift(groups, differences, weights, y.size / (4 * float(np.median(noise))))
        rest_moved = fit_windows(moved, transient=False)
        if np.sum((rest.left - rest_moved.left) / noise) < DRIFTS:
            return chosen, rest.gain
        usable = ~rest_moved.resonant
    truncated = fit_windows(moved, transient=True)
    cut_moved = _needs_transient(truncated, rest_moved, moved, blind=blind)
    if cut_moved.sum() < cut.sum() or not cut_moved.any():
        return truncated.where(cut_moved, rest_moved), rest_moved.gain
    return chosen, rest.gain


def _still(y: Real, noise: float) -> bool:
    """Whether the output rests at both ends of the record, but for white noise of this power density."""
    moves = np.diff(y) ** 2
    ends = max(1, moves.size // END)
    most = STILL**2 * np.mean(moves) + 2 * TRUNCATED * noise / y.size
    return bool(np.mean(moves[:ends]) < most and np.mean(moves[-ends:]) < most)


def _less_drift(
    groups: Sequence[Windows], differences: Sequence[Complex], weights: Sequence[Real], prior: float
) -> list[Windows]:
    """The windows with the likeliest a/(1 - 1/z) + b/(1 - 1/z)^2 taken off; ``prior`` is 1/(2 variance) of a."""
    information, moment = np.diag([prior, 0.0]), np.zeros(2)
    drifts = [difference[..., None] ** -np.arange(1, 3) for difference in differences]
    for group, drift, weight in zip(groups, drifts, weights, strict=True):
        left = unexplained(group, np.concatenate([drift, group.output[..., None]], axis=2))
        products = np.einsum("cwi,cwj,c->ij", left.conj(), left, weight).real
        information += products[:2, :2]
        moment += products[:2, 2]
    scale = 1 / np.sqrt(np.diag(information))
    size = scale * np.linalg.lstsq(information * scale[:, None] * scale, moment * scale, rcond=None)[0]
    return [replace(group, output=group.output - drift @ size) for group, drift in zip(groups, drifts, strict=True)]


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


def _places(width: int) -> tuple[Real, Real]:
    """Places of a window's lines, -1 to 1, and of the zeros of the cubic orthogonal on them."""
    half = width // 2
    node = np.sqrt((3 * half * (half + 1) - 1) / 5) / half
    return np.arange(-half, half + 1) / half, np.array([-node, 0.0, node])


def _tiles(band: Whole) -> list[Whole]:
    """The band's lines in windows of odd width, (C, W), HELD lines at most; narrower where frequencies are low."""
    widest = max(SHORTEST_WINDOW, band.size // WINDOWS) // 2 * 2 + 1
    tiles, first = [], 0
    while first < band.size:
        width = min(widest, max(SHORTEST_WINDOW, int(band[first] * RELATIVE_WIDTH)) // 2 * 2 + 1)
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
