"""From the parameters of one structure to first guesses for another, with roots left out or added."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from identification.base.arrays import Complex, Real
from identification.fitting.first_guess import BAND
from identification.fitting.least_squares import log_jacobian, response_of, stacked
from identification.fitting.likelihood import Likely
from identification.model.plant import INTEGRATORS
from identification.model.structure import Structure

Side = tuple[Real, Real]  # log omega and log zeta of modes (n, 2), log rates of real roots (k,)

GROWN_PLACES = 50
GROWN_ZETAS = (0.02, 0.15)
GROWN_APART = 0.5  # largest first distance between the new zero and pole, in logarithms
OUTSIDE = 2.5  # factor from the band's edge beyond which a root may be one that the plant does not have
DAMPED = np.log(0.3)  # a mode better damped than this may be a real root and one far away
GROWTH = (0, 2, 0, 2)
"""One more zero mode and pole mode."""
ALL_PASSES = ((0, 0, -1, -1), (0, 0, -2, -2))
"""Steps that take off what a dead time looks like."""
STEPS = (
    *((0, -2, 0, -2), (0, -1, 0, -1), (0, -2, 0, 0), (0, 0, 0, -2), (0, -1, 0, 0), (0, 0, 0, -1)),
    *((0, 0, -1, 0), (0, 0, -2, 0), *ALL_PASSES),
    *((-1, -1, 0, 0), (1, 0, 0, -1), (-1, 0, 0, 1), (1, 1, 0, 0), (-2, -2, 0, 0), (2, 0, 0, -2)),
    *((0, 0, 0, 1), (0, 1, 0, 0), (0, 1, 0, 1), (0, 0, 1, 0)),
)
"""Integrators, left zeros, right zeros and poles that a step adds: fewer roots, s = 0 for a slow root, more roots."""
FLIPS = ((0, -1, 1, 0), (0, -2, 2, 0), (0, 1, -1, 0), (0, 2, -2, 0))
"""Steps that mirror zeros on the imaginary axis; their number of parameters stays the same."""


def neighbours(structure: Structure) -> list[Structure]:
    """The structures one step away: those of STEPS and FLIPS, and the one without or with a dead time.

    A zero on the right and a pole may be what a dead time looks like: they may go for one. A dead time may be what a
    zero on the right looks like: one more such takes the place of all or half of it.
    """
    near = [*stepped(structure, (*STEPS, *FLIPS)), replace(structure, delayed=not structure.delayed)]
    if not structure.delayed:
        near += [replace(other, delayed=True) for other in stepped(structure, ALL_PASSES)]
    return near


def stepped(structure: Structure, steps: Sequence[tuple[int, int, int, int]]) -> list[Structure]:
    """The structures that steps such as those of STEPS lead to, as far as there are such."""
    q, (left, right, poles) = structure.integrators, structure.degrees
    near = [
        replace(structure, integrators=q + dq, zeros=left + dl, right=right + dr, poles=poles + dp)
        for dq, dl, dr, dp in steps
    ]
    return [other for other in near if other.proper and other.integrators in INTEGRATORS]


def reached_from(fit: Likely, target: Structure, omega: Real) -> list[Real]:
    """First guesses (p,) of a neighbour of ``fit.structure``, in no order."""
    sides = _sides_of(fit)
    changes = [there - here for here, there in zip(fit.structure.degrees, target.degrees, strict=True)]
    if changes[0] < 0 < changes[1]:
        found = [(left, right, sides[2]) for left, right in _mirrored(sides[0], sides[1], changes[1])]
    elif changes[1] < 0 < changes[0]:
        found = [(left, right, sides[2]) for right, left in _mirrored(sides[1], sides[0], changes[0])]
    else:
        places = [omega[0] / BAND, np.sqrt(omega[0] * omega[-1]), omega[-1] * BAND]
        lag = fit.theta[-1]
        late = [1 / lag, 2 / lag] if lag * omega[-1] * BAND > 1 else []  # zeros that lag as all or half of the delay
        lefts, poles = (_changed(sides[k], changes[k], places) for k in (0, 2))
        rights = _changed(sides[1], changes[1], [*places, *late])
        found = list(product(lefts, rights, poles))
    starts = []
    for there in found:
        delays = {fit.theta[-1]} if target.delayed else {0.0}
        if target.delayed and target.right != fit.structure.right:  # as late at low frequencies as before
            delays.add(max(0.0, fit.theta[-1] + _lag(*sides) - _lag(*there)))
        starts += [_joined(*there, delay) for delay in delays]
    return starts


def _lag(left: Side, right: Side, poles: Side) -> float:
    """The delay at low frequencies of zeros on both sides and of poles."""

    def of(side: Side) -> float:
        modes, rates = side
        return float(np.sum(2 * np.exp(modes[:, 1] - modes[:, 0])) + np.sum(np.exp(-rates)))

    return of(right) + of(poles) - of(left)


def _sides_of(fit: Likely) -> tuple[Side, Side, Side]:
    left_modes, right_modes, pole_modes, left_rates, right_rates, real_poles = fit.structure.split(fit.theta)
    return (left_modes, left_rates), (right_modes, right_rates), (pole_modes, real_poles)


def _joined(left: Side, right: Side, poles: Side, delay: float) -> Real:
    """Theta (p,) with its gain left at 0."""
    modes, rates = ([side[kind].ravel() for side in (left, right, poles)] for kind in (0, 1))
    return np.concatenate([[0.0], *modes, *rates, [delay]])


def _mirrored(source: Side, goal: Side, count: int) -> Iterator[tuple[Side, Side]]:
    """Both sides after ``count`` roots, 1 or 2, went from one to the other."""
    modes, rates = source
    if count == 2:
        for i in range(len(modes)):
            yield (np.delete(modes, i, axis=0), rates), (np.vstack([goal[0], modes[i]]), goal[1])
        return
    for i, rate in enumerate(rates):
        yield (modes, np.delete(rates, i)), _with_root(*goal, rate)
    for i, (log_omega, log_zeta) in enumerate(modes):
        if log_zeta > DAMPED:
            spread = float(np.arccosh(max(1.0, np.exp(log_zeta))))
            for shift in {-spread, spread}:
                kept = _with_root(np.delete(modes, i, axis=0), rates, log_omega - shift)
                yield kept, _with_root(*goal, log_omega + shift)


def _changed(side: Side, change: int, places: Sequence[float]) -> list[Side]:
    """The polynomials with ``change`` roots more that are worth a try; one more at each of ``places``."""
    modes, rates = side
    if change == 0:
        return [side]
    if change == -2:
        return [(np.delete(modes, i, axis=0), rates) for i in range(len(modes))]
    if change == 1:
        return [_with_root(modes, rates, float(np.log(place))) for place in places]
    found: list[Side] = [(modes, rates[:0])] if rates.size else []
    for i, (log_omega, log_zeta) in enumerate(modes):
        others = np.delete(modes, i, axis=0)
        if log_zeta > DAMPED or not found:
            spread = np.arccosh(max(1.0, np.exp(log_zeta)))  # real roots are omega exp(-+ spread)
            found += [_with_root(others, rates, log_omega + shift) for shift in {-spread, spread}]
    return found


def _with_root(modes: Real, rates: Real, place: float) -> Side:
    """One real root more at the logarithm ``place``; with another one it makes a mode of zeta >= 1."""
    if not rates.size:
        return modes, np.array([place])
    other = float(rates[0])
    mode = [(place + other) / 2, np.log(np.cosh((place - other) / 2))]
    return np.concatenate([modes, [mode]]), rates[:0]


def within_band(fit: Likely, omega: Real, reach: float) -> tuple[Structure, Real, float] | None:
    """What is left of a fit without its roots ``reach`` times outside the band: slow ones at s = 0, fast ones nothing.

    None if no root is that far, or more poles or zeros would be at s = 0 than INTEGRATORS has. Else the structure, a
    first guess (p,) and what such a root changes at a line, as a share of the response: at most about that.
    """
    low, high = np.log(omega[0] / reach), np.log(omega[-1] * reach)
    kept, slow, nearest = zip(*(_kept(side, low, high) for side in _sides_of(fit)), strict=True)
    left, right, poles = (2 * len(modes) + len(rates) for modes, rates in kept)
    integrators = fit.structure.integrators + slow[2] - slow[0] - slow[1]
    there = replace(fit.structure, integrators=integrators, zeros=left, right=right, poles=poles, real_pairs=(0, 0, 0))
    if there == fit.structure or not (there.proper and integrators in INTEGRATORS):
        return None
    left_zeros, right_zeros, left_poles = kept
    change = float(np.exp(-min(nearest))) / reach
    return there, _joined(left_zeros, right_zeros, left_poles, fit.theta[-1]), change


def _kept(side: Side, low: float, high: float) -> tuple[Side, int, float]:
    """The roots between ``low`` and ``high``, logarithms; how many lie below; how far the nearest outside lies."""
    modes, rates, slow, apart = np.zeros((0, 2)), np.zeros(0), 0, [np.inf]
    real = list(side[1])
    for log_omega, log_zeta in side[0]:
        if log_zeta > 0:
            spread = np.arccosh(np.exp(log_zeta))
            real += [log_omega - spread, log_omega + spread]
        elif low < log_omega < high:
            modes = np.vstack([modes, [log_omega, log_zeta]])
        else:
            slow += 2 * (log_omega <= low)
            apart.append(max(low - log_omega, log_omega - high))
    for place in real:
        if low < place < high:
            modes, rates = _with_root(modes, rates, place)
        else:
            slow += place <= low
            apart.append(max(low - place, place - high))
    return (modes, rates), int(slow), float(min(apart))


def has_needle(fit: Likely, omega: Real) -> bool:
    """Whether a zero mode and a pole mode, both narrower than the lines lie apart, are no further from each other.

    They change one line or two, which noise that is not Gaussian can ask for and a plant hardly.
    """
    left, right, poles = (np.exp(modes) for modes, _ in _sides_of(fit))
    zeros = np.concatenate([left, right])
    middle = (zeros[:, None, 0] + poles[None, :, 0]) / 2
    i = np.clip(np.searchsorted(omega, middle), 1, omega.size - 1)
    spacing = omega[i] - omega[i - 1]
    widths = np.maximum(zeros.prod(axis=1)[:, None], poles.prod(axis=1)[None, :])
    return bool(np.any((np.abs(zeros[:, None, 0] - poles[None, :, 0]) < spacing) & (widths < spacing)))


def cancels_origin(fit: Likely, omega: Real) -> bool:
    """Whether a zero below the lowest line hides a pole at s = 0 from all lines, or a pole there a zero at s = 0."""
    left, right, poles = _sides_of(fit)
    q = fit.structure.integrators
    against = [left, right] if q > 0 else [poles] if q < 0 else []
    return any(_kept(side, np.log(omega[0]), np.inf)[1] for side in against)


def grown(fit: Likely, omega: Real, response: Complex, sigma: Real, count: int) -> list[Real]:
    """First guesses with one more zero mode and pole mode, close together where that explains most residual.

    Notes
    -----
    A zero mode over an equal pole mode is 1. Moved apart a little, they multiply the model by 1 + d1 g1 + d2 g2
    with g the derivatives of the mode's logarithm; d is fitted to the residual for each place and damping of a grid.
    """
    value = fit.sign * response_of(fit.structure, fit.theta, omega)
    residual, model = (response - value) / sigma, value / sigma
    basis, _ = np.linalg.qr(stacked(model[:, None] * log_jacobian(fit.structure, fit.theta, omega)).T)
    places, zetas = np.meshgrid(np.geomspace(omega[0], omega[-1], GROWN_PLACES), GROWN_ZETAS)
    x = 1j * omega[:, None] / places.ravel()
    damping = 2 * zetas.ravel() * x
    factor = model[:, None] / (1 + damping + x * x)
    rows = np.stack([stacked(-(damping + 2 * x * x) * factor), stacked(damping * factor)], axis=1)
    inside = np.einsum("cim,mb->cib", rows, basis)
    gram = np.einsum("cim,cjm->cij", rows, rows) - np.einsum("cib,cjb->cij", inside, inside)
    gram += 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    seen = np.einsum("cim,m->ci", rows, residual.view(float)) - inside @ (residual.view(float) @ basis)
    apart = np.linalg.solve(gram, seen[..., None])[..., 0]
    left, right, poles = _sides_of(fit)
    starts = []
    for i in np.argsort(np.sum(seen * apart, axis=1))[::-1][:count]:
        mode = np.log([places.flat[i], zetas.flat[i]])
        half = np.clip(apart[i], -GROWN_APART, GROWN_APART) / 2
        zeros, more = np.vstack([left[0], mode + half]), np.vstack([poles[0], mode - half])
        starts.append(_joined((zeros, left[1]), right, (more, poles[1]), fit.theta[-1]))
    return starts
