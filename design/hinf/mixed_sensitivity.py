"""The H-infinity mixed sensitivity problem (2.8): bisection with a proved test, the norm bounded from the loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from design.blocks.ball import shared
from design.blocks.block import Block
from design.hinf.central_controller import central_controller
from design.hinf.closed_loop_norm import closed_loop_norm, closed_loop_poles
from design.hinf.pick import Obstacle, Problem, SynthesisError, is_feasible
from identification.base.errors import InputError
from identification.base.json_object import member, record

SUBOPTIMALITY = 0.01  # the controller is the central one this far above what is proved infeasible
ROUNDING = 1e-4  # of the suboptimality, left for the rounding of the controller to doubles
TOLERANCE = 1e-4  # of the bisection, relative
NUDGE = 1e-7  # of a gamma that is the infimum itself, so that no precision decides it
TIGHT = 0.01  # the infimum is known when lower and upper are this near, relative


@dataclass(frozen=True)
class Synthesis:
    """What can be said about a stabilising controller K with a prescribed decay rate, and about the optimum.

    Parameters
    ----------
    gamma_lower
        No stabilising controller of these blocks reaches this norm (2.8), whatever its decay rate: proved in ball
        arithmetic, no rounding excepted.
    reason
        Why: the test that fails at ``gamma_lower``, with its margin.
    gamma
        A bound on the norm (2.8) that K reaches, of :func:`design.hinf.closed_loop_norm.closed_loop_norm`.
    decay_rate
        In 1/s; every closed-loop pole lies left of -decay_rate.
    gamma_line_lower, line_reason, gamma_line
        The same three on the line Re s = -decay_rate, where ``gamma_line`` is at most 1 % above ``gamma_line_lower``.
    W1, W2
        The weights.
    """

    gamma_lower: float
    reason: str
    gamma: float
    decay_rate: float
    gamma_line_lower: float
    line_reason: str
    gamma_line: float
    W1: Block
    W2: Block

    def to_dict(self) -> dict[str, Any]:
        """The ``hinf`` object of design.json."""
        return {**vars(self), "W1": self.W1.to_dict(), "W2": self.W2.to_dict()}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Synthesis:
        """Read what :meth:`to_dict` writes; raises InputError when a member is missing or of the wrong form."""
        return record(cls, content, {"Block": lambda members, key: Block.from_dict(member(members, key))})


@dataclass(frozen=True)
class Infimum:
    """An interval that holds the infimum of (2.8) over all stabilising controllers.

    Parameters
    ----------
    lower, reason
        No stabilising controller reaches a smaller norm, and the test that fails there.
    upper
        A bound on the norm of a controller that stabilises, of :func:`design.hinf.closed_loop_norm.closed_loop_norm`.
    decay_rate
        In 1/s, down to which the synthesis was driven; 0 when G has no poles on the axis.
    """

    lower: float
    reason: str
    upper: float
    decay_rate: float


def mixed_sensitivity(G: Block, W1: Block, W2: Block, decay_rate: float) -> tuple[Block, Synthesis]:
    """Minimise || [W1 S; W2 T] ||_inf over the controllers that stabilise G with a decay rate, Thesis Eq. (2.8).

    Parameters
    ----------
    G
        Proper plant without dead time; poles on the imaginary axis are allowed with a positive decay rate.
    W1
        Performance weight, proper, its poles left of -decay_rate.
    W2
        Robustness weight such that W2 G is biproper and, apart from the poles of G, has its poles left of
        -decay_rate. W2 itself may be improper.
    decay_rate
        In 1/s, not negative. With 0 it is (2.8) itself that is solved, and the two bounds on it are those on the
        line.

    Returns
    -------
    K
        Controller, u = K (r - y), strictly proper when W1 is.
    synthesis
        What can be said of it.

    Raises
    ------
    InputError
        A weight is zero, of the wrong degree, or its poles lie too far to the right; or G has a pole on the line
        Re s = -decay_rate.
    SynthesisError
        There is no feasible gamma, or the controller, rounded to doubles, misses the decay rate or the norm that is
        asked for.

    Notes
    -----
    The infimum of (2.8) is no design when G has poles on the axis, as the internal model puts them there: it is
    approached by controllers that cancel those poles, the closed loop's slowest pole going to the axis with
    them. So the norm is minimised over the larger half plane Re s > -decay_rate, in which these poles are unstable.
    On (2.8) itself a pole on the axis has no other effect than the cost |W2| of T = 1 there.

    Whether a gamma is feasible is decided as :class:`design.hinf.pick.Problem` says.
    """
    problem = Problem(G, W1, W2, decay_rate)
    K, bound = synthesise(problem)
    return K, _assess(problem, K, bound)


def assess(G: Block, W1: Block, W2: Block, K: Block, decay_rate: float) -> Synthesis:
    """What can be said of any controller: the same as of the one that :func:`mixed_sensitivity` makes.

    Parameters
    ----------
    G, W1, W2, decay_rate
        As for :func:`mixed_sensitivity`.
    K
        Controller without dead time.

    Raises
    ------
    InputError
        As :func:`mixed_sensitivity`.
    SynthesisError
        A closed-loop pole does not lie left of -decay_rate.
    """
    problem = Problem(G, W1, W2, decay_rate)
    _check(problem)
    return _assess(problem, K, _bisect(problem))


def _assess(problem: Problem, K: Block, line_bound: Obstacle) -> Synthesis:
    G, W1, W2, decay_rate = problem.G, problem.W1, problem.W2, problem.decay_rate
    slowest = max(pole.real for pole in closed_loop_poles(G, K))
    if slowest >= -decay_rate:
        raise SynthesisError(
            f"K gives a closed-loop pole with Re s = {slowest:.6g}; expected Re s < {0 - decay_rate:.6g} for all poles"
        )
    line = closed_loop_norm(G, W1, W2, K, decay_rate)
    bound, norm = line_bound, line
    if decay_rate > 0:
        bound, norm = _bisect(Problem(G, W1, W2, 0.0)), closed_loop_norm(G, W1, W2, K)
    return Synthesis(
        bound.gamma, bound.reason, norm, decay_rate, line_bound.gamma, line_bound.reason, line, W1=W1, W2=W2
    )


def infimum(G: Block, W1: Block, W2: Block, decay_rate: float) -> Infimum:
    """Bracket the infimum of (2.8) by driving the decay rate down from the given one, the weights as they are.

    Parameters
    ----------
    G, W1, W2, decay_rate
        As for :func:`mixed_sensitivity`; the decay rate in 1/s is halved until the bounds agree to 1 %.

    Returns
    -------
    Infimum
        Wider than 1 % when rounding stops the synthesis first; ``decay_rate`` then says how far it got.

    Raises
    ------
    InputError, SynthesisError
        As :func:`mixed_sensitivity`, for the given decay rate.
    """
    on_axis = any(pole.real == 0 for pole in G.poles)
    reached = decay_rate if on_axis else 0.0

    def upper(decay_rate: float) -> float:
        return closed_loop_norm(G, W1, W2, synthesise(Problem(G, W1, W2, decay_rate), SUBOPTIMALITY / 10)[0])

    best, bound = upper(reached), _bisect(Problem(G, W1, W2, 0.0))
    while on_axis and best > (1 + TIGHT) * bound.gamma:
        try:
            best = min(best, upper(reached / 2))
        except SynthesisError:
            break
        reached /= 2
    return Infimum(bound.gamma, bound.reason, best, reached)


def synthesise(problem: Problem, suboptimality: float = SUBOPTIMALITY) -> tuple[Block, Obstacle]:
    """The controller K of :func:`mixed_sensitivity`, with its own check, and what is proved infeasible on the line."""
    G, decay_rate = problem.G, problem.decay_rate
    _check(problem)
    bound = _bisect(problem)
    most = bound.gamma * (1 + suboptimality)
    K = central_controller(problem, most * (1 - ROUNDING * suboptimality))
    if K is None:
        raise SynthesisError(
            f"rounding errors are too large for the controller of norm {most:.6g}; expected other weights"
        )
    slowest = max(pole.real for pole in closed_loop_poles(G, K))
    norm = math.inf if slowest >= -decay_rate else closed_loop_norm(G, problem.W1, problem.W2, K, decay_rate)
    if norm > most:
        missed = f"the norm {norm:.6g}" if norm < math.inf else f"a closed-loop pole with Re s = {slowest:.4g}"
        raise SynthesisError(
            f"the controller for the norm {most:.6g} and the decay rate {decay_rate:.4g} 1/s, rounded to doubles, has "
            f"{missed}; expected frequencies, poles and weights fewer decades apart and not so near each other (no "
            f"controller has a norm below {bound.gamma:.6g})"
        )
    return K, bound


def _check(problem: Problem) -> None:
    G, W1, W2, decay_rate = problem.G, problem.W1, problem.W2, problem.decay_rate
    if not (math.isfinite(decay_rate) and decay_rate >= 0):
        raise InputError(f"the decay rate is {decay_rate:g}; expected zero or a positive number of 1/s")
    if G.delay_s or G.relative_degree < 0:
        raise InputError("G is improper or has a dead time; expected a proper plant without dead time")
    if W1.relative_degree < 0 or (W2 * G).relative_degree != 0:
        raise InputError(
            "W1 is improper, or W2 G has unequal numbers of zeros and poles; expected a proper W1 and a biproper W2 G"
        )
    if 0 in (G.gain, W1.gain, W2.gain) or not G.poles + W1.poles:
        raise InputError(
            "G, W1 or W2 is zero, or neither G nor W1 has a pole; expected none zero, and a pole of G or W1"
        )
    if any(pole.real == -decay_rate for pole in G.poles):
        raise InputError(
            f"G has a pole with Re s = {0 - decay_rate:g}, the line of the decay rate on which the norm is taken; "
            "expected another decay rate"
        )
    own = [*W1.poles, *shared((W2 * G).poles, G.poles)[1]]
    if own and max(pole.real for pole in own) >= -decay_rate:
        raise InputError(
            f"a weight has a pole with Re s = {max(pole.real for pole in own):g}; expected Re s < {0 - decay_rate:g}, "
            "minus the decay rate, for all of them"
        )


def _bisect(problem: Problem) -> Obstacle:
    """The greatest gamma proved infeasible, with a feasible one at most TOLERANCE above it."""
    proof, high = Obstacle(0.0, ""), math.inf
    while high > (1 + TOLERANCE) * proof.gamma:
        if proof.gamma == 0:
            gamma = min(1.0, high / 4)
        else:
            gamma = math.sqrt(high * proof.gamma) if high < math.inf else 4 * proof.gamma
        if not 1e-100 < gamma < 1e100:
            raise SynthesisError(f"the infimum of the norm is beyond {gamma:.0e}; expected weights nearer to 1")
        for tried in (gamma, gamma * (1 + NUDGE)):
            answer = is_feasible(problem, tried)
            if answer is not False:
                break
        else:
            raise SynthesisError(
                f"rounding errors are too large to decide whether a controller reaches the norm {gamma:.6g}; expected "
                "weights whose roots lie farther apart"
            )
        proof, high = (answer, high) if isinstance(answer, Obstacle) else (proof, tried)
    return proof
