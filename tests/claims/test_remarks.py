"""Two remarks on section 4.1: Lagrange is the zeros design with e = 2, f = 1, and the poles design has nothing free."""

import numpy as np
import pytest

from data.thesis import printed_numbers
from design.chapters_3_4.interpolate_Q import Conditions, by_poles, by_zeros, conditions, lagrange
from identification.base.errors import InputError

DELAY_S = 8.1e-3


def thesis_lagrange(wanted: Conditions) -> np.ndarray:
    """alpha_1, alpha_2, alpha_3 from the Vandermonde system of section 4.1, a_i = 0, j omega, -j omega."""
    (omega,), (at_omega,) = wanted.omegas, wanted.at_omegas
    points = np.array([0, 1j * omega, -1j * omega])
    values = np.array([wanted.at_zero, at_omega, np.conj(at_omega)])
    return np.linalg.solve(np.vander(points), (points + 1) ** 2 * values)


def thesis_poles(wanted: Conditions, b: float) -> np.ndarray:
    """d, e, f of "designing the poles" as section 4.1 prints them, for its numerator constant b."""
    f = b / wanted.at_zero
    (omega,), value = wanted.omegas, b / wanted.at_omegas[0]
    return np.array([(value.real - f) / -(omega**2), value.imag / omega, f])


@pytest.mark.parametrize("omega", [0.3, 1.5, 20.0])
@pytest.mark.parametrize("a", [0.5, 4.0])
def test_lagrange_is_the_zeros_design_with_e_2_and_f_1(omega: float, a: float):
    wanted = conditions([omega], DELAY_S, a)
    alphas = thesis_lagrange(wanted)
    assert np.max(np.abs(alphas.imag)) < 1e-12 * np.max(np.abs(alphas))
    Q = by_zeros(wanted, [(2.0, 1.0)])
    assert alphas.real == pytest.approx(Q.numerator, rel=1e-9)
    assert lagrange(wanted) == Q


def test_table_4_1_chose_the_lagrange_design():
    """The thesis says that it uses "designing the zeros" and not Lagrange; with e = 2, f = 1 they are the same Q."""
    chosen = printed_numbers()["extended"]
    wanted = conditions([chosen["reference"]["omega"]], DELAY_S, chosen["a"])
    assert thesis_lagrange(wanted).real == pytest.approx([6.2496, 6.89, 4.1296], abs=5e-5)


@pytest.mark.parametrize("omega", [1.5, 250.0])
def test_the_numerator_constant_of_the_poles_design_cancels(omega: float):
    wanted = conditions([omega], DELAY_S, 4.0)
    denominators = [thesis_poles(wanted, b) for b in (1.0, -7.3, 1e3)]
    s = 1j * np.geomspace(0.1, 1e4, 50)
    first, *others = (b / np.polyval(d, s) for b, d in zip((1.0, -7.3, 1e3), denominators, strict=True))
    for other in others:
        assert other == pytest.approx(first, rel=1e-12)


def test_the_poles_design_is_unstable_at_the_thesis_frequency_and_stable_at_high_ones():
    """As the thesis says it "only works using high frequencies", and no free parameter can change that."""
    with pytest.raises(InputError, match="unstable poles"):
        by_poles(conditions([1.5], DELAY_S, 4.0))
    wanted = conditions([250.0], DELAY_S, 4.0)
    Q = by_poles(wanted)
    assert Q.block()(0) == pytest.approx(wanted.at_zero, rel=1e-9)
    assert Q.block()(250j) == pytest.approx(wanted.at_omegas[0], rel=1e-9)
