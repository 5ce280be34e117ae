"""The H-infinity synthesis against slycot's on a problem that slycot solves."""

from __future__ import annotations

from collections.abc import Callable

import control
import numpy as np

from design.block import Block
from design.delay_free import design_delay_free
from design.mixed_sensitivity import mixed_sensitivity
from design.realization import realize
from identification.model import read_model


def test_against_slycot(against: Callable[..., object]) -> None:
    G, W1, W2 = Block(2.0, (), (-1.0, -2.0)), Block(0.5, (-3.0,), (-0.05,)), Block(0.05, (-10.0, -20.0))
    joint, w1 = realize(G, W2 * G), realize(W1)
    n, m = len(joint.b), len(w1.b)
    A = np.block([[joint.A, np.zeros((n, m))], [-np.outer(w1.b, joint.C[0]), w1.A]])
    B = np.block([[np.zeros((n, 1)), joint.b[:, None]], [w1.b[:, None], np.zeros((m, 1))]])
    C = np.block([[-w1.d[0] * joint.C[:1], w1.C], [joint.C[1:], np.zeros((1, m))], [-joint.C[:1], np.zeros((1, m))]])
    D = np.array([[w1.d[0], 0.0], [0.0, joint.d[1]], [1.0, 0.0]])
    plant = control.ss(A, B, C, D)
    against(lambda: mixed_sensitivity(G, W1, W2, 1e-3), lambda: control.hinfsyn(plant, 1, 1))


def test_chapter_two(benchmark) -> None:  # type: ignore[no-untyped-def]
    """The whole delay-free design; slycot does not come back on it."""
    model = read_model("implied")
    benchmark(design_delay_free, model, 4.0, 1e-4)
