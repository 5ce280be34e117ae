"""A lower bound for the peak error in every half period of a sinusoid, for a plant with one integrator."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from experiments.physical_limits.certificates import Samples, forced, whole
from experiments.physical_limits.exact_chain import fastest
from experiments.physical_limits.peak_program import PHASE
from experiments.physical_limits.response_cells import UNIT, Cells
from experiments.runs.references import sinusoid
from identification.model.plant import PlantModel

RAMP_S = 0.1  # long against the plant's slowest mode, short against the reference's period
SAMPLES = 100  # of the ramp, at least
HISTORY_S = 16.0  # the plant's modes have died out by then


def least_peak_error(plant: PlantModel, limit: float, amplitude: float, omega: float) -> float:
    """A lower bound for the peak of |r - y| in every half period, whatever the controller and the time since its start.

    Parameters
    ----------
    plant
        With one integrator, in any state; a dead time makes no difference.
    limit
        |u| <= limit at the plant's input at all times.
    amplitude, omega
        Of the sinusoidal reference, omega in rad/s.

    Returns
    -------
    float
        In the unit of the output; a bound with all roundings included, see
        :func:`experiments.physical_limits.certificates.forced`.

    Notes
    -----
    Let phi be a window around the steepest point of r, rising from 0 to 1 and falling back, and w(tau) the
    integral of phi(t) r_0(t - tau), r_0 being the impulse response of R_0 = P s/K. Then, with e = r - y,

        integral phi r' - K integral w u = integral phi e' = -integral phi' e <= 2 max |e|,

    and integral w u <= limit ||w||_1. The window is as wide as r' exceeds K limit, with edges so smooth that R_0
    hardly changes it: with a sharp window the modes' ringing would make ||w||_1 large and the bound useless. Here -phi'
    are weights at the ends of cells, and what lies more than :data:`HISTORY_S` before is bounded.
    """
    half_width = math.acos(min(1.0, abs(plant.gain) * limit / (amplitude * omega))) / omega
    span_s = half_width + RAMP_S / 2 + HISTORY_S
    count = math.ceil(span_s * max(fastest(plant) / PHASE, SAMPLES / RAMP_S))
    time_s = (np.arange(count + 1) - count) * (span_s / count) + half_width + RAMP_S / 2
    edges = np.append(time_s, time_s[-1] + span_s / count) - span_s / count / 2
    phase = np.clip((np.abs(edges) - half_width) / RAMP_S + 0.5, 0, 1)
    weights = whole(-np.diff((1 + np.cos(np.pi * phase)) / 2) / 2, centred=True)
    rising = sinusoid(amplitude, omega, 0.0, 0.0)
    r = Samples(rising(time_s) / amplitude, rising.rounding(2 * span_s) / amplitude + UNIT, 0.0)
    cells = Cells(plant, Fraction(span_s) / count, count, "ever")
    return amplitude * max(0.0, forced(cells, weights, r, limit / amplitude * (1 + UNIT))) * (1 - UNIT)
