"""Blocks against polynomials and the plant's own formula; their realisation against their own values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.blocks.block import (
    Block,
    bound_block,
    from_polynomial,
    mode_product,
    plant_block,
    plant_denominator,
    plant_numerator,
    polynomial,
)
from design.blocks.state_space import StateSpace, realize
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode

S = 1j * np.geomspace(1e-2, 1e4, 400) + 0.1


def response(system: StateSpace, s: np.ndarray) -> np.ndarray:
    """(sI - A)^-1 b through C and d, shape (len(s), outputs)."""
    identity = np.eye(len(system.b))
    states = np.stack([np.linalg.solve(z * identity - system.A, system.b) for z in s])
    return states @ system.C.T + system.d


def test_plant_and_bound_blocks_are_their_formulas(implied: IdentifiedModel) -> None:
    np.testing.assert_allclose(plant_block(implied.plant)(S), implied.plant(S), rtol=1e-11)
    np.testing.assert_allclose(bound_block(implied.additive_bound)(S), implied.additive_bound(S), rtol=1e-11)


def test_numerator_over_denominator_is_the_delay_free_plant(implied: IdentifiedModel) -> None:
    ratio = plant_numerator(implied.plant)(S) / plant_denominator(implied.plant)(S)
    np.testing.assert_allclose(ratio, implied.plant.without_delay()(S), rtol=1e-11)


def test_series_connection_cancels_equal_roots_and_adds_delays() -> None:
    first = Block(2.0, (-1.0, -3 + 4j, -3 - 4j), (-2.0, 0.0, -5.0), 0.1)
    second = Block(3.0, (-2.0,), (-3 + 4j, -3 - 4j), 0.2)
    product = first * second
    assert product.zeros == (-1.0,)
    assert product.poles == (0.0, -5.0)
    np.testing.assert_allclose(product(S), first(S) * second(S), rtol=1e-12)


def test_inverse_undoes_and_refuses_a_dead_time() -> None:
    block = Block(2.0, (-1.0,), (-2.0, -7.0))
    np.testing.assert_allclose((block * block.inverse())(S), 1.0)
    with pytest.raises(InputError, match="causal"):
        Block(1.0, (), (-1.0,), 0.5).inverse()


def test_shift_evaluates_at_s_plus_sigma() -> None:
    block = Block(2.0, (-1.0,), (-2 + 3j, -2 - 3j))
    np.testing.assert_allclose(block.shifted(0.7)(S), block(S + 0.7), rtol=1e-12)


@pytest.mark.parametrize("roots", [(1 + 1j,), (1 + 1j, 1 - 2j), (1 + 1j, 1 - 1j, 3 - 1j)])
def test_roots_must_be_closed_under_conjugation(roots: tuple[complex, ...]) -> None:
    with pytest.raises(InputError, match="real coefficients"):
        Block(1.0, roots)


def test_non_finite_numbers_are_refused() -> None:
    with pytest.raises(InputError, match="finite"):
        Block(float("nan"))
    with pytest.raises(InputError, match="finite"):
        Block(1.0, (complex(float("inf")),))


def test_polynomial_and_back() -> None:
    block = Block(3.0, (-1.0, -200 + 10j, -200 - 10j))
    np.testing.assert_allclose(polynomial(block), [3, 3 * 401, 3 * (40100 + 400), 3 * 40100], rtol=1e-12)
    again = from_polynomial(polynomial(block, 50.0), 50.0)
    np.testing.assert_allclose(again(S), block(S), rtol=1e-10)


@pytest.mark.parametrize("zeta", [0.008, 0.5, 1.0, 3.0, 500.0])
def test_mode_roots_have_the_mode_as_polynomial(zeta: float) -> None:
    mode = Mode(30.0, zeta)
    np.testing.assert_allclose(mode_product(1.0, [mode])(S), mode(S), rtol=1e-9)


def test_json_round_trip_is_exact() -> None:
    block = Block(0.1, (-1 / 3,), (-2 + 1j / 7, -2 - 1j / 7), 0.0081)
    assert Block.from_dict(block.to_dict()) == block


def test_realisation_of_the_plant_is_accurate_where_it_is_tiny(implied: IdentifiedModel) -> None:
    block = plant_block(implied.plant.without_delay())
    np.testing.assert_allclose(response(realize(block), S)[:, 0], block(S), rtol=1e-9)


def test_realisation_shares_the_common_poles() -> None:
    common = (-1 + 50j, -1 - 50j, -3.0)
    first = Block(2.0, (-0.5,), common)
    second = Block(1.0, (-9.0, -8.0, -7.0, -6.0), (*common, -900.0))
    system = realize(first, second)
    assert len(system.b) == 4
    values = response(system, S)
    np.testing.assert_allclose(values[:, 0], first(S), rtol=1e-10)
    np.testing.assert_allclose(values[:, 1], second(S), rtol=0, atol=1e-10 * np.abs(second(S)).max())
    np.testing.assert_allclose(system.C[0, 3:], 0.0, atol=1e-15)  # the first does not see the second's own pole


def test_realisation_refuses_an_improper_block() -> None:
    with pytest.raises(InputError, match="improper"):
        realize(Block(1.0, (-1.0, -2.0), (-3.0,)))


root = st.floats(-2.0, 3.0).map(lambda exponent: -(10.0**exponent))
pair = st.tuples(st.floats(-1.0, 3.0), st.floats(0.005, 0.9)).map(lambda mode: Mode(10.0 ** mode[0], mode[1]).roots)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.one_of(root.map(lambda r: (r,)), pair), min_size=1, max_size=4), st.data())
def test_realisation_of_random_blocks(poles: list[tuple[complex, ...]], data: st.DataObject) -> None:
    flat = tuple(pole for section in poles for pole in section)
    zeros = tuple(data.draw(root) for _ in range(data.draw(st.integers(0, len(flat)))))
    block = Block(1.7, zeros, flat)
    values, truth = response(realize(block), S)[:, 0], block(S)
    assert np.max(np.abs(values - truth)) <= 1e-9 * np.max(np.abs(truth))
