"""The extended design made again for samples: the plant in it is the held one, the reference is met at the samples."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np
from flint import acb, arb, arb_poly

from design.anti_windup.compensator import AntiWindup
from design.blocks.ball import decided, from_roots, number
from design.blocks.block import Block, geometric_scale, plant_block
from design.blocks.inner_outer import inner_outer
from design.blocks.state_space import StateSpace, realize
from design.chapters_3_4.realisation import coprime_form
from design.chapters_3_4.tracking import factored, interpolating, taylor_times, tracking_conditions
from design.design_file import Design
from design.parameters import ExtendedParameters
from experiments.drive.difference_equations import SampledBlock
from experiments.drive.held_plant import held_plant, image, late
from identification.base.errors import InputError
from identification.model.plant import PlantModel

FOLLOWS = 1e-6  # |1 - T(0)| below this is a design with integral action


def matched_controller(
    design: Design, anti_windup: AntiWindup | None, sample_time_s: float, form: str
) -> tuple[SampledBlock, SampledBlock, SampledBlock]:
    """The blocks of the sampled controller that is for the plant as the computer sees it.

    Parameters
    ----------
    design
        Of kind "extended".
    anti_windup
        theta1~; None is none.
    sample_time_s
        T, positive.
    form
        As of :func:`experiments.drive.sampled_loop.simulate_sampled`.

    Returns
    -------
    forward, feedback, theta
        From e to v, from v to what is added to v, and from u_tilde to what u gives up and to y_d; none takes its input
        at once but ``forward`` and the first output of ``theta``.

    Raises
    ------
    InputError
        The design is another; or the rate is not above twice the reference's highest frequency, or so low that
        numbers are lost in rounding errors.

    Notes
    -----
    Everything is a function of w = (z - 1)/T, which tends to s. P_d z^-N is the held plant. The poles of T_so and of
    P_o move to exp(s T), so that K_d cancels the poles of P_d exactly, see :func:`_inverted` for its zeros, and K_d has
    as many zeros at z = -1 as K has poles more than zeros, as by Tustin's rule. T_d = K_d P_d z^-N is made of the held
    plant itself, so that the loop around the design's plant is y = T_d r, whose poles are inside the unit circle at
    every rate. The numerator of T_so is corrected by a polynomial of as many coefficients as there are tracking
    conditions, so that T_d = 1 at the samples of every sinusoid of the reference, at z = 1 as often as the continuous
    T, and at the plant's unstable poles. 1 + theta1~ goes by Tustin's rule, which keeps where it is positive real, and
    theta2 = P_d (1 + theta1~) is exact: y + y_d is the linear loop's response at the samples.
    """
    T, fastest = sample_time_s, max(design.reference_omegas)
    if not is_matched(design):
        raise InputError(
            "the method is 'matched', for an extended design with the exact inverse of the plant; expected 'tustin' or "
            "'exact' for this one"
        )
    if not fastest * T < np.pi:
        raise InputError(
            f"the rate is {1 / T:.9g} Hz and the reference has {fastest / (2 * np.pi):.9g} Hz; expected more than "
            "twice the reference's frequency"
        )
    P_d, samples = held_plant(design.plant, T)
    K_d = decided(lambda: _forward(design, P_d, samples, T))
    if K_d is None:
        raise InputError(f"rounding errors exceed the controller at {1 / T:g} Hz; expected another rate")
    T_d = K_d * P_d
    if form == "thesis":
        forward, feedback = K_d, _sampled(realize(T_d), [samples], T)
    else:
        forward, feedback = _coprime(design.plant, K_d, T_d, design.free.a, samples, T)
    theta = realize(Block(0.0), Block(0.0))
    if anti_windup is not None:
        one_plus = _by_tustin(anti_windup.one_plus, plant_block(design.plant).unstable_poles, T)
        both = realize(one_plus, anti_windup.deviation(P_d, one_plus))
        theta = StateSpace(both.A, both.b, both.C, both.d - [1.0, 0.0])
    return _sampled(realize(forward), [0], T), feedback, _sampled(theta, [0, samples], T)


def is_matched(design: Design) -> bool:
    """Whether the method is for a design: an extended one with the exact inverse of the plant."""
    return isinstance(design.parameters, ExtendedParameters) and not design.parameters.inverse_epsilon


def _forward(design: Design, P_d: Block, samples: int, T: float) -> Block:
    """K_d in w; raises UndecidedError where two zeros of n_d are too close to separate."""
    T_so, (T_si, P_o) = design.blocks["T_so"], inner_outer(design.plant)
    integral_action = bool(abs(1 - (T_so * T_si)(0)) < FOLLOWS)
    wanted = tracking_conditions(design.plant, design.reference_omegas, integral_action)
    at_zero = (0j,) * wanted.zeros_at_zero
    half = Block((T / 2) ** design.blocks["K"].relative_degree, (-2 / T,) * design.blocks["K"].relative_degree)
    fixed = Block(1.0, at_zero, _images(T_so.poles, T))
    fixed = fixed * Block(1 / P_o.gain, _images(P_o.poles, T), _inverted(design.plant, P_d, T)) * half
    n = Block(T_so.gain, _images([zero for zero in T_so.zeros if zero], T))
    T_d = fixed * P_d

    def missing(point: acb, terms: int) -> list[acb]:
        early = [term / arb(T_d.gain) for term in late(-samples, T, point, terms)]
        target = taylor_times(early, Block(1.0, T_d.poles, T_d.zeros), point)
        own = taylor_times([acb(1), *[acb(0)] * (terms - 1)], n, point)
        return [each - there for each, there in zip(target, own, strict=True)]

    points = [(image(point, T), multiplicity) for point, multiplicity in wanted.points]
    unit = geometric_scale(fixed)
    more = interpolating(points, missing, unit)
    own = (
        arb(n.gain) * arb(unit) ** len(n.zeros) * from_roots(number(zero) / unit for zero in n.zeros if zero.imag >= 0)
    )
    corrected = own + arb_poly(more)
    return factored(corrected.coeffs(), unit) * fixed


def _inverted(plant: PlantModel, P_d: Block, T: float) -> tuple[complex, ...]:
    """The poles of K_d in the place of the plant's zeros: the zeros of P_d next to them, or their mirror images.

    They are inside the unit circle at least as far as the images of the plant's zeros are from it, so that |T_d| has
    no peak there. The zeros that sampling adds to P_d are not inverted.
    """
    found, spare = [], [zero for zero in P_d.zeros if zero.imag or T * zero.real > -1]
    for zero in plant_block(plant).zeros:
        near = [each for each in spare if np.sign(each.imag) == np.sign(zero.imag)]
        if abs(zero.imag) * T >= np.pi:  # the computer does not see it
            found.append(complex(-1 / T))
        elif not (zero and near):
            found.append(image(complex(-abs(zero.real), zero.imag), T))
        else:
            chosen = min(near, key=lambda each: abs(each - image(zero, T)))
            spare.remove(chosen)
            s = np.log1p(T * chosen) / T
            decay = max(abs(s.real), abs(zero.real))
            found.append(chosen if s.real == -decay else image(complex(-decay, s.imag), T))
    return tuple(found)


def _coprime(plant: PlantModel, K_d: Block, T_d: Block, a: float, samples: int, T: float) -> tuple[Block, SampledBlock]:
    """K_d/g and 1 - (1 - T_d z^-samples)/g, where g has the plant's poles in Re s >= 0 as zeros, by a finite memory."""
    anchors = _images(plant_block(plant).unstable_poles, T)
    inside = min(len(anchors), samples)  # of the dead time: 1/g takes as many samples of it as g has zeros
    T_d, samples = T_d * Block(T**-inside, (), (-1 / T,) * inside), samples - inside
    form = coprime_form(K_d, T_d, anchors, -image(-a, T).real, partial(late, samples, T))
    if anchors and not samples:
        return form.forward, _sampled(realize(form.rest), [0], T)
    system = _sampled(realize(form.rest, form.through), [0, samples], T)
    if not anchors:
        return form.forward, system
    A, b, c = form.kernel()
    taps, state = np.zeros((2, samples)), T * b
    taps[0, 0] = 1.0
    for j in range(samples):
        taps[1, j] = c @ state
        state = state + T * A @ state
    return form.forward, system._replace(first=np.array([0, 1]), length=np.array([1, samples]), taps=taps)


def _images(roots: Sequence[complex], T: float) -> tuple[complex, ...]:
    return tuple(image(root, T) for root in roots)


def _by_tustin(block: Block, kept: Iterable[complex], T: float) -> Block:
    """A block of as many zeros as poles by Tustin's rule, in w.

    A zero among ``kept``, and a pole on the imaginary axis, which the controller has too, moves to exp(s T) instead.
    """
    kept = {*kept, *(pole for pole in block.poles if not pole.real)}

    def moved(roots: Sequence[complex]) -> tuple[tuple[complex, ...], complex]:
        factors = [1.0 if root in kept else 1 - root * T / 2 for root in roots]
        if min(np.abs(factors), default=1.0) < 1e-12:
            raise InputError(f"theta1~ has a root at {2 / T:.6g} rad/s, twice the rate; expected another rate")
        there = (image(root, T) if root in kept else root / by for root, by in zip(roots, factors, strict=True))
        return tuple(there), complex(np.prod(factors))

    (zeros, above), (poles, below) = moved(block.zeros), moved(block.poles)
    return Block(block.gain * (above / below).real, zeros, poles)


def _sampled(system: StateSpace, first: Sequence[int], T: float) -> SampledBlock:
    """The system in w as difference equations, each output late by whole samples."""
    count = len(first)
    return SampledBlock(
        A=np.eye(len(system.b)) + T * system.A,
        b=T * system.b,
        C=system.C,
        d=system.d,
        first=np.array(first),
        length=np.ones(count, dtype=int),
        taps=np.ones((count, 1)),
    )
