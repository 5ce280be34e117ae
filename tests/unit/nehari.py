"""The optimum of (2.8) by another method, which shares nothing with Pick's matrix: Nehari's theorem by FFT.

With T = 1 - S the norm is at most gamma where |T - T0| <= R at every frequency,

    T0 = |W1|^2/D,  R^2 = (gamma^2 - |W1 W2|^2/D)/D,  D = |W1|^2 + |W2|^2,

and T is what a stabilising controller can make it when it is stable, 0 at the unstable zeros of G and 1 at its
unstable poles: T = B_z G_o (p + B_p Q), with B_z and B_p the Blaschke products of these zeros and poles, G_o the
outer factor of G, p an interpolant at the poles and Q any stable function. So gamma is feasible when a stable
function is within 1 of f = (B_z G_o p - T0)/(B_z B_p R_o), R_o the outer factor of R, and Nehari's theorem says
that the least distance is the norm of f's Hankel matrix (B. A. Francis, A Course in H-infinity Control Theory,
Springer 1987, chapters 5 and 8). The half plane is mapped to the disc by z = (s - a)/(s + a), where the Fourier
coefficients of f are had by FFT.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np
from scipy.optimize import brentq
from scipy.sparse.linalg import LinearOperator, eigsh

from design.blocks.block import Block, geometric_scale


def nehari_optimum(G: Block, W1: Block, W2: Block, a: float, points: int) -> float:
    """inf || [W1 S; W2 T] ||_inf over the stabilising controllers.

    Parameters
    ----------
    G
        Without poles on the axis and with simple unstable poles; W2 G is biproper.
    W1, W2
        Weights, W1 proper.
    a
        Centre of the map in rad/s: the frequencies around it are sampled most densely.
    points
        On the circle, even; the error falls with their number until it is rounding.
    """
    theta = 2 * np.pi * (np.arange(points) + 0.5) / points
    s = 1j * a / np.tan(theta / 2)
    outer = Block(G.gain, *(tuple(_mirrored(root) for root in roots) for roots in (G.zeros, G.poles)))
    zeros, poles = (_blaschke(roots) for roots in (G.zeros, G.poles))
    first, second = np.abs((W1 * G)(s)) ** 2, np.abs((W2 * G)(s)) ** 2  # D |G|^2, biproper
    lower_squared = first * second / np.abs(G(s)) ** 2 / (first + second)
    unstable = np.array(poles.zeros)
    p = _interpolant((unstable - a) / (unstable + a), 1 / (zeros(unstable) * outer(unstable)), np.exp(1j * theta))
    centre = first / (first + second) / outer(s) / zeros(s)

    def distance(gamma: float) -> float:
        radius = np.sqrt((gamma**2 - lower_squared) / (first + second))  # R/|G|
        return _hankel_norm((p - centre) / poles(s) / _outer(radius))

    low = float(np.sqrt(lower_squared.max())) * (1 + 1e-6)
    high = 2 * low
    while distance(high) > 1:
        high *= 2
    return low if distance(low) < 1 else float(brentq(lambda gamma: distance(gamma) - 1, low, high, rtol=1e-8))


def _mirrored(root: complex) -> complex:
    return complex(-abs(root.real), root.imag)


def _blaschke(roots: tuple[complex, ...]) -> Block:
    unstable = tuple(root for root in roots if root.real > 0)
    return Block(1.0, unstable, tuple(_mirrored(root) for root in unstable))


def _interpolant(at: np.ndarray, values: np.ndarray, z: np.ndarray) -> np.ndarray:
    """The polynomial of least degree through these values; 0 when there are none."""
    if not len(at):
        return np.zeros_like(z)
    return np.polyval(np.linalg.solve(np.vander(at), values), z)


def _coefficients(samples: np.ndarray) -> np.ndarray:
    """Fourier coefficients 0, 1, ..., -2, -1 of samples half a step off the grid; real, as are all functions here."""
    n = np.fft.fftfreq(len(samples), 1 / len(samples))
    return np.real(np.fft.fft(samples) / len(samples) * np.exp(-1j * np.pi * n / len(samples)))


def _outer(magnitude: np.ndarray) -> np.ndarray:
    """The stable function with stable inverse of this magnitude on the circle, sampled there."""
    count = len(magnitude)
    cepstrum = _coefficients(np.log(magnitude))
    cepstrum[1 : count // 2] *= 2
    cepstrum[count // 2 :] = 0
    return np.exp(np.fft.ifft(cepstrum * np.exp(1j * np.pi * np.arange(count) / count)) * count)


def _hankel_norm(samples: np.ndarray) -> float:
    """Norm of the matrix of the coefficients -(j + k + 1), j and k = 0, 1, ..., multiplied by FFT."""
    size = len(samples) // 4
    past = np.fft.rfft(_coefficients(samples)[::-1][: 2 * size], 4 * size)

    def multiply(x: np.ndarray) -> np.ndarray:
        return np.fft.irfft(past * np.fft.rfft(x[::-1], 4 * size))[size - 1 : 2 * size - 1]

    operator = LinearOperator((size, size), matvec=lambda x: multiply(x.ravel()), dtype=float)
    start = np.ones(size)
    return float(np.abs(eigsh(operator, k=1, which="LM", v0=start, tol=1e-10, return_eigenvectors=False)[0]))


def nehari_excess(W1: Block, W2: Block, gamma: float, digits: int) -> float:
    """The Hankel norm less 1 at gamma, to so many digits: positive where no stabilising controller reaches gamma.

    Parameters
    ----------
    W1, W2
        Weights without common roots, whose |W1|^2 + |W2|^2 has simple zeros; G, which is not asked for, has neither
        poles nor zeros right of the axis.
    gamma
        Above what the weights alone cost.
    digits
        Of the arithmetic.

    Notes
    -----
    f has the simple poles s_k right of the axis, the roots of D |d_1 d_2|^2. Its part there, sum r_k/(s - s_k), has the
    Hankel norm lambda_max(P Q)^(1/2) with P_kl = 1/(s_k + conj(s_l)) and Q_kl = conj(r_k) r_l/(conj(s_k) + s_l).
    """
    with mp.workdps(digits):
        unit = mp.mpf(geometric_scale(W1, W2))
        (n1, d1), (n2, d2) = ((_polynomial(W, W.zeros, unit), _polynomial(None, W.poles, unit)) for W in (W1, W2))
        delta_squared = _plus(_times(_modulus(n1), _modulus(d2)), _times(_modulus(n2), _modulus(d1)))
        nu_squared = _plus(
            [mp.mpf(gamma) ** 2 * c for c in delta_squared], [-c for c in _times(_modulus(n1), _modulus(n2))]
        )
        (delta, _), (nu, nu_gain) = _right_roots(delta_squared), _right_roots(nu_squared)
        points = list(delta)
        residues = []
        for k, s in enumerate(points):
            outer = mp.fprod((s + z) / (s - z) for j, z in enumerate(points) if j != k) * 2 * s
            value = mp.polyval(_modulus_in_s(n1), s) * mp.polyval(d2, -s) / mp.polyval(d1, s)
            residues.append((-1) ** len(points) * value * outer / (nu_gain * mp.fprod(s + z for z in nu)))
        count = len(points)
        P = mp.matrix(count, count)
        Q = mp.matrix(count, count)
        for k in range(count):
            for j in range(count):
                P[k, j] = 1 / (points[k] + mp.conj(points[j]))
                Q[k, j] = mp.conj(residues[k]) * residues[j] / (mp.conj(points[k]) + points[j])
        values = mp.eig(P * Q, left=False, right=False)
        return float(mp.sqrt(max(mp.re(value) for value in values)) - 1)


def _polynomial(W: Block | None, roots: tuple[complex, ...], unit: mp.mpf) -> list[mp.mpf]:
    """Real coefficients in s/unit, highest power first."""
    result = [mp.mpc(1) if W is None else W.gain * unit**-W.relative_degree]
    for root in roots:
        result = _times(result, [mp.mpf(1), -mp.mpc(root) / unit])
    return [mp.re(c) for c in result]


def _times(first: list[mp.mpf], second: list[mp.mpf]) -> list[mp.mpf]:
    result = [mp.mpf(0)] * (len(first) + len(second) - 1)
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            result[i + j] += a * b
    return result


def _plus(first: list[mp.mpf], second: list[mp.mpf]) -> list[mp.mpf]:
    length = max(len(first), len(second))
    pad = [[mp.mpf(0)] * (length - len(part)) + part for part in (first, second)]
    return [a + b for a, b in zip(*pad, strict=True)]


def _modulus_in_s(p: list[mp.mpf]) -> list[mp.mpf]:
    """p(s) p(-s)."""
    return _times(p, [c * (-1) ** (len(p) - 1 - k) for k, c in enumerate(p)])


def _modulus(p: list[mp.mpf]) -> list[mp.mpf]:
    """p(s) p(-s) as a polynomial in s^2."""
    return _modulus_in_s(p)[::2]


def _right_roots(even: list[mp.mpf]) -> tuple[list[mp.mpc], mp.mpf]:
    """The right half plane's roots of a polynomial in s^2, and the leading coefficient of its spectral factor."""
    return [mp.sqrt(z) for z in mp.polyroots(even, maxsteps=500, extraprec=400)], mp.sqrt(abs(even[0]))
