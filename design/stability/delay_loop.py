"""A loop with its exact dead times: its characteristic function, and which of its roots are hidden."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.blocks.block import Block
from design.stability.coprime import Terms, common_denominator
from identification.base.errors import InputError

SAME_GAIN = 1e-12  # relative difference of two gains that are the same but for rounding


@dataclass(frozen=True)
class DelayLoop:
    """y = P u, u = forward (r - y) + feedback exp(-delay_s s) u: C = forward/(1 - feedback exp(-delay_s s)).

    Parameters
    ----------
    plant
        P with its own dead time, which may differ from the controller's.
    forward, feedback
        K and T_so of chapters 3 and 4, Thesis Eq. (3.31); C and 0 in chapter 2. Without dead time.
    delay_s
        The dead time in seconds inside the controller.
    held
        Poles of the plant that the controller holds though K is zero there, see
        :mod:`design.chapters_3_4.realisation`: they are not hidden.

    Raises InputError for a dead time where none belongs, an improper forward, or an algebraic loop.

    Notes
    -----
    With all three blocks realised the characteristic function is

        d_P d_forward d_feedback (1 - feedback exp(-delay_s s) + P forward).

    What divides it whatever the dead times is *hidden*: a pole of the plant that is a zero of the controller, or
    the other way round, and poles that forward and feedback share, which are realised twice.
    """

    plant: Block
    forward: Block
    feedback: Block
    delay_s: float
    held: tuple[complex, ...] = ()

    def __post_init__(self) -> None:
        if self.forward.delay_s or self.feedback.delay_s or not 0 <= self.delay_s < np.inf:
            raise InputError(
                f"forward and feedback have the dead times {self.forward.delay_s:g} s and {self.feedback.delay_s:g} s, "
                f"the controller has {self.delay_s:g} s; expected 0, 0, and zero or more"
            )
        blocks = {"forward": (self.forward, 0), "the plant times forward": (self.open_loop, 1)}
        for name, (block, least) in (blocks | {"feedback": (self.feedback, 1 if self.feedback.gain else 0)}).items():
            if block.relative_degree < least:
                raise InputError(
                    f"{name} has {len(block.zeros)} zeros and {len(block.poles)} poles; expected at least {least} "
                    "more poles than zeros, since the loop is algebraic otherwise"
                )

    @property
    def open_loop(self) -> Block:
        """P forward with P's dead time; equal poles and zeros have cancelled."""
        return self.plant * self.forward

    @property
    def inner_loop(self) -> Block:
        """-feedback exp(-delay_s s); equal poles and zeros have cancelled."""
        return self.feedback * Block(-1.0, (), (), self.delay_s)

    @property
    def is_predicted(self) -> bool:
        """Whether P forward is feedback exp(-delay_s s), as in a Smith predictor: then no dead time moves a root.

        Dead time, zeros and poles are the same numbers and the gains differ by no more than their rounding.
        """
        given, model = self.open_loop, self.feedback
        same = (given.delay_s, given.zeros, given.poles) == (self.delay_s, model.zeros, model.poles)
        return same and abs(given.gain - model.gain) <= SAME_GAIN * abs(model.gain)

    @property
    def denominator(self) -> Block:
        """The least common denominator of the two, a polynomial block."""
        return common_denominator(self.open_loop, self.inner_loop)

    @property
    def characteristic(self) -> Terms:
        """Characteristic function (3.12), (3.5), (3.27), no hidden roots: three polynomials, two of them delayed."""
        return self.denominator, self.inner_loop * self.denominator, self.open_loop * self.denominator

    @property
    def hidden(self) -> tuple[complex, ...]:
        """The hidden roots, exactly, with their multiplicities."""
        roots = list(self.plant.poles + self.forward.poles + self.feedback.poles)
        for root in (*self.denominator.zeros, *self.held):
            roots.remove(root)
        return tuple(roots)
