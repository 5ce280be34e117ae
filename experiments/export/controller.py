"""The controller that a computer runs, with its anti-windup, as data that every export writes down in its own form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.design_file import Design
from experiments.drive.difference_equations import SampledBlock
from experiments.drive.sampled_loop import Drive, controller_blocks
from experiments.runs.guarantee import Guarantee, guarantee, sector_text
from identification.model.signals import Signals

RESTS = 1e-9  # of the largest number of a standing state's equations: a smaller singular value is 0


@dataclass(frozen=True)
class Standing:
    """The state in which the controller stands still, a constant applied for ever, for a start without a bump.

    Parameters
    ----------
    forward
        Shape (n,): the state of ``forward`` under a constant error, for what it then adds to v beyond d times the error
        of the sample, which is 1. All 0 where no constant error leaves anything of it: then no state starts it.
    feedback, memories
        Shapes (n,), (m,): the state of ``feedback``, and what each of its memories holds, under v = 1.
    """

    forward: np.ndarray
    feedback: np.ndarray
    memories: np.ndarray

    @property
    def is_bumpless(self) -> bool:
        """Whether the first command can be given; a controller without memory of its error has its command at once."""
        return bool(np.any(self.forward))


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
        One of :data:`experiments.drive.difference_equations.METHODS`.
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
        Of ``feedback``: x = A x + b, one solution, since every pole of it is inside the unit circle. Of ``forward``:
        x = A x + b e' and C x = 1 for the unknown x and e', which is one linear system and has a solution also where
        ``forward`` integrates: then e' = 0. A start scales it so that the first command is what is applied. With
        e' = reference - measurement the whole controller stands still; else it starts as if the error, which had been
        e' for ever, became reference - measurement at the first sample.
        """
        A, b, C = self.feedback.A, self.feedback.b, self.feedback.C
        x = np.linalg.solve(np.eye(len(b)) - A, b)
        A_K, b_K, c_K = self.forward.A, self.forward.b, self.forward.C[0]
        n = len(b_K)
        equations = np.block([[np.eye(n) - A_K, -b_K[:, None]], [c_K[None], np.zeros((1, 1))]])
        scales = 1 / np.maximum(np.abs(equations).max(axis=1), np.finfo(float).tiny)
        size = np.linalg.svd(scales[:, None] * equations, compute_uv=False)
        forward = np.zeros(n)
        if n and size[-1] > RESTS * size[0]:
            forward = np.linalg.solve(equations, np.eye(n + 1)[-1])[:n]
        return Standing(forward, x, C @ x + self.feedback.d)


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
        equations to have one solution.
    """
    drive = Drive(rate_hz, method, limits)
    kind = design.chosen(anti_windup)
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
        return f"no guarantee: {given.missing}"
    covered = "whatever the control"
    if given.sector < 1:
        covered = f"of runs that need a smaller sector than {sector_text(given.sector)}"
    return (
        f"in continuous time the windup ends {covered}, if the reference takes a control within the limits; of the "
        "sampled loop nothing is proved"
    )
