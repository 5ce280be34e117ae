"""A record as a converter and a sampler make it: the response to a held input, states advanced exactly."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm
from scipy.signal import tf2ss

from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.pulse_response import hold, pulse_response

Real = NDArray[np.float64]
PLANTS = {
    "integrator": PlantModel(3.0, (Mode(300.0, 0.05),), (Mode(450.0, 0.01),), 4.3e-3),
    "no integrator, real pole": PlantModel(2.0, (), (Mode(200.0, 0.02),), 1.25e-3, 0, (), (30.0,)),
    "two integrators": PlantModel(200.0, (Mode(100.0, 0.02),), (Mode(150.0, 0.01),), 12.3e-3, 2, (), (900.0,)),
    "as many zeros as poles": PlantModel(2.0, (Mode(200.0, 0.02),), (Mode(150.0, 0.03),), 12.7e-3, 0, (60.0,), (20.0,)),
    "half a second late": PlantModel(-2.0, (), (Mode(150.0, 0.03),), 0.5003, 1),
}


def over_hold(plant: PlantModel, sampling_s: float, omega: Real) -> NDArray[np.complex128]:
    """What a held record's response is but for noise: P and its aliases."""
    return pulse_response(plant, sampling_s, omega) / hold(omega, sampling_s)


def held_response(plant: PlantModel, sampling_s: float, u: Real) -> Real:
    """Output (N,) at the samples for commands ``u`` (N,), each held for an interval; at rest before."""
    a, b, c, d = _state_space(plant)
    generator = np.block([[a, b], [np.zeros((1, len(a) + 1))]])
    whole = math.ceil(plant.delay_s / sampling_s - 1e-9)
    early = max(0.0, whole * sampling_s - plant.delay_s)
    step, output = expm(generator * sampling_s), np.append(c, d) @ expm(generator * early)
    w, y = np.zeros(len(a) + 1), np.zeros(u.size)
    for k in range(u.size - whole):
        w[-1] = u[k]
        y[k + whole] = output @ w
        w = step @ w
    return y


def _state_space(plant: PlantModel) -> tuple[Real, Real, Real, float]:
    """A, B, C and D of the plant without its delay by partial fractions; the poles are distinct but for 0."""
    zeros = [root for mode in plant.zero_modes for root in mode.roots] + [-rate for rate in plant.real_zeros]
    pairs = [mode.roots for mode in plant.pole_modes] + [(-rate,) for rate in plant.real_poles]
    pairs += [(0.0,) * plant.integrators] if plant.integrators else []
    poles = [pole for pair in pairs for pole in pair]
    size = plant.gain * np.prod([-1 / zero for zero in zeros]) * np.prod([-pole for pole in poles if pole])

    def others(s: complex, own: tuple[complex, ...]) -> complex:
        return complex(np.prod([s - z for z in zeros]) / np.prod([s - p for p in poles if p not in own]))

    blocks = []
    for pair in pairs:
        if pair == (0.0, 0.0):
            at_zero = others(0.0, pair)
            slope = at_zero * (sum(1 / p for p in poles if p) - sum(1 / z for z in zeros))
            numerator = size * np.array([slope, at_zero])
        else:
            parts = [others(p, pair) / np.prod([p - q for q in pair if q != p]) for p in pair]
            numerator = size * sum(r * np.poly([q for q in pair if q != p]) for r, p in zip(parts, pair, strict=True))
        blocks.append(tf2ss(np.real(np.atleast_1d(numerator)), np.real(np.poly(pair))))
    direct = float(np.real(size)) if len(zeros) == len(poles) else 0.0
    a, b, c = block_diag(*(x[0] for x in blocks)), np.vstack([x[1] for x in blocks]), np.hstack([x[2] for x in blocks])
    return a, b, c, direct
