"""The frequency response of a block's difference equations, as their class states them."""

from __future__ import annotations

import numpy as np

from experiments.drive.difference_equations import SampledBlock


def response(block: SampledBlock, z: np.ndarray) -> np.ndarray:
    """w(z)/i(z) at points z (s,) off the poles: shape (s, m)."""
    identity, lag = np.eye(len(block.b)), 1 / z[:, None]
    states = np.array([np.linalg.solve(point * identity - block.A, block.b) for point in z]).reshape(len(z), -1)
    used = np.arange(block.taps.shape[1]) < block.length[:, None]
    memory = lag[:, :, None] ** np.arange(block.taps.shape[1]) * (used * block.taps)  # (s, m, t)
    return (states @ block.C.T + block.d) * memory.sum(axis=2) * lag**block.first
