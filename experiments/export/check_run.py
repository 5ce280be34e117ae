"""The run on which an export of a controller is checked; and the same steps in any precision."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from design.design_file import Design
from experiments.drive.sampled_loop import Drive, simulate_sampled
from experiments.export.controller import SampledController
from experiments.runs.references import Reference
from identification.base.arrays import Array

SAMPLES = 1000  # and at least MEMORIES times what the controller remembers
MEMORIES = 3
PERIODS = 2  # of the reference
BEYOND = 2.0  # times the farther limit, the control without limits
HUGE = 1e100  # a limit beyond which no run is taken


@dataclass(frozen=True)
class CheckRun:
    """What a controller gets and gives, sample by sample from rest, all shape (s,).

    Parameters
    ----------
    rate_hz
        Samples a second.
    reference, measurement
        What it gets.
    control, command
        What it asks for, and that within the limits.
    """

    rate_hz: float
    reference: np.ndarray
    measurement: np.ndarray
    control: np.ndarray
    command: np.ndarray

    @property
    def saturates(self) -> bool:
        """Whether the control goes beyond the limits."""
        return bool(np.any(self.control != self.command))

    def csv(self) -> str:
        """The samples as CSV; as many digits as tell every double from its neighbours."""
        lines = ["time_s,reference,measurement,unsaturated_command,command"]
        columns = (self.reference, self.measurement, self.control, self.command)
        for k, row in enumerate(zip(*(column.tolist() for column in columns), strict=True)):
            lines.append(",".join(map(repr, (k / self.rate_hz, *row))))
        return "\n".join(lines) + "\n"


def check_run(design: Design, controller: SampledController) -> CheckRun:
    """A run of the sampled loop from rest, under a cosine that takes the control beyond the limits.

    Where both limits are beyond :data:`HUGE`, the cosine is 1 and nothing saturates.

    Parameters
    ----------
    design
        That the controller was made of.
    controller
        See :func:`experiments.export.controller.sampled_controller`.

    Raises
    ------
    InputError, DivergenceError
        As :func:`experiments.drive.sampled_loop.simulate_sampled`.
    """
    samples = max(SAMPLES, MEMORIES * controller.remembered)
    until_s, omega = samples / controller.rate_hz, 2 * math.pi * PERIODS * controller.rate_hz / samples

    def run(amplitude: float, limits: tuple[float, float]) -> tuple[np.ndarray, ...]:
        reference = Reference((amplitude,), (omega,), (math.pi / 2,), 0.0)
        drive = Drive(controller.rate_hz, controller.method, limits)
        found = simulate_sampled(design, reference, controller.anti_windup, drive, until_s)
        return found.reference[:samples], found.output[:samples], found.control[:samples]

    _, _, free = run(1.0, (-math.inf, math.inf))
    farther = max((abs(limit) for limit in controller.limits if abs(limit) < HUGE), default=0.0)
    largest = float(np.abs(free).max())
    amplitude = BEYOND * farther / largest if farther > 0 and largest > 0 else 1.0
    reference, measurement, control = run(amplitude, controller.limits)
    return CheckRun(controller.rate_hz, reference, measurement, control, np.clip(control, *controller.limits))


def commands(
    controller: SampledController, reference: np.ndarray, measurement: np.ndarray, kind: type[np.floating]
) -> tuple[np.ndarray, np.ndarray]:
    """What a controller asks for and commands from rest, every number and operation of one floating-point kind.

    Parameters
    ----------
    controller
        Its equations, rounded to ``kind`` first.
    reference, measurement
        Shape (s,).
    kind
        numpy.float32 or numpy.float64.

    Returns
    -------
    control, command : ndarray, shape (s,)
        Sums from the left to the right, as the C code takes them.
    """

    def rounded(values: object) -> Array:
        return np.asarray(values, dtype=kind)

    def rows(A: Array, x: Array) -> Array:
        terms = np.concatenate([np.zeros((len(A), 1), kind), A * x], axis=1)
        return np.add.accumulate(terms, axis=1)[:, -1]  # one by one, unlike sum

    blocks = (controller.forward, controller.feedback, controller.theta)
    matrices = [tuple(map(rounded, (block.A, block.b, block.C, block.d, block.taps))) for block in blocks]
    (A_K, b_K, C_K, d_K, _), (A_T, b_T, C_T, d_T, taps_T), (A_w, b_w, C_w, d_w, taps_w) = matrices
    rest, share = rounded(1 - controller.around), rounded(1 + controller.theta.d[0] + controller.through)
    own, through, direct = map(
        rounded, (controller.theta.d[0] + controller.through, controller.through, controller.direct)
    )
    low, high = map(rounded, controller.limits)
    r, y = rounded(reference), rounded(measurement)
    x_K, x_T, x_w = (np.zeros(len(block.b), kind) for block in blocks)
    p_T, p_w = np.zeros((len(d_T), len(r)), kind), np.zeros((1, len(r)), kind)
    control, smallest = np.zeros(len(r), kind), np.finfo(kind).tiny

    def late(taps: Array, first: int, length: int, p: Array, k: int) -> Any:
        last = k - first
        count = min(length, last + 1)
        if count < 1:
            return kind(0)
        past = p[last - count + 1 : last + 1][::-1]
        return rows(taps[None, :count], past)[0]

    for k in range(len(r)):
        p_w[0, k] = rows(C_w, x_w)[1]
        e = r[k] - y[k] - late(taps_w[1], controller.theta.first[1], controller.theta.length[1], p_w[0], k)
        v = rows(C_K, x_K)[0] + d_K[0] * e
        p_T[:, k] = rows(C_T, x_T)
        for o in range(len(d_T)):
            v = v + late(taps_T[o], controller.feedback.first[o], controller.feedback.length[o], p_T[o], k)
        v = v / rest
        u_0 = v - rows(C_w, x_w)[0]
        u_tilde = (u_0 - np.clip(u_0, low, high)) / share
        v, e = v - through * u_tilde, e - direct * u_tilde
        control[k] = u_0 - own * u_tilde
        p_T[:, k] += d_T * v
        p_w[0, k] += d_w[1] * u_tilde
        following = rows(A_K, x_K) + b_K * e, rows(A_T, x_T) + b_T * v, rows(A_w, x_w) + b_w * u_tilde
        x_K, x_T, x_w = (np.where(np.abs(x) < smallest, kind(0), x) for x in following)
    return control, np.clip(control, low, high)
