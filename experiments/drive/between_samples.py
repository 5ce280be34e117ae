"""The steady error of a linear loop on a computer between its samples, where a run at the samples does not look."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from design.design_file import Design
from experiments.drive.difference_equations import split
from experiments.drive.held_plant import held_plant
from experiments.drive.judge_loop import PAST, response
from experiments.drive.sampled_loop import FORMS, Drive, controller_blocks

PLACES = 8  # in a sample, beside the one at which the held input arrives


def error_between(design: Design, drive: Drive, amplitudes: Sequence[float], omegas: Sequence[float]) -> float:
    """The most that the error of a linear loop reaches in the steady state, at PLACES and at the kink of each sample.

    Parameters
    ----------
    design, drive
        As of :func:`experiments.drive.judge_loop.judge_loop`; the loop is stable.
    amplitudes, omegas
        Of the reference's sinusoids, rad/s; their errors are added as if they peaked together. A constant counts not:
        its error between the samples is that at them.

    Notes
    -----
    A share p of a sample before t_k the output is that of a plant with a dead time longer by p T, which the computer's
    u = forward/(1 - feedback + forward P_d z^-N) r drives: at the samples the modified z-transform says all of it.
    """
    T = 1 / drive.rate_hz
    forward, feedback, _, _ = controller_blocks(design, None, drive, FORMS[0])
    theta = np.array([omega * T * (1 + PAST) for omega in omegas if omega])
    sizes = np.array([abs(size) for size, omega in zip(amplitudes, omegas, strict=True) if omega])
    if not len(theta):
        return 0.0
    z, w = np.exp(1j * theta), np.expm1(1j * theta) / T
    _, rest = split(design.loop_plant.delay_s + drive.input_delay_s, T)
    shares, outputs = [*np.arange(PLACES) / PLACES, 1 - rest], []
    for share in shares:
        P_d, samples = held_plant(design.loop_plant, T, drive.input_delay_s + float(share) * T)
        outputs.append(P_d(w) * z**-samples)
    control = response(forward, z) / (1 - response(feedback, z) + response(forward, z) * outputs[0])
    errors = [abs(z**-share - output * control) @ sizes for share, output in zip(shares, outputs, strict=True)]
    return max(map(float, errors))
