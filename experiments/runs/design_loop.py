"""Designs -> saturated loops: Fig. 2.6 with and without its anti-windup."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from design.blocks.block import Block, plant_block
from design.blocks.state_space import StateSpace, block_diagonal, realize
from design.design_file import Asked, Design
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.runs.disturbances import UNDISTURBED, Disturbances, combined
from experiments.runs.references import Reference, SampledReference
from identification.base.errors import InputError
from identification.model.plant import PlantModel


def design_loop(
    design: Design,
    reference: Reference | SampledReference,
    anti_windup: Asked,
    plant: PlantModel | None = None,
    disturbances: Disturbances = UNDISTURBED,
) -> SaturatedLoop:
    """The loop of Fig. 2.6 around a design, from rest, which obeys Thesis Lemma 2 and its steps, Eq. (2.10)-(2.15).

    Parameters
    ----------
    design
        Chapter 2: its plant has no dead time. Chapters 3 and 4: exact dead time.
    reference
        r(t).
    anti_windup
        theta1~ with 1 + theta1~, or its name in the design; None takes theta1 and theta2 out of the loop.
    plant
        The true plant; the design's own model unless given. Of as many zeros as poles it has a dead time, or a
        controller that is strictly proper. The controller keeps the model in F, K and theta2, dead time and all.
    disturbances
        At the plant's input and output, and noise.

    Returns
    -------
    SaturatedLoop
        With the outputs ``reference``, ``output`` (y), ``error`` (r - y), ``y_lin`` (y + y_d) and ``v``, which
        is the control that the loop would have without saturation; with noise also ``measured``, y and the noise.

    Notes
    -----
    With e = r - y - y_d and u_tilde = u - sat(u), (1 + F) u + theta1 u_tilde = K e is

        u = v - theta1~ u_tilde,   v = K e/(1 + F),   y_d = theta2 u_tilde = P (1 + theta1~) u_tilde,

    with 1/(1 + F) = A/Lambda in chapter 2, and v = K e + T_so exp(-T_d s) v in chapter 3: 1 + F is never
    inverted as a block, theta1~ is strictly proper and so is P, and no algebraic loop is left.

    Behind an actuator with a rate limit u_tilde is still u - sat(u), as of a controller that knows the limits only, and
    y + y_d is no longer the response of the loop without saturation. It would be with u_tilde = u - m, m being what
    the actuator gives out. But theta1~ is designed for the dead zone, which has no memory, and an actuator that slews
    lags: with theta1~(0) = -1 runs with u - m ended in limit cycles where those with u - sat(u) settled.

          r -->(+)--> K/(1+F) --v-->(+)--> u --> sat --u_m--> P exp(-hs) --> y
               -^                   -^     |                                 |
                |                    |     +--> u_tilde --> theta1~          |
                |                    +---------------------'|                |
                +---- y_d <-- theta2 <-- u_tilde            '                |
                +------------------------------------------------------------+
    """
    return plant_loop(realized_controller(design, anti_windup), plant or design.loop_plant, reference, disturbances)


@dataclass(frozen=True)
class Controller:
    """A design's controller and anti-windup as state spaces.

    Parameters
    ----------
    forward, feedback
        C = forward/(1 - feedback exp(-delay_s s)).
    theta
        [theta1~; theta2], without the dead time of theta2.
    delay_s
        Of the controller's model, in seconds.
    """

    forward: StateSpace
    feedback: StateSpace
    theta: StateSpace
    delay_s: float


def realized_controller(design: Design, anti_windup: Asked) -> Controller:
    """What :func:`design_loop` has besides the plant and the reference."""
    kind = design.chosen(anti_windup)
    model = design.loop_plant
    forward, feedback = (realize(block) for block in design.controller_parts())
    blocks = (Block(0.0), Block(0.0)) if kind is None else (kind.theta1_tilde, kind.theta2(model))
    theta = realize(*blocks)
    return Controller(forward, feedback, theta, model.delay_s)


def plant_loop(
    controller: Controller,
    plant: PlantModel,
    reference: Reference | SampledReference,
    disturbances: Disturbances = UNDISTURBED,
) -> SaturatedLoop:
    """:func:`design_loop` around a true plant.

    Raises
    ------
    InputError
        The plant has as many zeros as poles and no dead time, and the controller passes the error on at once.
    """
    if plant.relative_degree < 1 and not plant.delay_s and controller.forward.d[0]:
        raise InputError(
            "the true plant has as many zeros as poles and no dead time; expected more poles than zeros or a dead time"
        )
    P = realize(plant_block(plant))
    delays = np.array([plant.delay_s, controller.delay_s, controller.delay_s])
    return _assemble(P, controller.forward, controller.feedback, controller.theta, reference, disturbances, delays)


def _assemble(
    P: StateSpace,
    forward: StateSpace,
    feedback: StateSpace,
    theta: StateSpace,
    reference: Reference | SampledReference,
    disturbances: Disturbances,
    delays: np.ndarray,
) -> SaturatedLoop:
    """States: what is generated, plant, K/(1+F) or K, T_so, [theta1~; theta2]. Delayed: outputs of P, theta2, T_so."""
    present = {name: signal for name, signal in vars(disturbances).items() if signal is not None}
    generator, rows = combined([signal.generator() for signal in (reference, *present.values())])
    added = dict.fromkeys(vars(disturbances), np.zeros(len(generator.start)))
    added |= dict(zip(present, rows[1:], strict=True))
    sizes = [len(generator.start), len(P.b), len(forward.b), len(feedback.b), len(theta.b)]
    edges = np.concatenate([[0], np.cumsum(sizes)])
    at_r, at_P, at_K, at_T, at_theta = (slice(a, b) for a, b in pairwise(edges))
    n = int(edges[-1])

    def row(**parts: np.ndarray) -> np.ndarray:
        places = {"r": at_r, "P": at_P, "K": at_K, "T": at_T, "theta": at_theta}
        full = np.zeros(n)
        for name, part in parts.items():
            full[places[name]] = part
        return full

    # w = (y, y_d, [T_so v] delayed), functions of the states, and of m and u where P is not strictly proper
    Z = np.stack([row(P=P.C[0], r=P.d[0] * added["input"]), row(theta=theta.C[1]), row(T=feedback.C[0])])
    r, d, measured = (row(r=x) for x in (generator.row, added["output"], added["output"] + added["noise"]))
    e_x, e_w = r - measured, np.array([-1.0, -1.0, 0.0])
    v_x = row(K=forward.C[0]) + forward.d[0] * e_x
    v_w = forward.d[0] * e_w + np.array([0.0, 0.0, 1.0])
    u_x = v_x - row(theta=theta.C[0])

    A = block_diagonal(generator.matrix, P.A, forward.A, feedback.A, theta.A)
    A[at_P, at_r] += np.outer(P.b, added["input"])
    D = np.zeros((n, 3))
    A[at_K] += np.outer(forward.b, e_x)
    D[at_K] += np.outer(forward.b, e_w)
    A[at_T] += np.outer(feedback.b, v_x)
    D[at_T] += np.outer(feedback.b, v_w)
    A[at_theta] += np.outer(theta.b, u_x)  # driven by u_tilde = u - m
    D[at_theta] += np.outer(theta.b, v_w)
    B = row(P=P.b) - row(theta=theta.b)
    x0 = row(r=generator.start)
    y = np.array([1.0, 0.0, 0.0])
    return SaturatedLoop(
        A=A,
        B=B,
        C=u_x,
        D=D,
        E=v_w,
        Z=Z,
        delays=delays,
        x0=x0,
        outputs={
            "reference": (r, np.zeros(3)),
            "output": (d, y),
            "error": (r - d, -y),
            "y_lin": (d, np.array([1.0, 1.0, 0.0])),
            "v": (v_x, v_w),
        }
        | ({"measured": (measured, y)} if disturbances.noise else {}),
        resets=generator.resets,
        B_limits=-row(theta=theta.b),
        # y_d = theta2 u_tilde with u_tilde = u - m
        direct=np.array([[P.d[0], 0.0, 0.0], [0.0, -theta.d[1], theta.d[1]], [0.0, 0.0, 0.0]]),
    )
