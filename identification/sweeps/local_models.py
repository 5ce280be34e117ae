"""Local models of a response and a transient in windows of spectral lines: quadratics, over one pole where it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.base.arrays import Array, Complex, Flags, Real, Whole

ORDER = 2  # of the polynomials
COEFFICIENTS = 2 * (ORDER + 1)  # of the response and of the transient
TOGETHER = 9  # neighbouring windows whose noise is taken as one
SIGNIFICANT = 12.0  # of a line's noise: what a further coefficient must explain; noise alone gives 9 once in 1e4
RESOLVED = 1e-10  # of the output's power: nothing is looked for in what is less, a relative 1e-5
TURNS = 4  # of Gauss and Newton's method, from where the equation error is least
SLOWEST = 1 / (2 * np.pi)  # of the lines' spacing: a pole nearer to the axis does not decay within the record
NEAREST = 1e-12  # to zero: a denominator at a line
RANK = 1e-12  # relative size below which a direction of the columns is rounding


@dataclass(frozen=True)
class Windows:
    """C windows of W neighbouring lines each.

    Parameters
    ----------
    input, output
        (C, W) spectra.
    place
        (W,) the lines' distances from the window's centre over its half width: -1 to 1.
    nodes
        (3,) where the response is wanted, in the same unit.
    """

    input: Complex
    output: Complex
    place: Real
    nodes: Real


def windows_of(tiles: Sequence[Whole], u: Complex, y: Complex) -> list[Windows]:
    """Windows of the lines ``tiles``, each (C, W) with an odd W, of the spectra (L,) of input and output."""
    groups = []
    for tile in tiles:
        half = tile.shape[1] // 2
        node = np.sqrt((3 * half * (half + 1) - 1) / 5) / half  # of the cubic orthogonal on the lines
        groups.append(Windows(u[tile], y[tile], np.arange(-half, half + 1) / half, np.array([-node, 0.0, node])))
    return groups


@dataclass(frozen=True)
class LocalFit:
    """What a local model makes of C windows.

    Parameters
    ----------
    response
        (C, 3) at the nodes.
    gain
        (C, 3) the variance of its error over the power density of the noise.
    left
        (C,) sum of the squares that the model leaves.
    freedom
        (C,) complex degrees of freedom in it.
    resonant
        (C,) the model has a pole.
    """

    response: Complex
    gain: Real
    left: Real
    freedom: Real
    resonant: Flags

    @property
    def noise(self) -> Real:
        """(C,) estimate of the noise's power density."""
        return self.left / self.freedom

    def where(self, chosen: Flags, other: LocalFit) -> LocalFit:
        """This fit in the windows where ``chosen`` (C,) holds, the other elsewhere."""
        wide = chosen[:, None]
        return LocalFit(
            np.where(wide, self.response, other.response),
            np.where(wide, self.gain, other.gain),
            np.where(chosen, self.left, other.left),
            np.where(chosen, self.freedom, other.freedom),
            np.where(chosen, self.resonant, other.resonant),
        )


def fit_windows(groups: Sequence[Windows], *, transient: bool) -> LocalFit:
    """Fit all windows of all groups, in their order, with or without a transient.

    Parameters
    ----------
    groups
        Windows of the same number of lines each, C in all.
    transient
        Whether the record's ends are cut off.

    Notes
    -----
    In a window the output is (N(r) U + T(r))/D(r) + V, N a quadratic in the lines' place r. Smooth windows have D = 1
    and T a quadratic. Where a resonance is narrower than the window D = 1 + d r, one pole that response and
    transient share as they do in the plant, and T is a constant or linear. Each is taken where it explains
    significantly more than the one before; the pole must be stable and decay within the record.

    References
    ----------
    Pintelon, Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., section 7.2; McKelvey, Guerin,
    "Non-parametric frequency response estimation using a local rational model", SYSID 2012.
    """
    models = ((ORDER + 1, 0), (1, 1), (2, 1)) if transient else ((0, 0), (0, 1))
    best, *richer = [_joined([_fit(windows, *model) for windows in groups]) for model in models]
    noise = pooled(np.min([fit.noise for fit in (best, *richer)], axis=0))
    power = np.concatenate([np.sum(np.abs(windows.output) ** 2, axis=1) for windows in groups])
    for fit in richer:
        best = fit.where((best.left - fit.left > SIGNIFICANT * noise) & (best.left > RESOLVED * power), best)
    return best


def unexplained(windows: Windows, spectra: Complex, order: int) -> Complex:
    """What of ``spectra`` (C, W, k) is no response to the input that is a polynomial of ``order``, (C, W, k)."""
    powers = windows.place[:, None] ** np.arange(order + 1)
    q, _ = np.linalg.qr((windows.input / _level(windows.input))[..., None] * powers)
    return np.asarray(spectra - q @ (np.swapaxes(q.conj(), 1, 2) @ spectra))


def mistaken(windows: Windows, spectra: Complex, *, transient: bool) -> Complex:
    """The response (C, 3, k) at the nodes that ``spectra`` (C, W, k) in the output are mistaken for."""
    q, upper = np.linalg.qr(_columns(windows, ORDER + 1 if transient else 0))
    found = np.linalg.pinv(upper, rcond=RANK)[:, : ORDER + 1] @ (np.swapaxes(q.conj(), 1, 2) @ spectra)
    return np.asarray((windows.nodes[:, None] ** np.arange(ORDER + 1)) @ found / _level(windows.input)[..., None])


def pooled(noise: Real) -> Real:
    """Running median of ``noise`` (C,) over neighbouring windows, (C,)."""
    width = min(TOGETHER, noise.size - 1 + noise.size % 2)
    padded = np.pad(noise, width // 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=1))


def _joined(fits: Sequence[LocalFit]) -> LocalFit:
    return LocalFit(
        np.concatenate([fit.response for fit in fits]),
        np.concatenate([fit.gain for fit in fits]),
        np.concatenate([fit.left for fit in fits]),
        np.concatenate([fit.freedom for fit in fits]),
        np.concatenate([fit.resonant for fit in fits]),
    )


def _level(spectrum: Complex) -> Real:
    level = np.sqrt(np.mean(np.abs(spectrum) ** 2, axis=1))[:, None]
    return np.where(level > 0, level, 1.0)


def _columns(windows: Windows, tail: int) -> Complex:
    """What the coefficients of N and the ``tail`` ones of T multiply, (C, W, p)."""
    powers = windows.place[:, None] ** np.arange(ORDER + 1)
    columns = (windows.input / _level(windows.input))[..., None] * powers
    return np.concatenate([columns, np.broadcast_to(powers[:, :tail], (*windows.input.shape, tail))], axis=2)


def _fit(windows: Windows, tail: int, poles: int) -> LocalFit:
    """The model with ``tail`` coefficients in T and ``poles`` 0 or 1 by Gauss and Newton's method, its best turn."""
    level, scale = _level(windows.input), _level(windows.output)
    columns = _columns(windows, tail)
    output = windows.output / scale
    place, nodes = windows.place[:, None] ** np.arange(1, poles + 1), windows.nodes ** np.arange(1, poles + 1)[:, None]
    at_nodes = windows.nodes ** np.arange(ORDER + 1)[:, None]
    (count, width), inner = output.shape, columns.shape[2]
    theta = np.zeros((count, inner + poles), dtype=complex)
    model, denominator = np.zeros_like(output), np.ones_like(output)
    best: LocalFit | None = None
    for turn in range(2 + TURNS * poles):
        # The first turn has no model yet: in its place the output makes it the least squares of D Y - N U - T.
        slope = model if turn else output
        jacobian = np.concatenate([columns, -slope[..., None] * place], axis=2) / denominator[..., None]
        q, upper = np.linalg.qr(jacobian)
        inverse = np.linalg.pinv(upper, rcond=RANK)
        if turn:
            over = _apart_from_zero(1 + theta[:, inner:] @ nodes)
            response = (theta[:, : ORDER + 1] @ at_nodes) / over
            gradient = np.zeros((count, inner + poles, nodes.shape[1]), dtype=complex)
            gradient[:, : ORDER + 1] = at_nodes / over[:, None]
            gradient[:, inner:] = -response[:, None] * nodes / over[:, None]
            left = np.sum(np.abs(output - model) ** 2, axis=1)
            root = -1 / _apart_from_zero(theta[:, -1])
            decays = (root.imag * (width - 1) / 2 > SLOWEST) | (poles == 0)
            fit = LocalFit(
                response * scale / level,
                np.sum(np.abs(np.swapaxes(inverse, 1, 2) @ gradient) ** 2, axis=1) / level**2,
                np.where(decays, left * scale[:, 0] ** 2, np.inf),
                np.full(count, float(width - inner - poles)),
                np.full(count, poles > 0),
            )
            best = fit if best is None else fit.where(fit.left < best.left, best)
        theta = theta + (inverse @ (np.swapaxes(q.conj(), 1, 2) @ (output - model)[..., None]))[..., 0]
        denominator = _apart_from_zero(1 + theta[:, inner:] @ place.T)
        model = (columns @ theta[:, :inner, None])[..., 0] / denominator
    assert best is not None
    return best


def _apart_from_zero(values: Array) -> Complex:
    return np.asarray(np.where(np.abs(values) < NEAREST, NEAREST, values), dtype=complex)
