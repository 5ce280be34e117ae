"""How far a plant lies from another in units of the additive bound, by a grid, and how far one can go until it is 1."""

from __future__ import annotations

import numpy as np

from identification.base.arrays import Array
from identification.base.compiled import njit

Factors = tuple[float, float, int, Array, Array]
Changes = tuple[float, float, Array, Array]

GOLDEN = (np.sqrt(5) - 1) / 2
REFINEMENTS = 24  # cuts of an interval around a peak
NEAR = 0.8  # of the highest point, below which no peak is refined
RESOLVED = 1.0  # rad: most turn of exp(-j omega (h' - h)) between neighbours of the grid
AROUND = np.concatenate([-np.geomspace(1e2, 1e-2, 25), [0.0], np.geomspace(1e-2, 1e2, 25)])  # half widths from a mode
FIRST = 0.25  # of the changes, tried first
CLOSE = 1e-4  # how far below 1 the distance may stay
TRIES = 60


@njit(nogil=True, error_model="numpy")
def response(factors: Factors, omega: float) -> complex:
    """gain exp(-delay s)/s^integrators times every factor, at s = j omega.

    ``factors`` is (gain, delay in s, integrators, modes (m, 3), rates (r, 2)): a mode is omega, zeta, and 1 for a zero
    or -1 for a pole; a rate is a of 1 + s/a and the same sign. Integrators below 0 are zeros at s = 0.
    """
    gain, delay, integrators, modes, rates = factors
    value = complex(gain * np.cos(delay * omega), -gain * np.sin(delay * omega))
    for _ in range(integrators):
        value = complex(value.imag / omega, -value.real / omega)
    for _ in range(-integrators):
        value = complex(-value.imag * omega, value.real * omega)
    for k in range(len(modes)):
        a = omega / modes[k, 0]
        factor = complex(1.0 - a * a, 2.0 * modes[k, 1] * a)
        value = value * factor if modes[k, 2] > 0 else value / factor
    for k in range(len(rates)):
        factor = complex(1.0, omega / rates[k, 0])
        value = value * factor if rates[k, 1] > 0 else value / factor
    return value


@njit(nogil=True, error_model="numpy")
def moved(nominal: Factors, changes: Changes, t: float) -> Factors:
    """The factors with t times the changes (log gain, delay, log omega and log zeta (m, 2), log rates (r,)).

    With two integrators the last zero and the last pole, which cancel at first, make the slope of the rest at s = 0
    what it was, since no bound covers another.
    """
    gain, delay, integrators, modes, rates = nominal
    log_gain, later, log_modes, log_rates = changes
    modes, rates = modes.copy(), rates.copy()
    modes[:, :2] *= np.exp(t * log_modes)
    rates[:, 0] *= np.exp(t * log_rates)
    true = gain * np.exp(t * log_gain), max(delay + t * later, 0.0), integrators, modes, rates
    if integrators == 2:
        apart = np.arcsinh(rates[-1, 0] * (slope(nominal) - slope(true)) / 2)
        rates[-2, 0] *= np.exp(-apart)
        rates[-1, 0] *= np.exp(apart)
    return true


@njit(nogil=True, error_model="numpy")
def slope(factors: Factors) -> float:
    """d/ds of the logarithm of all but gain and integrators, at s = 0."""
    _, delay, _, modes, rates = factors
    total = -delay
    for k in range(len(modes)):
        total += modes[k, 2] * 2.0 * modes[k, 1] / modes[k, 0]
    for k in range(len(rates)):
        total += rates[k, 1] / rates[k, 0]
    return total


@njit(nogil=True, error_model="numpy")
def _bend(factors: Factors) -> float:
    """The second derivative of that logarithm at s = 0."""
    _, _, _, modes, rates = factors
    total = 0.0
    for k in range(len(modes)):
        total += modes[k, 2] * (2.0 - 4.0 * modes[k, 1] ** 2) / modes[k, 0] ** 2
    for k in range(len(rates)):
        total -= rates[k, 1] / rates[k, 0] ** 2
    return total


@njit(nogil=True, error_model="numpy")
def leading(factors: Factors) -> tuple[float, int]:
    """k and n of k/s^n exp(-delay s) as s -> infinity."""
    gain, _, degree, modes, rates = factors
    for k in range(len(modes)):
        gain *= modes[k, 0] ** (-2.0 * modes[k, 2])
        degree -= int(2 * modes[k, 2])
    for k in range(len(rates)):
        gain *= rates[k, 0] ** (-rates[k, 1])
        degree -= int(rates[k, 1])
    return gain, degree


@njit(nogil=True, error_model="numpy")
def at_the_ends(true: Factors, nominal: Factors, bound: Factors) -> float:
    """The larger of the limits of |P_true - P|/|W_a| as omega -> 0 and, the upper one, as omega -> infinity.

    With two integrators the slopes of the rest at s = 0 are taken as equal. As omega grows the dead times' difference
    turns P_true against P again and again, so that the upper limit is that of (|P_true| + |P|)/|W_a| as soon as they
    are not equal.
    """
    if nominal[2] < 0:
        low = 0.0
    elif nominal[2] == 0:
        low = abs(true[0] - nominal[0])
    elif true[0] != nominal[0]:
        low = np.inf
    elif nominal[2] == 1:
        low = abs(nominal[0] * (slope(true) - slope(nominal)))
    else:
        low = abs(nominal[0] * (_bend(true) - _bend(nominal))) / 2
    k_true, degree = leading(true)
    k, _ = leading(nominal)
    w, degree_of_bound = leading(bound)
    high = abs(k_true - k) if true[1] == nominal[1] else abs(k_true) + abs(k)
    if degree > degree_of_bound:
        high = 0.0
    elif degree < degree_of_bound and high > 0:
        high = np.inf
    return max(low / bound[0], high / w)


@njit(nogil=True, error_model="numpy")
def _ratio(true: Factors, nominal: Factors, bound: Factors, omega: float) -> float:
    return abs(response(true, omega) - response(nominal, omega)) / abs(response(bound, omega))


@njit(nogil=True, error_model="numpy")
def _refined(true: Factors, nominal: Factors, bound: Factors, omega: Array, values: Array, worst: float) -> float:
    """The highest value between the points, near whichever of them may be the highest; golden section."""
    least = NEAR * worst
    for k in range(1, len(omega) - 1):
        if not (least < values[k] < np.inf and values[k] >= values[k - 1] and values[k] >= values[k + 1]):
            continue
        left, right = omega[k - 1], omega[k + 1]
        inner, outer = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
        low, high = _ratio(true, nominal, bound, inner), _ratio(true, nominal, bound, outer)
        for _ in range(REFINEMENTS):
            if low > high:
                right, outer, high = outer, inner, low
                inner = right - GOLDEN * (right - left)
                low = _ratio(true, nominal, bound, inner)
            else:
                left, inner, low = inner, outer, high
                outer = left + GOLDEN * (right - left)
                high = _ratio(true, nominal, bound, outer)
            worst = max(worst, low, high)
    return worst


@njit(nogil=True, error_model="numpy")
def distance(
    true: Factors, nominal: Factors, bound: Factors, omega: Array, at_nominal: Array, at_bound: Array
) -> float:
    """The largest |P_true - P|/|W_a| that a grid and the refinement of its peaks find.

    How far the largest over all frequencies may lie above, :mod:`experiments.campaign.distance_certificate` proves.

    Parameters
    ----------
    true, nominal, bound
        P_true, P and W_a, see :func:`response`; the first two have as many factors.
    omega
        Shape (n,), increasing, in rad/s: a grid that resolves P and W_a and reaches far beyond them, down to where the
        rounding of P begins to show beside W_a.
    at_nominal, at_bound
        Shape (n,): P and |W_a| on it.

    Notes
    -----
    The peaks of the grid, and of points around each mode of P_true, are refined. Where the grid is too wide for the
    turn exp(-j omega (h' - h)), |P_true| + |P| stands for |P_true - P|: never less, and reached within a turn.
    """
    later = abs(true[1] - nominal[1])
    worst = at_the_ends(true, nominal, bound)
    n = len(omega)
    values = np.empty(n)
    envelope = 0.0
    for k in range(n):
        gap = omega[min(k + 1, n - 1)] - omega[k]
        at_true = response(true, omega[k])
        values[k] = abs(at_true - at_nominal[k]) / at_bound[k]
        if gap * later > RESOLVED:
            envelope = max(envelope, (abs(at_true) + abs(at_nominal[k])) / at_bound[k])
            values[k] = 0.0
    worst = max(worst, envelope, values.max())
    worst = _refined(true, nominal, bound, omega, values, worst)
    modes = true[3]
    for k in range(len(modes)):
        points = modes[k, 0] * np.exp(min(abs(modes[k, 1]), 0.1) * AROUND)
        near = np.empty(len(points))
        for i in range(len(points)):
            near[i] = _ratio(true, nominal, bound, points[i]) if points[i] >= omega[0] else 0.0
        worst = max(worst, near.max())
        worst = _refined(true, nominal, bound, points, near, worst)
    return worst


@njit(nogil=True, error_model="numpy")
def reach(
    nominal: Factors, changes: Changes, most: float, bound: Factors, omega: Array, at_nominal: Array, at_bound: Array
) -> float:
    """How many times the changes lead from P to the boundary of W_a, where the distance is 1, but at most ``most``.

    Illinois's variant of the regula falsi, from below to 1e-4 of 1; 0 where every multiple leads out of W_a.
    """
    low, below = 0.0, -1.0
    high = min(FIRST, most)
    above = distance(moved(nominal, changes, high), nominal, bound, omega, at_nominal, at_bound) - 1.0
    while above <= 0.0:
        if high >= most or above > -CLOSE:
            return high
        low, below = high, above
        high = min(2.0 * high, most)
        above = distance(moved(nominal, changes, high), nominal, bound, omega, at_nominal, at_bound) - 1.0
    side = 0
    for _ in range(TRIES):
        middle = (low + high) / 2
        if above < 1e3:
            middle = (low * above - high * below) / (above - below)
        value = distance(moved(nominal, changes, middle), nominal, bound, omega, at_nominal, at_bound) - 1.0
        if value > 0.0:
            high, above = middle, value
            if side == 1:
                below /= 2
            side = 1
        else:
            low, below = middle, value
            if value > -CLOSE:
                break
            if side == -1:
                above /= 2
            side = -1
    return low
