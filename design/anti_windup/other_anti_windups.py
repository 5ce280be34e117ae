"""The anti-windups that others published, for comparison: each as theta1~ and theta2 of the loop of Fig. 2.6.

A linear anti-windup adds H u~ to the control of C, u~ = u - sat(u). From u = C (r - P sat(u)) + H u~ follows

    u = v - theta1~ u~,   y = y_lin - P M u~,   M = 1 + theta1~ = S (1 - H),   S = 1/(1 + C P),

v and y_lin being the control and the output of the loop without saturation. So each is a choice of M. In two of them
there is no dead time, although S = 1 - T_so T_si has one:

- conditioning, H = 1 - C/C(infinity), gives M = C S/C(infinity): in chapters 3 and 4 K/K(infinity);
- the observer, u = E e + G sat(u) with C = E/(1 - G), has H = -G/(1 - G) and M = S/(1 - G). With the two stable factors
  of :mod:`design.chapters_3_4.realisation`, 1 - G = (1 - T_so T_si)/g, that is g = prod(s - p_i)/(s + a)^q, p_i the
  plant's q poles with Re s >= 0: for one integrator the washout s/(s + a), for none the internal model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from design.anti_windup.compensator import AntiWindup, from_one_plus, plus_one
from design.anti_windup.corrected_compensator import SETTLED
from design.anti_windup.least_gain import static, weston_postlethwaite
from design.anti_windup.linear_loop import LinearLoop
from design.blocks.block import Block, from_polynomial, plant_block
from identification.base.errors import InputError

AROUND_ZERO = 1e-2  # of the slowest root: the circle in which zeros at s = 0 are counted
ON_CIRCLE = 400  # points


class BackCalculation(AntiWindup):
    """u = v - B u~ with B = one_plus - 1, and no theta2: the loop sees y alone."""

    def deviation(self, plant: Block, one_plus: Block) -> Block:
        """Zero."""
        return Block(0.0)


def back_calculation(loop: LinearLoop) -> BackCalculation:
    """Each pole of C on the imaginary axis is fed (sat(u) - u)/T_t, so that u = C e - (1/T_t) sum 1/(s - p_i) u~.

    H. A. Fertik and C. W. Ross, "Direct digital control algorithm with anti-windup feature", ISA Transactions 6, 1967;
    K. J. Astrom and L. Rundqwist, "Integrator windup and how to avoid it", American Control Conference, 1989. Of a PI
    controller it is the textbook's. T_t = recovery_s/ln(100): what the integrators hold in excess goes as fast as the
    slowest mode of ``corrected``. Every T_t > 0 leaves a stable controller while the actuator saturates, since
    sum 1/(s - p_i) is positive real.

    Raises
    ------
    InputError
        C has no pole on the imaginary axis.
    """
    poles = _axis_poles(loop)
    if not poles:
        raise InputError("the controller has no pole on the imaginary axis; expected one for back-calculation")
    scale = float(np.log(1 / SETTLED)) / loop.recovery_s
    derivative = from_polynomial(np.polyder(np.real(np.poly(poles))))
    fed = derivative.scaled(scale) * Block(1.0, (), poles)
    return BackCalculation(fed, plus_one(fed))


def conditioning(loop: LinearLoop) -> AntiWindup:
    """C's states take what they would of the reference for which the control had been sat(u): M = C S/C(infinity).

    R. Hanus, M. Kinnaert and J.-L. Henrotte, "Conditioning technique, a general anti-windup and bumpless transfer
    method", Automatica 23, 1987.

    Raises
    ------
    InputError
        C(infinity) is 0, so that no reference gives sat(u) at once; or M is not stable.
    """
    answer = loop.forward if loop.pole is not None else loop.forward * _sensitivity(loop)
    if answer.relative_degree:
        raise InputError(
            f"the controller has {answer.relative_degree} more poles than zeros; expected as many zeros as poles for "
            "conditioning, which inverts it at infinite frequency"
        )
    return from_one_plus(Block(1.0, answer.zeros, answer.poles))


def observer(loop: LinearLoop) -> AntiWindup:
    """The controller's predictor is driven by sat(u) in the place of u: M = prod(s - p_i)/(s + a)^q.

    K. J. Astrom and B. Wittenmark, "Computer Controlled Systems", 1984; K. J. Astrom and L. Rundqwist, 1989.

    Raises
    ------
    InputError
        The design is of chapter 2, whose controller has no predictor.
    """
    if loop.pole is None:
        raise InputError(
            "the design is 'delay-free', which has no Smith predictor for sat(u) to drive; expected 'extended'"
        )
    anchors = plant_block(loop.plant).unstable_poles
    return from_one_plus(Block(1.0, anchors, (complex(-loop.pole),) * len(anchors)))


def internal_model(loop: LinearLoop) -> AntiWindup:
    """theta1~ = 0, y_d = P u~: M = 1.

    A. Zheng, M. V. Kothare and M. Morari, "Anti-windup design for internal model control", International Journal of
    Control 60, 1994.

    Raises
    ------
    InputError
        The plant has a pole with Re s >= 0, which theta2 = P would have too.
    """
    if poles := plant_block(loop.plant).unstable_poles:
        pole = max(poles, key=lambda each: each.real)
        at = f"{pole.real:.4g}" + (f" +- {abs(pole.imag):.4g}j" if pole.imag else "")
        raise InputError(f"the plant has a pole at {at} rad/s; expected a stable plant for the internal model")
    return AntiWindup(Block(0.0), Block(1.0))


def _static(loop: LinearLoop) -> AntiWindup:
    if loop.pole is not None:
        return static(loop.plant, observer(loop).one_plus, loop.forward.poles).kind
    return static(loop.plant, Block(1.0), _sensitivity(loop).poles).kind


OTHERS: Mapping[str, Callable[[LinearLoop], AntiWindup]] = {
    "back-calculation": back_calculation,
    "conditioning": conditioning,
    "observer": observer,
    "internal-model": internal_model,
    "weston-postlethwaite": lambda loop: weston_postlethwaite(loop.plant, loop.bandwidth).kind,
    "static": _static,
}
"""By the names that ``--anti-windup`` takes; each raises InputError where it does not exist."""


def _sensitivity(loop: LinearLoop) -> Block:
    """S of a loop without dead time."""
    return plus_one(loop.forward * plant_block(loop.plant)).inverse()


def _axis_poles(loop: LinearLoop) -> tuple[complex, ...]:
    """The poles of C on the imaginary axis: T = 1 at the reference's frequencies, and perhaps at 0 once more than P."""
    if loop.pole is None:
        return tuple(pole for pole in loop.forward.poles if pole.real == 0)
    waves = tuple(complex(0, sign * omega) for omega in loop.omegas if omega > 0 for sign in (1, -1))
    roots = [abs(root) for root in (*loop.feedback.poles, *loop.feedback.zeros, *waves) if root]
    circle = AROUND_ZERO * min(roots) * np.exp(2j * np.pi * np.arange(ON_CIRCLE + 1) / ON_CIRCLE)
    phase = np.unwrap(np.angle(1 - loop.feedback(circle) * np.exp(-loop.plant.delay_s * circle)))
    turns = round(float(phase[-1] - phase[0]) / (2 * np.pi))
    return (*waves, *[0j] * (turns - max(loop.plant.integrators, 0)))
