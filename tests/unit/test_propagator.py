"""The tables of a step against matrix exponentials, and the mesh's polynomials against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from experiments.engine.crossings import leaves_mode
from experiments.engine.kinks import insert, largest_difference, shift
from experiments.engine.step_table import advance, compressed, tabulate

STEP = 0.3


def system(seed: int, n: int = 5, k: int = 2) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    A = 3 * random.standard_normal((n, n)) * (random.random((n, n)) < 0.6)
    return A, random.standard_normal(n), random.standard_normal((n, k)), random.standard_normal((3, n + 1 + k))


def z_of(x0: np.ndarray, m: float, w: np.ndarray, columns: int) -> np.ndarray:
    """(x_0, m, w_0, w_1, ...) filled up with zeros."""
    z = np.zeros(columns)
    given = np.concatenate([x0, [m], w.reshape(-1)])
    z[: len(given)] = given
    return z


@pytest.mark.parametrize("seed", range(5))
def test_a_tabulated_step_is_the_matrix_exponential_and_the_integral(seed: int) -> None:
    A, B, D, signals = system(seed)
    n, k = D.shape
    random = np.random.default_rng(100 + seed)
    x0, m, w = random.standard_normal(n), 0.7, random.standard_normal((4, k))
    rows = compressed(np.vstack([np.hstack([A, B[:, None], D]), signals]))
    tables, degree = tabulate(rows, n, k, STEP)
    increments, polynomials = tables.increments, tables.polynomials
    z = z_of(x0, m, w, increments.shape[1])

    def right_side(t: float, x: np.ndarray) -> np.ndarray:
        return A @ x + B * m + D @ sum(c * (t / STEP) ** i for i, c in enumerate(w))

    exact = solve_ivp(right_side, (0, STEP), x0, method="DOP853", rtol=1e-13, atol=1e-13, dense_output=True)
    scale = np.abs(exact.y).max()
    np.testing.assert_allclose(x0 + increments @ z, exact.y[:, -1], rtol=0, atol=1e-11 * scale)
    coefficients = (polynomials @ z).reshape(degree + 1, len(signals))
    for tau in (0.0, 0.35, 1.0):
        x, now = exact.sol(tau * STEP), sum(c * tau**i for i, c in enumerate(w))
        wanted = signals @ np.concatenate([x, [m], now])
        found = sum(c * tau**i for i, c in enumerate(coefficients))
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-10 * scale)
    # a free system alone: the exponential to rounding
    free = expm(A * STEP)
    np.testing.assert_allclose(np.eye(n) + increments[:, :n], free, rtol=0, atol=1e-13 * np.abs(free).max())


@pytest.mark.parametrize("reach", [0.1, 0.8, 1.0])
def test_a_cut_step_is_the_tabulated_one_of_its_length(reach: float) -> None:
    A, B, D, signals = system(7)
    n, k = D.shape
    random = np.random.default_rng(8)
    x0, m, w = random.standard_normal(n), -0.4, random.standard_normal((3, k))
    rows = compressed(np.vstack([np.hstack([A, B[:, None], D]), signals]))
    influence = tabulate(rows, n, k, STEP)[0].influence[len(signals) :]
    shorter = tabulate(rows, n, k, reach * STEP)[0].increments
    scaled = w * reach ** np.arange(3)[:, None]
    V, x = np.zeros((41, n + 1 + k)), np.zeros(n)
    V[0, :n], V[0, n] = x0, m
    V[:3, n + 1 :] = w
    advance(rows, 0, influence, V, n, 2, 40, np.ones(n), STEP, reach, x)
    np.testing.assert_allclose(x, x0 + shorter @ z_of(x0, m, scaled, shorter.shape[1]), rtol=0, atol=1e-12)


def test_integrators_that_only_delayed_signals_drive_are_tabulated_to_a_high_degree() -> None:
    # x' = w has no response of its own beyond degree one, yet w may be of any degree
    rows = compressed(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]))
    tables, degree = tabulate(rows, 1, 1, 2.0)
    increments = tables.increments
    assert degree >= 20
    # the last one's integral is of one degree more, which the table ends before
    np.testing.assert_allclose(increments[0, 2:-1], 2.0 / np.arange(1, degree + 1), rtol=1e-15)


def test_a_series_that_does_not_end_is_said() -> None:
    assert tabulate(compressed(np.array([[-300.0, 1.0]])), 1, 0, 1.0)[1] == -1


@pytest.mark.parametrize("delta", [-0.4, 1e-9, 0.9])
def test_a_shifted_polynomial_is_the_same_polynomial(delta: float) -> None:
    c = np.random.default_rng(3).standard_normal(24)
    shifted = c.copy()
    shift(shifted, 23, delta, np.zeros((2, 24)))
    tau = np.linspace(-0.3, 0.3, 7)
    np.testing.assert_allclose(
        np.polynomial.polynomial.polyval(tau, shifted), np.polynomial.polynomial.polyval(tau + delta, c), rtol=1e-11
    )


def test_the_gap_is_the_difference_half_a_step_around() -> None:
    left, right = np.array([1.0, 2.0, 0.5]), np.array([1.0 + 2 * 0.2 + 0.5 * 0.04, 2.0 + 0.2, 0.5])
    assert largest_difference(left.copy(), 2, 0.2, right, 2, 0.5, np.zeros((2, 3))) < 1e-15
    right[1] += 1e-6  # a kink
    assert largest_difference(left.copy(), 2, 0.2, right, 2, 0.5, np.zeros((2, 3))) == pytest.approx(0.5e-6)


def test_the_queue_is_sorted_and_holds_a_time_once() -> None:
    queue, queued = np.zeros(8), 0
    for t in (3.0, 1.0, 2.0, 2.0 + 1e-14, 1.0 - 1e-14, 0.5):
        queued = insert(queue, queued, t, 1e-13)
    np.testing.assert_array_equal(queue[:queued], [0.5, 1.0, 2.0, 3.0])


def test_a_control_that_jumps_over_a_limit_leaves_its_mode_at_once() -> None:
    U = np.array([-9.0, 0.1, 0.0])
    assert leaves_mode(U, 2, 1, 0, False, -1.0, 1.0, 1.0) == (0.0, 0, 0)
    assert leaves_mode(U, 2, 0, 0, False, -1.0, 1.0, 1.0) == (0.0, -1, 0)
    assert leaves_mode(U, 2, -1, 0, False, -1.0, 1.0, 1.0) == (-1.0, -1, 0)
