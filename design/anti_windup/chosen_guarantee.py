"""Which guarantee the corrected theta1~ is designed for: the one asked for, or the most that the plant allows."""

from __future__ import annotations

from collections.abc import Sequence

from design.anti_windup.condition import Condition, PositiveReal, Robustness, Sector
from design.choices import GUARANTEES, SECTOR
from identification.base.errors import InputError


def chosen_guarantee(
    unstable: Sequence[complex], asked: str | None, sector: float | None, robustness: Robustness | None
) -> tuple[str, Condition, str]:
    """The guarantee, what theta1~ has to meet for it, and a sentence without its full stop that says what it is.

    Parameters
    ----------
    unstable
        Poles of the plant with Re s >= 0 in rad/s.
    asked
        One of :data:`design.choices.GUARANTEES`; unless given, ``sector`` where a sector is stated, else ``global``
        where it exists, else ``sector``.
    sector
        k of the guarantee ``sector``; :data:`design.choices.SECTOR` unless given.
    robustness
        |W_a C S|, for ``robust``.

    Raises
    ------
    InputError
        There is no such guarantee, it does not exist for this plant, a sector belongs to another one, or see
        :class:`design.anti_windup.condition.Sector` and :class:`design.anti_windup.condition.PositiveReal`.
    """
    missing = why_not_global(unstable)
    guarantee = asked or ("sector" if missing or sector is not None else "global")
    if guarantee not in GUARANTEES:
        raise InputError(f"the guarantee is '{guarantee}'; expected one of {', '.join(GUARANTEES)}")
    if guarantee == "sector":
        said = "the windup ends in every run whose control stays within the sector's region"
        return guarantee, Sector(SECTOR if sector is None else sector), f"{said}; {missing}" if missing else said
    if missing:
        raise InputError(f"the guarantee is '{guarantee}', but {missing}; expected the guarantee 'sector'")
    if sector is not None:
        raise InputError(f"a sector of {sector:g} is stated beside the guarantee '{guarantee}'; expected no sector")
    ends = "the windup ends, however large the control was, once the linear loop's control stays within the limits"
    if guarantee == "global":
        return guarantee, PositiveReal(), f"{ends}; proved in exact arithmetic"
    if robustness is None:
        raise InputError("the guarantee is 'robust', but |W_a C S| of the loop is not known; expected a loop")
    shown = "found on a refined grid of frequencies, not proved"
    if robustness.rational is not None:
        shown = "proved in exact arithmetic"
    return (
        guarantee,
        PositiveReal(robustness),
        f"for every plant within W_a with as many poles in the right half plane as the model {ends}; {shown}",
    )


def why_not_global(unstable: Sequence[complex]) -> str:
    """Why no theta1~ with a stable theta2 guarantees that the windup ends whatever the control; empty where one does.

    M = 1 + theta1~ is zero at the plant's poles with Re s >= 0, as often as they are multiple. It would have to be
    positive real. Such a function has no zero in Re s > 0, and on the axis only simple ones.
    """
    right = [pole for pole in unstable if pole.real > 0]
    if right:
        pole = max(right, key=lambda each: each.real)
        at = f"{pole.real:.4g}" + (f" +- {abs(pole.imag):.4g}j" if pole.imag else "")
        return (
            f"no guarantee for every control exists: 1 + theta1~ is 0 at the plant's pole {at} rad/s in the right half "
            "plane, where no positive real function has a zero"
        )
    if len(unstable) > 1:
        return (
            f"no guarantee for every control exists: for {len(unstable)} integrators 1 + theta1~ falls like "
            f"s^{len(unstable)} at s = 0, and no positive real function falls faster than s"
        )
    return ""
