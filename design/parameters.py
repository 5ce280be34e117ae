"""What was chosen for a design, of chapter 2 or of chapters 3 and 4."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from identification.base.errors import InputError, shown
from identification.base.json_object import member, number, numbers, record, texts, whole, words
from identification.model.plant_json import sized


@dataclass(frozen=True)
class DelayFreeParameters:
    """Of chapter 2.

    Parameters
    ----------
    period_s
        The longest period of the reference in seconds.
    epsilon
        Of the factor s^2 + epsilon of Lambda, in rad^2/s^2; None for integral action.
    """

    period_s: float
    epsilon: float | None

    def to_dict(self) -> dict[str, Any]:
        """The ``parameters`` of design.json."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> DelayFreeParameters:
        """Read what :meth:`to_dict` writes; raises InputError when a member is missing."""
        return record(cls, content)


@dataclass(frozen=True)
class RollOff:
    """Of a T_so whose loop is stable around every plant within W_a with as many poles in the right half plane.

    Parameters
    ----------
    level
        What ||W_a C S|| was asked not to exceed.
    order, rate
        T_so has ``order`` additional poles at -rate (rad/s).
    """

    level: float
    order: int
    rate: float


@dataclass(frozen=True)
class Quotient:
    """A rational function.

    Parameters
    ----------
    numerator, denominator
        Real coefficients, highest power first.
    """

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]


@dataclass(frozen=True)
class ExtendedParameters:
    """Of chapters 3 and 4.

    Parameters
    ----------
    a
        Closed-loop pole of the free part in rad/s, Table 4.1.
    pairs
        e and f of the factors of the denominator of Q.
    method
        How Q was designed.
    inverse_epsilon
        epsilon of the approximate inverse of (3.2) in seconds; 0 is the exact one.
    Q
        What each method gives, or why it gives none.
    roll_off
        None unless the design is for every plant within W_a.
    reasons
        Of what was chosen by the design itself, a sentence each.
    """

    a: float
    pairs: tuple[tuple[float, float], ...]
    method: str
    inverse_epsilon: float
    Q: Mapping[str, Quotient | str]
    roll_off: RollOff | None = None
    reasons: tuple[str, ...] = ()

    @property
    def pace(self) -> float:
        """a, or the rate of the roll-off where it is slower, rad/s."""
        roll_off = self.roll_off
        return self.a if roll_off is None or not roll_off.order else min(self.a, roll_off.rate)

    def to_dict(self) -> dict[str, Any]:
        """The ``parameters`` of design.json."""
        content: dict[str, Any] = {
            "a": self.a,
            "pairs": [list(pair) for pair in self.pairs],
            "method": self.method,
            "inverse_epsilon": self.inverse_epsilon,
        }
        if self.roll_off is not None:
            content |= {"robust_level": self.roll_off.level, "roll_off_order": self.roll_off.order}
            if self.roll_off.order:
                content["roll_off"] = self.roll_off.rate
        if self.reasons:
            content["reasons"] = list(self.reasons)
        content["Q"] = {
            name: {"refused": found}
            if isinstance(found, str)
            else {"numerator": list(found.numerator), "denominator": list(found.denominator)}
            for name, found in self.Q.items()
        }
        return content

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> ExtendedParameters:
        """Read what :meth:`to_dict` writes; raises InputError when a member is missing or of the wrong form."""
        found, inverse_epsilon = member(content, "Q"), sized("inverse_epsilon", number(content, "inverse_epsilon"))
        if inverse_epsilon < 0:
            raise InputError(f"inverse_epsilon is {inverse_epsilon:g}; expected no negative number")
        return cls(
            a=number(content, "a"),
            pairs=_pairs(content),
            method=words(content, "method"),
            inverse_epsilon=inverse_epsilon,
            Q={name: _quotient(member(found, name)) for name in found},
            roll_off=_roll_off(content) if "robust_level" in content else None,
            reasons=texts(content, "reasons") if "reasons" in content else (),
        )


def _pairs(content: Mapping[str, Any]) -> tuple[tuple[float, float], ...]:
    given = content.get("pairs")
    if not isinstance(given, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in given):
        raise InputError(f"'pairs' is {shown(given)}; expected a list of pairs of numbers")
    return tuple((number({"pairs": e}, "pairs"), number({"pairs": f}, "pairs")) for e, f in given)


def _quotient(content: Mapping[str, Any]) -> Quotient | str:
    if "refused" in content:
        return words(content, "refused")
    return Quotient(numbers(content, "numerator"), numbers(content, "denominator"))


def _roll_off(content: Mapping[str, Any]) -> RollOff:
    order = whole(content, "roll_off_order")
    return RollOff(number(content, "robust_level"), order, number(content, "roll_off") if order else 0.0)
