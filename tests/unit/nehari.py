"""The optimum of (2.8) by another method, which shares nothing with the Riccati equations: Nehari's theorem by FFT.

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

import numpy as np
from scipy.optimize import brentq
from scipy.sparse.linalg import LinearOperator, eigsh

from design.block import Block


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
