"""Whether multipliers prove that no |W_a| of order n keeps between two levels, in ball arithmetic."""

from __future__ import annotations

from flint import arb, arb_mat, ctx

from identification.base.arrays import Real

PRECISIONS = (256, 1024)  # bits


def excludes(omega: Real, asked: Real, allowed: Real, lower: Real, upper: Real, order: int) -> bool:
    """Whether the multipliers prove that no W_a has asked <= |W_a| <= allowed at every frequency.

    Parameters
    ----------
    omega
        (K,) rad/s.
    asked, allowed
        (K,) in one unit, both as they are: nothing is rounded.
    lower, upper
        (K,) multipliers of asked^2 D <= N and of N <= allowed^2 D, |W_a|^2 = N/D. Any numbers, none negative, none NaN.
    order
        n, the degree of D in x = omega^2; that of N is n - 1.

    Notes
    -----
    If such a W_a existed the sum of lower (asked^2 D - N) + upper (N - allowed^2 D) over the frequencies would not be
    positive. It is L(N) + M(D), where

        L(x^i) = sum (upper - lower) omega^(2i),    M(x^i) = sum (lower asked^2 - upper allowed^2) omega^(2i).

    A polynomial that is not negative for x >= 0 is p + x q with sums of squares p and q. So L(N) > 0 and M(D) > 0 for
    all of them, against that, if the matrices of the moments i + j and of the moments i + j + 1 are positive definite
    for both: if their leading principal minors are positive (Sylvester).
    """
    for bits in PRECISIONS:
        with ctx.workprec(bits):
            x = [arb(value) ** 2 for value in omega.tolist()]
            low, high = ([arb(value) for value in part.tolist()] for part in (lower, upper))
            least, most = ([arb(value) ** 2 for value in part.tolist()] for part in (asked, allowed))
            top = [b - a for a, b in zip(low, high, strict=True)]
            bottom = [a * p - b * q for a, p, b, q in zip(low, least, high, most, strict=True)]
            if _positive(_moments(top, x, order)) and _positive(_moments(bottom, x, order + 1)):
                return True
    return False


def _moments(weights: list[arb], x: list[arb], count: int) -> list[arb]:
    """The sums of the weights times x^i, i below ``count``."""
    found = []
    for _ in range(count):
        found.append(sum(weights, arb(0)))
        weights = [weight * value for weight, value in zip(weights, x, strict=True)]
    return found


def _positive(moments: list[arb]) -> bool:
    """Whether every polynomial that is not negative for x >= 0, and not zero, has a positive mean."""
    for shift in (0, 1):
        size = (len(moments) + 1 - shift) // 2
        rows = [moments[i + shift : i + shift + size] for i in range(size)]
        if not all(arb_mat([row[:k] for row in rows[:k]]).det() > 0 for k in range(1, size + 1)):
            return False
    return True
