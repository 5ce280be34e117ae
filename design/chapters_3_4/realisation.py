"""C = K/(1 - T_so T_si) without hidden modes: a quotient of two stable factors, one with a memory of the dead time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import factorial

import numpy as np
from flint import acb, arb, arb_poly

from design.blocks.ball import decided, from_roots, number, polynomial_roots
from design.blocks.block import Block, plant_block
from design.chapters_3_4.tracking import Taylor, interpolating
from design.design_file import Design
from design.parameters import ExtendedParameters
from identification.base.arrays import Complex, Real
from identification.base.errors import InputError


@dataclass(frozen=True)
class CoprimeForm:
    """C = forward/(1 - rest - through Phi), all four stable, Phi = (exp(-delay_s s) - E)/prod(s - p_i).

    Parameters
    ----------
    forward
        T_so/(P_o g) with g = prod(s - p_i)/(s + a)^q, the p_i being the plant's poles in Re s >= 0.
    rest
        1 - (1 - T_so B E)/g, proper and without dead time.
    through
        T_so B (s + a)^q.
    anchors
        The p_i in rad/s, q of them.
    E
        Coefficients of the polynomial of least degree that is exp(-delay_s s) at the p_i, the highest power first;
        none where there are no p_i, and Phi is the dead time itself.
    delay_s
        In seconds.

    Notes
    -----
    As drawn in Fig. 2.6, K and 1/(1 - T_so T_si) have the p_i as zeros and poles: what enters between the two, the
    rounding of a computer or states that do not start at rest, makes y drift as its integral, its double integral with
    two integrators, or exponentially. Here 1 - T_so T_si is divided by g before it is inverted. Phi has the impulse
    response -c exp(A tau) b on [0, delay_s] and none after it, see :meth:`kernel`, so that a finite memory realises it:
    for one integrator (1 - exp(-h s))/s, the block of Thesis Eq. (3.2).
    """

    forward: Block
    rest: Block
    through: Block
    anchors: tuple[complex, ...]
    E: tuple[float, ...]
    delay_s: float

    def kernel(self) -> tuple[Real, Real, Real]:
        """A (q, q), b (q,), c (q,) of the impulse response c exp(A tau) b of Phi on 0 <= tau <= delay_s."""
        q = len(self.anchors)
        A = np.eye(q, k=1)
        if q:
            A[-1] = -np.real(np.poly(self.anchors))[:0:-1]
        return A, np.eye(q)[:, -1] if q else np.zeros(0), -np.array(self.E)[::-1]

    def __call__(self, s: Complex) -> Complex:
        """C at complex frequencies (any shape, rad/s) other than the p_i."""
        s = np.asarray(s, dtype=complex)
        late = np.exp(-self.delay_s * s)
        if self.anchors:
            late = (late - np.polyval(self.E, s)) / np.prod(s[..., None] - np.array(self.anchors), axis=-1)
        return np.asarray(self.forward(s) / (1 - self.rest(s) - self.through(s) * late))


def coprime_form(K: Block, T: Block, anchors: tuple[complex, ...], a: float, late: Taylor | None = None) -> CoprimeForm:
    """The realisation of C = K/(1 - T) without hidden modes.

    Parameters
    ----------
    K
        T_so/P_o, which has the anchors as zeros.
    T
        T_so T_si with its dead time: 1 at every anchor, as often as it is one, and as many poles more than zeros as
        there are anchors.
    anchors
        The plant's poles in Re s >= 0, rad/s.
    a
        T has as many poles at -a as there are anchors, rad/s.
    late
        Of another dead time than exp(-h s), such as one in samples, the Taylor coefficients at a point; T is then
        given without it, and ``through`` may be improper.

    Raises
    ------
    InputError
        K, T and the anchors do not belong together.
    """
    q = len(anchors)
    shared = Block(1.0, (complex(-a),) * q)
    forward = K * shared * Block(1.0, (), anchors)
    through = T.without_delay() * shared
    if any(anchor in forward.poles for anchor in anchors) or (late is None and through.relative_degree < 0):
        raise InputError(
            "the blocks K and T do not belong to the plant; expected a design that 'python -m design extended' wrote"
        )
    if not q:
        return CoprimeForm(forward, Block(0.0), through, (), (), T.delay_s)
    points = [(anchor, anchors.count(anchor)) for anchor in dict.fromkeys(anchors)]
    E = interpolating(points, late or partial(_exponential, T.delay_s), 1.0)
    rest = decided(lambda: _rest(through, anchors, a, E))
    if rest is None:
        raise InputError("rounding errors exceed the controller's stable factors; expected other poles of T_so")
    return CoprimeForm(forward, rest, through, anchors, tuple(float(e) for e in reversed(E)), T.delay_s)


def _exponential(delay_s: float, point: acb, terms: int) -> list[acb]:
    """The first Taylor coefficients of exp(-h s) at a point."""
    delay = arb(delay_s)
    return [(-delay * point).exp() * (-delay) ** j / factorial(j) for j in range(terms)]


def _rest(through: Block, anchors: tuple[complex, ...], a: float, E: list[arb]) -> Block:
    """[(prod(s - p_i) - (s + a)^q) d + n E]/(prod(s - p_i) d) with through = n/d: p_i divide the numerator."""
    unit = 2.0 ** round(np.log2(np.mean(np.abs(through.poles)) if through.poles else a))

    def scaled(roots: tuple[complex, ...]) -> arb_poly:
        return from_roots(number(root) / unit for root in roots if root.imag >= 0)

    g_0, d = scaled(anchors), scaled(through.poles)
    n = arb(through.gain) * scaled(through.zeros) * arb(unit) ** (-through.relative_degree - len(anchors))
    interpolating = arb_poly([e * arb(unit) ** k for k, e in enumerate(E)])
    quotient, _ = divmod((g_0 - scaled((complex(-a),) * len(anchors))) * d + n * interpolating, g_0)
    coefficients = quotient.coeffs()
    zeros = tuple(complex(root * unit) for root in polynomial_roots(quotient))
    relative = len(through.poles) - (len(coefficients) - 1)
    return Block(float(coefficients[-1] * arb(unit) ** relative), zeros, through.poles)


def realised(design: Design) -> CoprimeForm:
    """A design's controller as a computer is to run it; that of chapter 2, which has no dead time inside, as it is.

    Raises
    ------
    InputError
        As :func:`coprime_form`.
    """
    forward, feedback = design.controller_parts()
    if not isinstance(design.parameters, ExtendedParameters):
        return CoprimeForm(forward, Block(0.0), feedback, (), (), 0.0)
    anchors = plant_block(design.plant).unstable_poles
    T = feedback * Block(1.0, (), (), design.plant.delay_s)
    return coprime_form(forward, T, anchors, design.parameters.a)
