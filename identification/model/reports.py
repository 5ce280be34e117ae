"""What is reported of a fit beside the plant: how W_a lies over the residuals, and what a subspace model finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from identification.base.errors import InputError
from identification.base.json_object import Reader, member, objects, or_none, record, whole
from identification.model.additive_bound import AdditiveBound


@dataclass(frozen=True)
class Touch:
    """Where W_a is nearly as small as a residual.

    Parameters
    ----------
    omega
        In rad/s.
    test
        The name of the test whose residual it is.
    between_lines
        The residual is that of the test's own fit.
    ratio
        Of |W_a| over the residual, 1 or little more.
    """

    omega: float
    test: str
    between_lines: bool
    ratio: float


@dataclass(frozen=True)
class Excess:
    """|W_a| over an envelope, as ratios.

    Parameters
    ----------
    largest, largest_omega
        The largest, and where it is in rad/s.
    mean
        Geometric, with equal weight for equal log frequency.
    """

    largest: float
    largest_omega: float
    mean: float


@dataclass(frozen=True)
class Outside:
    """W_a where nothing was measured: an assumption, of which the data say no more than what it is at the edges.

    Parameters
    ----------
    low, high
        The lowest and the highest line in rad/s.
    below, above
        The levels that W_a was asked to cover there, or None.
    at_zero, most_below
        |W_a| at 0, and the largest from there to the lowest line.
    most_above
        The largest from the highest line on.
    falling
        c in |W_a| = c/omega far above, output unit per input unit times rad/s.
    """

    low: float
    high: float
    below: float | None
    above: float | None
    at_zero: float
    most_below: float
    most_above: float
    falling: float

    def __str__(self) -> str:
        below, above = (
            "is an assumption" if level is None else f"covers the level of {level:.4g} given"
            for level in (self.below, self.above)
        )
        return (
            f"nothing was measured below {self.low:.4g} rad/s, where |W_a| {below} (at most {self.most_below:.4g}, "
            f"{self.at_zero:.4g} at 0), nor above {self.high:.4g} rad/s, where it {above} (at most "
            f"{self.most_above:.4g}, {self.falling:.4g}/omega far above)"
        )


@dataclass(frozen=True)
class BoundReport:
    """W_a and how tight it is.

    Parameters
    ----------
    bound
        At least |P - test| at every line of every test, and at least the distance between P and the test's own fit
        on a grid between the lines.
    largest_excess, mean_excess
        Of |W_a| over the envelope of all residuals, at the lines, at the frequencies between them where W_a is fitted,
        and around its own modes; the largest over the envelope's continuation outside the band too.
    least_excess
        No W_a of this order that covers the residuals has a smaller largest excess, as multipliers prove in ball
        arithmetic for the residuals and envelope as computed; 1 says nothing.
    at_lines, between_lines
        Over the envelope of the tests' residuals at their lines, and over that of their fits' distances between the
        lines; the latter is None without fits, or when none differs from P.
    touches
        Where W_a is nearly as small as a residual, the closest first; of those side by side only the closest. There is
        none where a level given decides W_a's gain.
    outside
        W_a beyond the lines; None in a model written before this was recorded.
    """

    bound: AdditiveBound
    largest_excess: float
    mean_excess: float
    least_excess: float
    at_lines: Excess
    between_lines: Excess | None
    touches: tuple[Touch, ...]
    outside: Outside | None = None

    def to_dict(self) -> dict[str, Any]:
        """The ``bound`` of what a fit writes: W_a's order in place of W_a, which the model holds."""
        rest = asdict(self)
        del rest["bound"]
        if self.outside is not None:
            rest["outside"]["said"] = str(self.outside)
        return {"order": self.bound.order} | rest

    @classmethod
    def from_dict(cls, content: Mapping[str, Any], bound: AdditiveBound) -> BoundReport:
        """Read what :meth:`to_dict` writes of a bound.

        Raises
        ------
        InputError
            A member is missing, or W_a is of another order.
        """

        def excess(of: Mapping[str, Any], key: str) -> Excess:
            return record(Excess, member(of, key))

        readers: dict[str, Reader] = {
            "AdditiveBound": lambda members, key: bound,
            "Excess": excess,
            "Excess | None": or_none(excess),
            "Outside | None": lambda of, key: None if of.get(key) is None else record(Outside, member(of, key)),
            "tuple[Touch, ...]": lambda members, key: tuple(record(Touch, each) for each in objects(members, key)),
        }
        if "order" in content and whole(content, "order") != bound.order:
            raise InputError(f"the order of the fit's bound is {content['order']}; expected that of W_a, {bound.order}")
        return record(cls, content, readers)


@dataclass(frozen=True)
class ModeCheck:
    """One mode of the plant and the nearest one of the subspace model.

    Parameters
    ----------
    kind
        ``zero`` or ``pole``.
    omega, zeta
        The plant's; rad/s.
    found_omega, found_zeta
        The subspace model's nearest, None where none is within a tenth of omega in the s plane.
    """

    kind: str
    omega: float
    zeta: float
    found_omega: float | None
    found_zeta: float | None


@dataclass(frozen=True)
class SubspaceCheck:
    """What a subspace model of the raw record says of the plant's modes.

    Parameters
    ----------
    order
        Number of states.
    sampling_s
        Sampling interval in seconds of the record as it was used.
    modes
        Zero modes, then pole modes, of those that oscillate within the band; none when there is no answer.
    reason
        Why there is no answer, or None.
    """

    order: int
    sampling_s: float
    modes: tuple[ModeCheck, ...]
    reason: str | None = None

    def __str__(self) -> str:
        if self.reason is not None:
            return f"N4SID of order {self.order}: no answer ({self.reason})"
        words = []
        for mode in self.modes:
            if mode.found_omega is None or mode.found_zeta is None:
                words.append(f"no {mode.kind} near {mode.omega:.5g} rad/s")
            else:
                change = f"{100 * (mode.found_omega / mode.omega - 1):+.2g} %"
                words.append(f"{mode.kind} {mode.found_omega:.5g} rad/s ({change}), zeta {mode.found_zeta:.3g}")
        return f"N4SID of order {self.order}: " + ("; ".join(words) or "the plant has no mode in the band to check")

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> SubspaceCheck:
        """Read an entry of ``subspace_check``; raises InputError when a member is missing."""

        def modes(of: Mapping[str, Any], key: str) -> tuple[ModeCheck, ...]:
            return tuple(record(ModeCheck, mode) for mode in objects(of, key))

        return record(cls, content, {"tuple[ModeCheck, ...]": modes})
