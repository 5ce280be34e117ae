"""The controller that a computer runs, with its anti-windup, as data that every export writes down in its own form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.design_file import Design
from experiments.drive.difference_equations import SampledBlock
from experiments.drive.sampled_loop import Drive, controller_blocks
from experiments.runs.guarantee import Guarantee, guarantee
from experiments.runs.words import sector_text
from identification.base.errors import InputError
from identification.model.signals import Signals

INTEGRATES = 1e-11  # of the largest singular value of 1 - A: with a smaller one a block integrates
MOST_LATE = 2**15 - 8  # samples of dead time
UNSEEN = 1e-9  # of the product of two vectors' lengths: less is 0


@dataclass(frozen=True)
class Standing:
    """The state that starts a controller without a bump: it stands still but for one mode, the slowest.

    Parameters
    ----------
    forward
        Shape (n,): the state of ``forward`` that stands still under the error 1.
    slowest
        Shape (n,): of its states that give 1, the one that changes least, by the mode whose pole is nearest to 1. None
        where no state gives anything: the first command is then that of the reference and the measurement.
    feedback, memories
        Shapes (n,), (m,): the state of ``feedback`` that stands still, and what its memories hold, under v = 1.
    """

    forward: np.ndarray
    slowest: np.ndarray | None
    feedback: np.ndarray
    memories: np.ndarray


@dataclass(frozen=True)
class SampledController:
    """Difference equations of a controller without hidden modes, its anti-windup and its limits.

    At each sample, with the blocks as :class:`experiments.drive.difference_equations.SampledBlock` states them,

        e       = reference - measurement - (what the memory of theta's second output gives of earlier samples)
        v       = (C x + d e of forward + sum of what feedback's memories give of earlier samples)/(1 - around)
        u_0     = v - (C x of theta's first output)
        u_tilde = (u_0 - sat(u_0))/(1 + theta.d[0] + through)
        v       = v - through u_tilde,   e = e - direct u_tilde,   u = u_0 - (theta.d[0] + through) u_tilde,

    and then every block takes its input: forward e, feedback v, theta u_tilde. The command is sat(u), and
    u_tilde = u - sat(u).

    Parameters
    ----------
    name
        Of the controller, as the user gave it.
    rate_hz
        Samples a second.
    method
        One of :data:`experiments.drive.sampled_loop.METHODS`.
    limits
        (sigma_1, sigma_2) of the command; either may be infinite.
    anti_windup
        Its name; ``none`` is none.
    signals
        Names and units of the command (the plant's input) and of the measurement (its output).
    forward, feedback, theta
        From e to v; from v to what is added to v, the sum of its outputs; from u_tilde to what u gives up and to y_d,
        which is added to the measurement. The first output of ``theta`` and that of ``forward`` have no memory.
    around
        What ``feedback`` takes of v at the same sample.
    promise
        What the design guarantees of its saturated runs, a sentence without its full stop.
    """

    name: str
    rate_hz: float
    method: str
    limits: tuple[float, float]
    anti_windup: str
    signals: Signals
    forward: SampledBlock
    feedback: SampledBlock
    theta: SampledBlock
    around: float
    promise: str

    @property
    def direct(self) -> float:
        """What y_d takes of u_tilde at the same sample."""
        return float(self.theta.at_once[1])

    @property
    def through(self) -> float:
        """What v gives up of u_tilde at the same sample, by y_d."""
        return float(self.forward.d[0] * self.direct / (1 - self.around))

    @property
    def remembered(self) -> int:
        """How many samples the longest memory goes back, this one included; the length of a ring buffer for all."""
        return int(max(np.max(block.first + block.length) for block in (self.feedback, self.theta)))

    @property
    def standing(self) -> Standing:
        """The state that a start without a bump sets.

        Notes
        -----
        Every pole of ``feedback`` is inside the unit circle, so that one state stands still; where ``forward``
        integrates, none does under an error other than 0, and its integrators are left at 0. Of the mode with the poles
        q and conj(q) the state of output Re(beta q^k) has the output 1 at k = 0 and at k = 1 with
        beta = 1 + j Re(q - 1)/Im(q).
        """
        A, b, C, d = self.feedback.A, self.feedback.b, self.feedback.C, self.feedback.d
        feedback = np.linalg.solve(np.eye(len(b)) - A, b)
        A, b = self.forward.A, self.forward.b
        forward = np.linalg.pinv(np.eye(len(b)) - A, rcond=INTEGRATES) @ b
        return Standing(forward, _slowest(A, self.forward.C[0]), feedback, C @ feedback + d)


def _slowest(A: np.ndarray, c: np.ndarray) -> np.ndarray | None:
    """The state x with c x = 1 in the mode of A whose pole is nearest to 1, see :attr:`SampledController.standing`."""
    poles, modes = np.linalg.eig(A)
    seen = c @ modes
    for k in np.argsort(np.abs(poles - 1)):
        if abs(seen[k]) > UNSEEN * np.linalg.norm(c):
            q = complex(poles[k])
            beta = 1 + 1j * (q.real - 1) / q.imag if q.imag else 1.0
            return np.asarray(np.real(beta * modes[:, k] / seen[k]))
    return None


def sampled_controller(
    design: Design, anti_windup: str, limits: tuple[float, float], rate_hz: float, method: str, name: str
) -> SampledController:
    """The controller of a design as a computer is to run it.

    Parameters
    ----------
    design
        Of either kind.
    anti_windup
        ``none``, one that the design holds, or one of others, see :meth:`design.design_file.Design.chosen`.
    limits, rate_hz, method
        As of :class:`experiments.drive.sampled_loop.Drive`.
    name
        Of the controller.

    Raises
    ------
    InputError
        There is no such anti-windup; the limits, the rate or the method are none; or the rate is too low for the
        equations to have one solution, or so high that the dead time has more than :data:`MOST_LATE` samples.
    """
    drive = Drive(rate_hz, method, limits)
    kind, late = design.chosen(anti_windup), design.loop_plant.delay_s * rate_hz
    if late > MOST_LATE:
        raise InputError(
            f"at {rate_hz:g} Hz the dead time is {late:.6g} samples long; expected at most {MOST_LATE}, to which every "
            "int of C counts (a lower rate)"
        )
    forward, feedback, theta, around = controller_blocks(design, kind, drive, "coprime")
    return SampledController(
        name=name,
        rate_hz=rate_hz,
        method=method,
        limits=drive.limits,
        anti_windup=anti_windup,
        signals=design.signals,
        forward=forward,
        feedback=feedback,
        theta=theta,
        around=around,
        promise=_promise(guarantee(design, kind)),
    )


def _promise(given: Guarantee) -> str:
    """What is guaranteed of the saturated loop, in words."""
    if given.sector == 0:
        return f"No guarantee: {given.missing}"
    covered = "whatever the control"
    if given.sector < 1:
        covered = f"of runs that need a smaller sector than {sector_text(given.sector)}"
    return (
        f"In continuous time the windup ends {covered}, if the reference takes a control within the limits; of the "
        "sampled loop beyond its limits nothing is proved"
    )
