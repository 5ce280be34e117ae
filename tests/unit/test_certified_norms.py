"""Norms and sectors over random rational functions: no frequency may contradict what is called proved."""

from __future__ import annotations

import numpy as np
import pytest
from flint import fmpq, fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from design.anti_windup.compensator import AntiWindup, from_one_plus, second_order
from design.anti_windup.popov import popov_sector
from design.blocks.block import Block
from design.blocks.frequency_peak import CERTIFIED, block_norm, frequency_grid, peak
from design.blocks.positivity import exact, not_positive_at, squared_magnitude
from identification.base.errors import InputError
from identification.model.modes import Mode

decades = st.floats(-2.0, 3.0)
units = st.floats(-9.0, 9.0)
factors = st.one_of(st.tuples(decades), st.tuples(decades, st.floats(-4.0, 0.0)))


def roots_of(drawn: list[tuple[float, ...]], unit: float) -> tuple[complex, ...]:
    """Stable roots: a real one of one number, a pair of two, the decades of omega and zeta."""
    found: list[complex] = []
    for numbers in drawn:
        omega = 10 ** (numbers[0] + unit)
        found += [complex(-omega)] if len(numbers) == 1 else Mode(omega, 10 ** numbers[1]).roots
    return tuple(found)


def dense(block: Block) -> np.ndarray:
    """Frequencies at which a claim about a block is tried, many times finer than those of any search."""
    grid = frequency_grid(block.zeros + block.poles, per_decade=3000)
    return np.concatenate([grid[[0]] * 1e-6, grid, grid[[-1]] * 1e6])


@settings(max_examples=60, deadline=None)
@given(
    st.lists(factors, min_size=1, max_size=4), st.lists(factors, min_size=1, max_size=4), units, st.floats(-15.0, 15.0)
)
def test_no_frequency_exceeds_a_proved_norm(
    zeros: list[tuple[float, ...]], poles: list[tuple[float, ...]], unit: float, gain: float
) -> None:
    above, below = roots_of(zeros, unit), roots_of(poles, unit)
    block = Block(10**gain, *sorted([above, below], key=len))
    value, omega = block_norm(block)
    assert np.max(np.abs(block(1j * dense(block)))) <= value * (1 + CERTIFIED)
    reached = abs(complex(block(1j * omega))) if np.isfinite(omega) else abs(block.gain)
    assert reached == pytest.approx(value, rel=1e-12)


def test_a_norm_that_is_the_limit_at_an_end() -> None:
    """A search that takes the ends of its grid for 0 and infinity errs by 5e-7 here."""
    low = Block(2.0, (), (-1 + 0j,))
    high = Block(3.0, (0j,), (-1 + 0j,))
    assert block_norm(low) == (2.0, 0.0)
    assert block_norm(high) == (3.0, np.inf)
    assert peak(lambda omega: np.abs(low(1j * omega)), low.poles)[0] < 2.0 * (1 - 1e-7)
    assert block_norm(Block(1.0, (), (1j, -1j))) == (np.inf, 1.0)


def test_the_search_finds_the_highest_of_many_peaks() -> None:
    """Nine equal resonances but for 1e-5: the five highest points of a grid need not be the five highest peaks."""
    modes = [Mode(10.0 * (1 + 0.3 * k), 0.001) for k in range(9)]
    damped = [root for mode in modes for root in Mode(mode.omega, 0.001 * 1.01).roots]
    block = Block(1.0, tuple(damped), tuple(root for mode in modes for root in mode.roots))
    expected = max(np.max(np.abs(block(1j * mode.omega * np.linspace(0.999, 1.001, 20001)))) for mode in modes)
    assert peak(lambda omega: np.abs(block(1j * omega)), block.poles)[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("margin", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_polynomial_that_almost_vanishes(margin: float) -> None:
    """(x - 2)^2 + margin^2 is positive, with - margin^2 it is not, and the double root is undecided."""
    square = fmpq_poly([-2, 1]) ** 2
    for sign, positive in ((1, True), (-1, False), (0, False)):
        found = not_positive_at((square + sign * exact(margin) ** 2) * fmpq_poly([1, 1]))
        assert (found is None) == positive
        if not positive:
            assert found == pytest.approx(2.0, abs=1.01 * margin + 1e-12)


def test_a_polynomial_that_is_negative_at_an_end() -> None:
    assert not_positive_at(fmpq_poly([-1, 1])) == 0.0
    assert not_positive_at(fmpq_poly([0, 1])) == 0.0
    assert not_positive_at(fmpq_poly([1, fmpq(-1, 10**40)])) == np.inf
    assert not_positive_at(fmpq_poly([1, 0])) is None
    assert not_positive_at(squared_magnitude([complex(-3e-8, 4e7), complex(-3e-8, -4e7), -1e20 + 0j])) is None


@settings(max_examples=80, deadline=None)
@given(
    st.lists(factors, min_size=1, max_size=3),
    st.lists(st.tuples(decades), min_size=7, max_size=7),
    st.booleans(),
    units,
)
def test_a_proved_sector_lies_just_below_the_true_one(
    zeros: list[tuple[float, ...]], poles: list[tuple[float, ...]], integrator: bool, unit: float
) -> None:
    above = roots_of(zeros, unit) + (0j,) * integrator
    kind = from_one_plus(Block(1.0, above, roots_of(poles[: len(above)], unit)))
    k, multiplier = popov_sector(kind.theta1_tilde)
    lowest = lowest_point(kind, multiplier)
    if np.isfinite(k):
        assert lowest + 1 / k > 0
        assert lowest + 1 / (k * (1 + 1e-6)) < 0
    else:
        assert lowest >= -1e-12 * np.max(np.abs(kind.theta1_tilde(1j * dense(kind.one_plus))))


def lowest_point(kind: AntiWindup, multiplier: float) -> float:
    """The least of Re (1 + j m omega) theta1~ over very many frequencies, the ends among them."""
    theta = kind.theta1_tilde

    def height(omega: np.ndarray) -> np.ndarray:
        return np.asarray(((1 + 1j * multiplier * omega) * theta(1j * omega)).real)

    omega = dense(kind.one_plus)
    values = height(omega)
    k = int(np.argmin(values))
    near = np.linspace(omega[max(k - 1, 0)], omega[min(k + 1, len(omega) - 1)], 20001)
    ends = [float(theta(0j).real)] + [multiplier * theta.gain] * (theta.relative_degree == 1 and multiplier > 0)
    return min(values.min(), height(near).min(), *ends)


def test_the_best_multiplier_is_found_in_any_time_unit() -> None:
    """The optimiser's tolerance is relative: the sector is a number without a unit."""
    sectors = [popov_sector(second_order(0.3 * T, 0.01 * T, -2.5).theta1_tilde)[0] for T in (1e-9, 1.0, 1e9)]
    assert sectors == pytest.approx([sectors[1]] * 3, rel=1e-8)


def test_a_peak_that_double_precision_does_not_resolve_is_refused() -> None:
    block = Block(
        1.0, Mode(4.4, 1e-16).roots + Mode(0.16, 1e-9).roots, Mode(1.1, 1e-14).roots + Mode(0.36, 1e-17).roots
    )
    with pytest.raises(InputError, match="could not be proved; expected better damped roots"):
        block_norm(block)
