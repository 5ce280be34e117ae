"""From the parameters of one structure to first guesses for another, with roots left out or added."""

from __future__ import annotations

from itertools import product

import numpy as np

from identification.base.arrays import Complex, Real
from identification.fitting.first_guess import BAND
from identification.fitting.least_squares import log_jacobian, response_of, stacked
from identification.fitting.likelihood import Likely
from identification.model.structure import Structure

Side = tuple[Real, Real]  # log omega and log zeta of modes (n, 2), log rates of real roots (0 or 1,)

GROWN_PLACES = 50
GROWN_ZETAS = (0.02, 0.15)
GROWN_APART = 0.5  # largest first distance between the new zero and pole, in logarithms
OUTSIDE = 2.5  # factor from the band's edge beyond which a root may be one that the plant does not have
DAMPED = np.log(0.3)  # a mode better damped than this may be a real root and one far away


def neighbours(structure: Structure) -> list[Structure]:
    """The structures one step away: fewer roots, an integrator for a slow root or the reverse, more roots."""
    steps = [
        *((0, -2, -2), (0, -1, -1), (0, -2, 0), (0, 0, -2), (0, -1, 0), (0, 0, -1)),
        *((-1, -1, 0), (1, 0, -1), (-1, 0, 1), (1, 1, 0)),
        *((0, 0, 1), (0, 1, 0), (0, 1, 1)),
    ]
    q, m, n = structure.integrators, structure.zeros, structure.poles
    near = [Structure(q + dq, m + dm, n + dn) for dq, dm, dn in steps]
    return [other for other in near if other.proper and 0 <= other.integrators <= 2]


def reached_from(fit: Likely, target: Structure, omega: Real) -> list[Real]:
    """First guesses (p,) of a neighbour of ``fit.structure``, in no order."""
    zero_modes, pole_modes, real_zeros, real_poles = fit.structure.split(fit.theta)
    zeros = _sides((zero_modes, real_zeros), target.zeros - fit.structure.zeros, omega)
    poles = _sides((pole_modes, real_poles), target.poles - fit.structure.poles, omega)
    return [
        np.concatenate([[0.0], z[0].ravel(), p[0].ravel(), z[1], p[1], fit.theta[-1:]])
        for z, p in product(zeros, poles)
    ]


def _sides(side: Side, change: int, omega: Real) -> list[Side]:
    """The polynomials with ``change`` roots more that are worth a try."""
    modes, rates = side
    if change == 0:
        return [side]
    if change == -2:
        return [(np.delete(modes, i, axis=0), rates) for i in range(len(modes))]
    if change == 1:
        places = np.log([omega[0] / BAND, np.sqrt(omega[0] * omega[-1]), omega[-1] * BAND])
        return [_with_root(modes, rates, place) for place in places]
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


def within_band(fit: Likely, omega: Real) -> tuple[Structure, Real] | None:
    """What is left of a fit without its roots far outside the band: slow poles are integrators, fast roots are nothing.

    None if no root is that far, or integrators would be fewer than 0 or more than 2.
    """
    zero_modes, pole_modes, real_zeros, real_poles = fit.structure.split(fit.theta)
    low, high = np.log(omega[0] / OUTSIDE), np.log(omega[-1] * OUTSIDE)
    zeros, slow_zeros = _kept((zero_modes, real_zeros), low, high)
    poles, slow_poles = _kept((pole_modes, real_poles), low, high)
    counts = [2 * len(modes) + len(rates) for modes, rates in (zeros, poles)]
    left = Structure(fit.structure.integrators + slow_poles - slow_zeros, *counts)
    if left == fit.structure or not (left.proper and 0 <= left.integrators <= 2):
        return None
    return left, np.concatenate([[0.0], zeros[0].ravel(), poles[0].ravel(), zeros[1], poles[1], fit.theta[-1:]])


def _kept(side: Side, low: float, high: float) -> tuple[Side, int]:
    """The roots between ``low`` and ``high``, logarithms, and how many lie below."""
    modes, rates, slow = np.zeros((0, 2)), np.zeros(0), 0
    real = list(side[1])
    for log_omega, log_zeta in side[0]:
        if log_zeta > 0:
            spread = np.arccosh(np.exp(log_zeta))
            real += [log_omega - spread, log_omega + spread]
        elif low < log_omega < high:
            modes = np.vstack([modes, [log_omega, log_zeta]])
        else:
            slow += 2 * (log_omega <= low)
    for place in real:
        if low < place < high:
            modes, rates = _with_root(modes, rates, place)
        else:
            slow += place <= low
    return (modes, rates), int(slow)


def has_needle(fit: Likely, omega: Real) -> bool:
    """Whether a zero mode and a pole mode, both narrower than the lines lie apart, are no further from each other.

    They change one line or two, which noise that is not Gaussian can ask for and a plant hardly.
    """
    zeros, poles, _, _ = (np.exp(logs) for logs in fit.structure.split(fit.theta))
    middle = (zeros[:, None, 0] + poles[None, :, 0]) / 2
    i = np.clip(np.searchsorted(omega, middle), 1, omega.size - 1)
    spacing = omega[i] - omega[i - 1]
    widths = np.maximum(zeros.prod(axis=1)[:, None], poles.prod(axis=1)[None, :])
    return bool(np.any((np.abs(zeros[:, None, 0] - poles[None, :, 0]) < spacing) & (widths < spacing)))


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
    zero_modes, pole_modes, real_zeros, real_poles = fit.structure.split(fit.theta)
    starts = []
    for i in np.argsort(np.sum(seen * apart, axis=1))[::-1][:count]:
        mode = np.log([places.flat[i], zetas.flat[i]])
        half = np.clip(apart[i], -GROWN_APART, GROWN_APART) / 2
        zeros, poles = np.vstack([zero_modes, mode + half]), np.vstack([pole_modes, mode - half])
        starts.append(
            np.concatenate([fit.theta[:1], zeros.ravel(), poles.ravel(), real_zeros, real_poles, fit.theta[-1:]])
        )
    return starts
