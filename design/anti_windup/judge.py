"""What (2.16)-(2.19) and Theorem 2.3.1 say of a theta1~, and the compensators that every design carries."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from design.anti_windup.chosen_guarantee import chosen_guarantee
from design.anti_windup.compensator import AntiWindup, second_order, uncertainty_cost
from design.anti_windup.condition import Robustness, Sector
from design.anti_windup.corrected_compensator import DECADES, SETTLED, NoCompensatorError, corrected
from design.anti_windup.kyp_certificate import Rows, certificate, proved_storage
from design.anti_windup.popov import popov_sector, robust_loss, robust_popov_sector
from design.anti_windup.thesis_compensator import thesis_choice
from design.blocks.block import Block, bound_block, fastest_root, plant_block
from design.choices import GUARANTEES, WEAKER
from identification.base.errors import InputError, shown
from identification.base.json_object import Reader, numbers, or_none, record
from identification.model.additive_bound import AdditiveBound
from identification.model.plant import PlantModel

BEYOND = 1000  # times the loop's own rate, or the plant's fastest root: as far as a root of W_a alone may be followed


@dataclass(frozen=True)
class Judgement:
    """What one theta1~ is worth for a plant and its W_a.

    Parameters
    ----------
    f
        ||W_a (1 + theta1~)||_inf, (2.19), which exceeds it by 1e-9 of it at most: proved.
    f_omega
        Frequency in rad/s where it is reached; None: as omega grows, of a W_a that does not fall.
    popov_sector
        Sector k that Popov's condition is proved to allow, 1e-9 below the largest found; None: every one.
    popov_multiplier_s
        Of the Popov line, in seconds: through -1/k with the slope 1/multiplier; 0 is the circle criterion.
    theta1_tilde_at_zero
        theta1~(0); -1 is what removes a single integrator from theta2.
    theta2_stable
        Whether theta2 is stable, which the proof of Theorem 2.3.1 needs.
    lasting_offset
        What y_d keeps for ever after a windup, the integral of u - sat(u), of 1 (input unit times second), in the
        output's unit; None when y_d grows without bound.
    recovery_s
        Time in seconds in which the slowest mode of theta1~ falls to 1 %; what is left of y_d then decays with the
        plant's own modes. Of theta1~ = 0 that of the plant's slowest mode.
    """

    f: float
    f_omega: float | None
    popov_sector: float | None
    popov_multiplier_s: float
    theta1_tilde_at_zero: float
    theta2_stable: bool
    lasting_offset: float | None
    recovery_s: float


@dataclass(frozen=True)
class Compensator:
    """One anti-windup of a design.

    Parameters
    ----------
    kind
        theta1~.
    judgement
        What it is worth for the plant as the design sees it.
    """

    kind: AntiWindup
    judgement: Judgement

    def to_dict(self) -> dict[str, Any]:
        """What was chosen, both blocks and the judgement, as design.json holds them."""
        chosen = {name: value for name, value in vars(self).items() if name not in ("kind", "judgement")}
        return chosen | self.kind.to_dict() | asdict(self.judgement)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """Read what :meth:`to_dict` writes; raises InputError when it is not of that form."""
        readers: dict[str, Reader] = {
            "AntiWindup": lambda members, _: AntiWindup.from_dict(members),
            "Judgement": lambda members, _: record(Judgement, members),
            "Rows | None": or_none(_rows),
        }
        return record(cls, content, readers)


@dataclass(frozen=True)
class PrintedCompensator(Compensator):
    """The thesis's.

    Parameters
    ----------
    alpha, beta, gamma
        Of (2.23); the time constants in seconds.
    """

    alpha: float
    beta: float
    gamma: float


@dataclass(frozen=True)
class CorrectedCompensator(Compensator):
    """That of :func:`design.anti_windup.corrected_compensator.corrected`.

    Parameters
    ----------
    guarantee, guarantee_said
        See :func:`design.anti_windup.chosen_guarantee.chosen_guarantee`; the sentence is that of the design's command.
    sector
        Of the circle criterion, which it was asked to meet; None for another guarantee.
    bandwidth
        In rad/s; no pole of theta1~ lies beyond.
    f_lower
        As of :class:`design.anti_windup.corrected_compensator.Corrected`.
    certificate
        P of the storage function of 1 + theta1~, see :mod:`design.anti_windup.kyp_certificate`; None for a sector.
    """

    guarantee: str
    guarantee_said: str
    sector: float | None
    bandwidth: float
    f_lower: float
    certificate: Rows | None

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """Read what :meth:`to_dict` writes; raises InputError where its certificate proves nothing.

        What a robust guarantee needs beside it, the margin for W_a, is a matter of the loop, which the audit judges.
        """
        found = super().from_dict(content)
        if found.guarantee not in GUARANTEES:
            raise InputError(f"guarantee is {shown(found.guarantee)}; expected one of {', '.join(GUARANTEES)}")
        if (found.sector is None) != (found.guarantee != "sector") or (found.certificate is None) != (
            found.guarantee == "sector"
        ):
            needed = "a sector and no certificate" if found.guarantee == "sector" else "a certificate and no sector"
            raise InputError(f"the guarantee is '{found.guarantee}'; expected {needed} beside it")
        if found.certificate is not None:
            proved_storage(found.kind.one_plus, found.certificate)
        return found


def _rows(content: Mapping[str, Any], key: str) -> Rows:
    """A matrix row by row."""
    rows = content.get(key)
    if not isinstance(rows, list):
        raise InputError(f"{shown(key)} is {shown(rows)}; expected a list of rows")
    return tuple(numbers({key: row}, key) for row in rows)


def judge(plant: PlantModel, bound: AdditiveBound, kind: AntiWindup) -> Judgement:
    """Judge one anti-windup compensator for a plant and its bound."""
    f, f_omega = uncertainty_cost(bound, kind.one_plus)
    sector, multiplier = popov_sector(kind.theta1_tilde)
    return Judgement(
        f=f,
        f_omega=f_omega if np.isfinite(f_omega) else None,
        popov_sector=sector if np.isfinite(sector) else None,
        popov_multiplier_s=multiplier,
        theta1_tilde_at_zero=float(kind.theta1_tilde(0j).real),
        theta2_stable=kind.theta2(plant).is_stable,
        lasting_offset=lasting_offset(plant, kind),
        recovery_s=settling_of_slowest(kind.one_plus if kind.one_plus.poles else plant_block(plant)),
    )


def settling_of_slowest(block: Block) -> float:
    """Time in seconds in which the slowest mode of a block falls to 1 %; infinite where it is not stable."""
    slowest = min((-pole.real for pole in block.poles), default=np.inf)
    return float(np.log(1 / SETTLED)) / slowest if slowest > 0 else np.inf


def lasting_offset(plant: PlantModel, kind: AntiWindup) -> float | None:
    """The final value of y_d = theta2 u_tilde after a u_tilde of finite duration whose integral is 1.

    lim s theta2(s) as s -> 0: the residue of theta2 at s = 0, K (1 + theta1~(0)) with one integrator; None when
    theta2 has worse poles than one at s = 0.
    """
    theta2 = kind.theta2(plant)
    if theta2.is_stable:
        return 0.0
    if theta2.unstable_poles != (0j,):
        return None
    return float((theta2 * Block(1.0, (0j,)))(0j).real)


def robust_sector(
    kind: AntiWindup, robustness: Callable[[np.ndarray], np.ndarray], roots: tuple[complex, ...]
) -> float:
    """The largest sector found for which Popov's condition holds for every plant within W_a, not for the model alone.

    Parameters
    ----------
    kind
        theta1~.
    robustness
        |W_a C S| as a function of omega in rad/s.
    roots
        Poles and zeros in rad/s that shape it.

    Returns
    -------
    float
        0 when |W_a C S| reaches 1: then not even the loop without saturation is stable for all these plants.
    """
    loss = robust_loss(kind.one_plus, robustness)
    return robust_popov_sector(kind.theta1_tilde, loss, roots + kind.one_plus.zeros)[0]


def compensators(
    plant: PlantModel,
    bound: AdditiveBound,
    own_s: float,
    recovery_s: float | None = None,
    sector: float | None = None,
    bandwidth: float | None = None,
    guarantee: str | None = None,
    robustness: Robustness | None = None,
    highest_omega: float | None = None,
) -> tuple[PrintedCompensator, CorrectedCompensator]:
    """The thesis's and the corrected compensator, each with its judgement.

    Parameters
    ----------
    plant, bound
        P and W_a.
    own_s
        Time in seconds in which the design's own transients fall to 1 %.
    recovery_s
        Of the corrected compensator, see :func:`design.anti_windup.corrected_compensator.corrected`. One that is given
        is a bound; unless given, the slowest mode takes ``own_s``, to the lattice of the poles: one much
        faster than the loop may have a smaller f, and answers a saturation with a control many times the limits.
    bandwidth
        Of the corrected compensator in rad/s; unless given, that of the fastest root of the plant and of W_a, which is
        as far as they say anything, and at least ten times the rate ln(100)/own_s. It does not depend on
        ``recovery_s``, so that f does not increase with it. It is at most 10^5 times that rate, so that the lattice of
        the poles reaches down to it.
    guarantee, sector, robustness
        Of the corrected compensator, see :func:`design.anti_windup.chosen_guarantee.chosen_guarantee`. Where the sector
        is not stated and no compensator has it, the next of :data:`design.choices.WEAKER` is taken.
    highest_omega
        Highest frequency in rad/s at which the plant was measured; None where it is not known. A root of W_a beyond it
        says nothing of the plant, so that the bandwidth that is not given ends there, or at the loop's own rate
        ln(100)/own_s where that is faster. Where it is not known the bandwidth ends at 1000 times the plant's fastest
        root or that rate, whichever is faster.

    Raises
    ------
    InputError
        A number is out of its range, there is no such guarantee, or no corrected compensator meets its condition.
    """
    alpha, beta, gamma = thesis_choice(bound)
    own_rate = float(np.log(1 / SETTLED)) / own_s
    P = plant_block(plant)
    if bandwidth is None:
        known = BEYOND * max([own_rate, *map(abs, P.zeros + P.poles)])
        if highest_omega is not None:
            known = max(highest_omega, own_rate)
        bandwidth = min(max(fastest_root(P, bound_block(bound)), 10 * own_rate), known, 10**DECADES * own_rate)
    unstable, pace = P.unstable_poles, own_s if recovery_s is None else recovery_s
    name, condition, said = chosen_guarantee(unstable, guarantee, sector, robustness)
    weaker = [Sector(k) for k in WEAKER if isinstance(condition, Sector) and sector is None]
    while True:
        try:
            found = corrected(unstable, bound, pace, condition, bandwidth, faster=recovery_s is not None)
            break
        except NoCompensatorError:
            if not weaker:
                raise
            said = f"{said}; no theta1~ of the class was found that meets {condition}"
            condition = weaker.pop(0)
    M = found.anti_windup.one_plus
    k, proof = (condition.k, None) if isinstance(condition, Sector) else (None, certificate(M))
    own = judge(plant, bound, found.anti_windup)
    printed = second_order(alpha, beta, gamma)
    return (
        PrintedCompensator(printed, judge(plant, bound, printed), alpha, beta, gamma),
        CorrectedCompensator(found.anti_windup, own, name, said, k, bandwidth, found.f_lower, proof),
    )
