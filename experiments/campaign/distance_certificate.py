"""Whether a plant's distance from another stays below a level at every frequency, proved by Taylor bounds: compiled."""

from __future__ import annotations

import numpy as np

from experiments.campaign.distance import Factors, at_the_ends, leading, response
from identification.base.arrays import Array
from identification.base.compiled import njit

EPS = np.finfo(float).eps
SLACK = 1 + 1e-9  # on bounds of derivatives, whose own roundings are below 1e-11
FIRST = 1e-2  # of the slowest root, of the fastest one its inverse, where the bounds of the ends are tried first
LAST = 1e-9
DEPTH = 60  # halvings of an interval


@njit(nogil=True, error_model="numpy")
def roots_of(factors: Factors) -> tuple[Array, Array]:
    """Roots in rad/s of all modes and rates, shape (n,) complex, and 1 for a zero or -1 for a pole."""
    modes, rates = factors[3], factors[4]
    roots, signs = np.empty(2 * len(modes) + len(rates), np.complex128), np.empty(2 * len(modes) + len(rates))
    for k in range(len(modes)):
        omega, zeta = modes[k, 0], modes[k, 1]
        part = np.copysign(1.0, zeta) * np.sqrt(complex(zeta * zeta - 1.0, 0.0))
        roots[2 * k] = -omega * (zeta + part)
        roots[2 * k + 1] = -omega / (zeta + part)
        signs[2 * k : 2 * k + 2] = modes[k, 2]
    for k in range(len(rates)):
        roots[2 * len(modes) + k] = complex(-rates[k, 0], 0.0)
        signs[2 * len(modes) + k] = rates[k, 1]
    return roots, signs


@njit(nogil=True, error_model="numpy")
def _logarithm(roots: Array, signs: Array, c: float, h: float) -> tuple[complex, complex, float, float]:
    """The logarithm of prod (j omega - root)^sign: its derivatives at c, and what is uncertain.

    Parameters
    ----------
    roots, signs
        Shape (n,), see :func:`roots_of`.
    c, h
        Center and half width of an interval of omega, in rad/s.

    Returns
    -------
    complex, complex
        The first and the second derivative with respect to omega.
    float
        A bound of the modulus of the third within the interval; infinite where the interval is too wide for one.
    float
        A bound of the relative rounding of the product, and of the first derivative times h. A root is known to EPS of
        itself; that and 4 EPS of arithmetic count four times.
    """
    first, second, third, doubt = 0j, 0j, 0.0, 0.0
    for k in range(len(roots)):
        away = complex(-roots[k].real, c - roots[k].imag)
        size, off = abs(away), 4 * EPS * abs(roots[k])
        near = size * (1 - 1e-12) - off - h
        if near <= 0.0:
            return first, second, np.inf, np.inf
        u = 1j / away
        first += signs[k] * u
        second -= signs[k] * u * u
        third += 2.0 / (near * near * near)
        doubt += 16 * EPS + 4 * off / size
    return first, second, third, doubt


@njit(nogil=True, error_model="numpy")
def _largest(
    models: tuple[Factors, Factors, Factors],
    over: tuple[Array, Array],
    change: tuple[Array, Array],
    c: float,
    h: float,
) -> float:
    """A bound of |P_true - P|/|W_a| for c - h <= omega <= c + h, infinite where h is too wide for one.

    With R = P/W_a and P_true/P = exp(L), both without P's own dead time, g = R (exp(L) - 1) has

        |g''| <= |R| (|exp(L) - 1| |q^2 + q'| + |exp(L)| |2 q L' + L'^2 + L''|),    q = (log R)'.

    |g| is at most |g(c) + g'(c) (omega - c)| + h^2/2 max |g''|, which is largest at an end, or |R| (|exp(L)| + 1).
    """
    true, nominal, bound = models
    later = true[1] - nominal[1]
    q, dq, ddq, doubt = _logarithm(over[0], over[1], c, h)
    L, dL, ddL, rounding = _logarithm(change[0], change[1], c, h)
    if not (ddq < np.inf and ddL < np.inf):
        return np.inf
    n = nominal[2]
    if n:
        near = c * (1 - 1e-12) - h
        if near <= 0.0:
            return np.inf
        q, dq, ddq = q - n / c, dq + n / (c * c), ddq + 2.0 * abs(n) / near**3
    L -= 1j * later
    # the responses without dead time: that of P turns P_true and P alike
    plain = (nominal[0], 0.0, nominal[2], nominal[3], nominal[4])
    moved = (true[0], later, true[2], true[3], true[4])
    at_plain = response(plain, c)
    R, E = at_plain / response(bound, c), response(moved, c) / at_plain
    g, dg = R * (E - 1.0), R * (q * (E - 1.0) + L * E)
    most_dq, most_dL = abs(dq) + h * ddq, abs(dL) + h * ddL
    most_q, most_L = abs(q) + h * most_dq, abs(L) + h * most_dL
    r, e = abs(R) * np.exp(h * most_q), abs(E) * np.exp(h * most_L)
    m = abs(E - 1.0) + e * h * most_L
    bend = r * (m * (most_q**2 + most_dq) + e * (2.0 * most_q * most_L + most_L**2 + most_dL))
    error = (doubt + 2 * rounding + 16 * EPS + 2 * EPS * abs(later) * c) * abs(R) * (abs(E) + 1.0)
    direct = max(abs(g - h * dg), abs(g + h * dg)) * SLACK + bend * h * h / 2 * SLACK + error
    radial_q, radial_e = abs(q.real) + h / 2 * most_dq, abs(L.real) + h / 2 * most_dL
    apart = abs(R) * np.exp(h * radial_q) * (abs(E) * np.exp(h * radial_e) + 1.0) * SLACK + error
    return min(direct, apart)


@njit(nogil=True, error_model="numpy")
def _far(models: tuple[Factors, Factors, Factors], roots: tuple[Array, Array, Array], omega: float) -> float:
    """A bound of |P_true - P|/|W_a| for all frequencies above ``omega``.

    With x = |root/s| < 1, |log(1 - root/s)| <= x/(1 - x); of a conjugate pair and of a real root the real part lacks
    the first order and is at most x^2/(2 (1 - x)) each.
    """
    true, nominal, bound = models
    same = true[1] == nominal[1]
    sums = np.zeros(3)
    for i in range(3):
        for root in roots[i]:
            x = abs(root) / omega * SLACK
            if x >= 1.0:
                return np.inf
            sums[i] += (x if same and i < 2 else x * x / 2) / (1.0 - x)
    k_true, degree = leading(true)
    k, _ = leading(nominal)
    w, degree_of_bound = leading(bound)
    if degree < degree_of_bound:
        return np.inf
    off = abs(k_true) * np.expm1(sums[0]) + abs(k) * np.expm1(sums[1])
    apart = abs(k_true - k) if same else abs(k_true) + abs(k)
    return (apart + off) / abs(w) * np.exp(sums[2]) * omega ** float(degree_of_bound - degree) * SLACK


@njit(nogil=True, error_model="numpy")
def _near(
    models: tuple[Factors, Factors, Factors],
    over: tuple[Array, Array],
    change: tuple[Array, Array],
    omega: float,
) -> float:
    """A bound of |P_true - P|/|W_a| for all frequencies below ``omega``.

    L = log(P_true/P) less its value at 0 begins with an imaginary and a real term: |L| is at most omega times the
    modulus of L'(0) + omega/2 L''(0), and omega^3/6 times the largest third derivative, to which a root a of P_true and
    the same one b of P add at most 6 |a - b|/(the nearer one's distance)^4. For |P/W_a| see :func:`_far`.

    With two integrators L'(0) is 0: the real part of L is at most omega^2/2 |L''(0)| and omega^4/24 times the largest
    fourth derivative, the imaginary one at most omega^3/6 times the largest third.
    """
    true, nominal, bound = models
    sums = inverse = squares = third = fourth = 0.0
    for root in over[0]:
        x = omega / abs(root) * SLACK
        if x >= 1.0:
            return np.inf
        sums += x * x / 2 / (1.0 - x)
    for root in change[0]:
        inverse += 1.0 / abs(root)
        squares += 1.0 / abs(root) ** 2
    count = len(change[0]) // 2
    for k in range(count):
        a, b = change[0][k], change[0][count + k]
        near = min(abs(a), abs(b)) * (1 - 1e-12) - omega
        if near <= 0.0:
            return np.inf
        apart = abs(a - b) + 4 * EPS * (abs(a) + abs(b))
        third += 6.0 * apart / near**4
        fourth += 24.0 * apart / near**5
    first, second, _, _ = _logarithm(change[0], change[1], 0.0, omega)
    later = true[1] - nominal[1]
    rate = np.hypot(abs(first - 1j * later), omega / 2 * abs(second)) + omega * omega / 6 * third
    rate = (rate + 16 * EPS * (inverse + true[1] + nominal[1])) * SLACK
    size = abs(nominal[0]) / bound[0] * np.exp(sums) * SLACK
    if nominal[2] <= 0:
        ratio = true[0] / nominal[0]
        return size * omega ** float(-nominal[2]) * (abs(ratio - 1.0) + abs(ratio) * np.expm1(omega * rate))
    if true[0] != nominal[0]:
        return np.inf
    if nominal[2] == 2:
        level = abs(second) / 2 + 16 * EPS * squares + omega**2 / 24 * fourth
        rate = np.hypot(level, omega / 6 * third) * SLACK
        return size * rate * np.exp(omega * omega * rate)
    return size * rate * np.exp(omega * rate)


@njit(nogil=True, error_model="numpy")
def stays_below(true: Factors, nominal: Factors, bound: Factors, level: float) -> bool:
    """Whether |P_true - P|/|W_a| is proved to be at most ``level`` at every frequency.

    Parameters
    ----------
    true, nominal, bound
        P_true, P and W_a, see :func:`experiments.campaign.distance.response`. P_true has as many integrators as P, and
        its factors in the same order. With two integrators the slopes of the rest at s = 0 are taken as equal, which
        they are but for a rounding.
    level
        True is a proof, with the roundings of double precision bounded; False is none: where the largest ratio lies
        within some 1e-6 of the level, or the bound falls faster than the plants, nothing is proved.

    Notes
    -----
    Below and above all roots the models' expansions bound the ratio. In between an interval is halved until the bound
    of :func:`_largest` is at most the level.
    """
    if not at_the_ends(true, nominal, bound) < level:
        return False
    (a, a_signs), (b, b_signs), (w, w_signs) = roots_of(true), roots_of(nominal), roots_of(bound)
    over = np.concatenate((b, w)), np.concatenate((b_signs, -w_signs))
    change = np.concatenate((a, b)), np.concatenate((a_signs, -b_signs))
    everything = np.abs(np.concatenate((a, b, w)))
    models = true, nominal, bound
    share = FIRST
    while not _near(models, over, change, share * everything.min()) <= level:
        share /= 2.0
        if share < LAST:
            return False
    low, share = share * everything.min(), FIRST
    while not _far(models, (a, b, w), everything.max() / share) <= level:
        share /= 4.0
        if share < LAST:
            return False
    high = everything.max() / share
    while low < high:
        right = min(2.0 * low, high)
        stack = [(low, right, 0)]
        low = right
        while stack:
            left, right, depth = stack.pop()
            c, h = (left + right) / 2, (right - left) / 2 * SLACK
            if not _largest(models, over, change, c, h) <= level:
                if depth >= DEPTH or left == right:
                    return False
                stack.append((c, right, depth + 1))
                stack.append((left, c, depth + 1))
    return True
