"""|W_a| of order n over the logarithms of its numbers, and these numbers from the roots of |W_a|^2."""

from __future__ import annotations

import numpy as np

from identification.base.arrays import Complex, Real
from identification.model.additive_bound import AdditiveBound
from identification.model.modes import Mode

OUTSIDE = 10.0  # poles and zeros lie up to this factor outside the band
NEARBY = 3.0  # and none of them far outside without need
DAMPING = 1e-3  # least of modes; the most is that of two real roots as far apart as frequencies go
REAL = 1e-7  # relative imaginary part below which a root counts as real


class Shape:
    """log |W_a| over theta (2n,), the logarithms of: gain; omega and zeta of each mode, rate; zeros before poles.

    Where nothing was measured no mode has a resonance or a notch: zeta^2 + r^2 >= 1, where r < 1 is the ratio of its
    frequency and the nearer edge of the band. Above the band its magnitude then has no extremum, and below it none
    that rises or falls faster than in proportion to omega.

    Parameters
    ----------
    order
        n, the number of poles; there are n - 1 zeros.
    low, high
        The band's edges in rad/s.

    Attributes
    ----------
    bounds
        (2n, 2) least and largest of each theta; the gain has none.
    """

    def __init__(self, order: int, low: float, high: float) -> None:
        self.band = low, high
        self.frequencies = low / OUTSIDE, high * OUTSIDE
        dampings = DAMPING, OUTSIDE * np.sqrt(high / low) / 2
        self.counts = ((order - 1) // 2, (order - 1) % 2), (order // 2, order % 2)
        rows = [(0.0, np.inf)]
        for modes, reals in self.counts:
            rows += [self.frequencies, dampings] * modes + [self.frequencies] * reals
        with np.errstate(divide="ignore"):
            self.bounds = np.log(rows)
        (zero_modes, real_zeros), (pole_modes, _) = self.counts
        poles = 1 + 2 * zero_modes + real_zeros
        self._modes = np.append(1 + 2 * np.arange(zero_modes), poles + 2 * np.arange(pole_modes))

    def damped(self, theta: Real) -> Real:
        """Theta within its bounds, with the damping of modes outside the band raised to what they have to have."""
        theta = np.clip(theta, *self.bounds.T)
        omega = np.exp(theta[self._modes])
        near = np.minimum(1.0, np.minimum(omega / self.band[0], self.band[1] / omega))
        with np.errstate(divide="ignore"):
            theta[self._modes + 1] = np.maximum(theta[self._modes + 1], np.log1p(-(near**2)) / 2)
        return theta

    def damping(self, theta: Real) -> tuple[Real, Real]:
        """log(zeta^2 + r^2) (2m,) of the m modes for both edges, none of which may be negative, and (2m, 2n) slopes."""
        low, high = np.log(self.band)
        loss, values, slopes = 2 * theta[self._modes + 1], [], []
        for sign, edge in ((1, low), (-1, high)):
            near = sign * 2 * (theta[self._modes] - edge)
            value, slope = np.logaddexp(loss, near), np.zeros((self._modes.size, theta.size))
            rows = np.arange(self._modes.size)
            slope[rows, self._modes] = sign * 2 * np.exp(near - value)
            slope[rows, self._modes + 1] = 2 * np.exp(loss - value)
            values.append(value)
            slopes.append(slope)
        return np.concatenate(values), np.vstack(slopes)

    def log(self, theta: Real, omega: Real) -> Real:
        """log |W_a| (M,) at omega (M,) in rad/s."""
        return np.asarray(theta[0] + sum(sign * np.log(square) / 2 for sign, square, _ in self._factors(theta, omega)))

    def slope(self, theta: Real, omega: Real) -> Real:
        """(M, 2n) derivatives of :meth:`log`."""
        columns = [np.ones(omega.size)]
        for sign, square, slopes in self._factors(theta, omega):
            columns += [sign * slope / (2 * square) for slope in slopes]
        return np.column_stack(columns)

    def _factors(self, theta: Real, omega: Real) -> list[tuple[int, Real, list[Real]]]:
        """Sign, squared magnitude and its derivatives, of each factor."""
        values, found = iter(np.exp(theta[1:])), []
        for sign, (modes, reals) in zip((1, -1), self.counts, strict=True):
            for _ in range(modes):
                u, loss = np.square(omega / next(values)), 4 * next(values) ** 2
                slopes = [2 * u * (2 * (1 - u) - loss), 2 * loss * u]
                found.append((sign, (1 - u) ** 2 + loss * u, slopes))
            for _ in range(reals):
                u = np.square(omega / next(values))
                found.append((sign, 1 + u, [-2 * u]))
        return found

    def distance(self, theta: Real) -> tuple[float, Real]:
        """How far roots lie more than NEARBY outside the band, squares of logarithms summed, and its slope (2n,)."""
        low, high = np.log(self.band) + np.log([1 / NEARBY, NEARBY])
        split = np.zeros(theta.size)
        split[self._modes] = np.arcsinh(np.exp(theta[self._modes + 1]))  # that of two real roots, nearly
        rates = np.setdiff1d(np.arange(1, theta.size), self._modes + 1)
        slow, fast = (theta + sign * split for sign in (-1, 1))
        under, over = np.maximum(low - slow[rates], 0.0), np.maximum(fast[rates] - high, 0.0)
        slope = np.zeros(theta.size)
        slope[rates] = 2 * (over - under)
        each = np.zeros(theta.size)
        each[rates] = 2 * (over + under)
        slope[self._modes + 1] = each[self._modes] * np.tanh(split[self._modes])
        return float(under @ under + over @ over), slope

    def bound(self, theta: Real, frequency: float = 1.0, level: float = 1.0) -> AdditiveBound:
        """W_a itself, of theta in these units."""
        values = iter(np.exp(theta).tolist())
        gain = next(values)
        sides = []
        for modes, reals in self.counts:
            pairs = tuple(Mode(frequency * next(values), next(values)) for _ in range(modes))
            sides.append((pairs, tuple(frequency * next(values) for _ in range(reals))))
        (zero_modes, real_zeros), (pole_modes, real_poles) = sides
        return AdditiveBound(level * gain, zero_modes, pole_modes, real_zeros, real_poles)

    def parameters(self, zeros: Complex, poles: Complex) -> Real:
        """Theta (2n,) of gain 1 from the roots (n - 1,) and (n,) of |W_a|^2 in omega^2, (rad/s)^2."""
        values = [1.0]
        for roots, (modes, _) in zip((zeros, poles), self.counts, strict=True):
            pairs, rates = self._stable(roots, modes)
            values += [number for pair in pairs for number in pair] + rates
        return np.log(values)

    def _stable(self, roots: Complex, modes: int) -> tuple[list[tuple[float, float]], list[float]]:
        """(omega, zeta) of ``modes`` modes, and rates, of the left half plane's square roots of -roots.

        A positive root lies on the axis, where the magnitude just touches zero: with its neighbour it is an
        undamped mode; one that is left over is at zero or infinity.
        """
        low, high = self.frequencies
        real = ~(np.abs(roots.imag) > REAL * np.abs(roots))
        pairs = [(abs(s), s.real / abs(s)) for s in np.sqrt(-roots[~real & (roots.imag > 0)])]
        distance = np.sqrt(np.abs(roots[real]))
        touching = (roots[real].real > 0) & (distance > low) & (distance < high)
        undamped, rates = sorted(distance[touching]), list(np.clip(distance[~touching], low, high))
        if len(undamped) % 2:
            rates.append(undamped.pop(0 if undamped[0] / low < high / undamped[-1] else -1))
        pairs += [(np.sqrt(a * b), DAMPING) for a, b in zip(undamped[::2], undamped[1::2], strict=True)]
        rates.sort()
        while len(pairs) < modes:
            i = int(np.argmin(np.diff(np.log(rates))))
            a, b = rates.pop(i), rates.pop(i)
            pairs.append((np.sqrt(a * b), (a + b) / (2 * np.sqrt(a * b))))
        return pairs, rates
