"""The recovery time is a bound: a longer one, a smaller sector or another unit never makes the least f larger."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from design.anti_windup.condition import Sector
from design.anti_windup.corrected_compensator import RESOLVED, SETTLED, WORTH, corrected
from design.anti_windup.corrected_program import FEASIBLE
from design.blocks.block import bound_block
from design.blocks.frequency_peak import block_norm
from design.chapters_3_4.design_extended import design_extended
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

shares = st.floats(0.0, 2.0)
bounds = st.builds(
    lambda modes, real, zeros: AdditiveBound(
        0.03,
        (),
        tuple(Mode(10**omega, 10**zeta) for omega, zeta in modes),
        tuple(10**rate for rate in zeros[: 2 * len(modes) + len(real)]),
        tuple(10**rate for rate in real),
    ),
    st.lists(st.tuples(shares, st.floats(-2.5, 0.0)), max_size=1),
    st.lists(shares, min_size=1, max_size=1),
    st.lists(shares, max_size=3),
)


def least_f(
    bound: AdditiveBound, recovery_s: float, integrators: int, sector: float, bandwidth: float
) -> tuple[float, float]:
    """f and its lower bound; both infinite where nothing meets the sector."""
    try:
        found = corrected((0j,) * integrators, bound, recovery_s, Sector(sector), bandwidth)
    except InputError:
        return np.inf, np.inf
    slowest = min((-pole.real for pole in found.anti_windup.one_plus.poles), default=np.inf)
    assert np.log(1 / SETTLED) / slowest <= recovery_s * (1 + 1e-9)
    return found.f, found.f_lower


F_BELOW_ROUNDING = AdditiveBound(0.03, (), (Mode(1.0, 0.08198893662127436),), (), (25.639998365617146,))


@settings(max_examples=8, deadline=None)
@example(F_BELOW_ROUNDING, [0.0, 1.1713604925825813, 0.875], 2, 0.8125, 2.5)  # f is 1e-7 of ||W_a||
@given(
    bounds,
    st.lists(st.floats(0.0, 2.5), min_size=3, max_size=3),
    st.integers(0, 2),
    st.floats(0.5, 0.99),
    st.floats(1.0, 2.5),
)
def test_f_does_not_increase_with_the_recovery_time(
    bound: AdditiveBound, decades: list[float], integrators: int, sector: float, width: float
) -> None:
    bandwidth = 10**width
    times = np.log(1 / SETTLED) / bandwidth * 10 ** np.sort(decades)
    found = [least_f(bound, float(time), integrators, sector, bandwidth) for time in times]
    W_a = bound_block(bound)
    resolved = (RESOLVED + (len(W_a.poles) + 1) * FEASIBLE) * block_norm(W_a)[0]
    for (f, f_lower), (longer, _) in pairwise(found):
        assert longer <= f * (1 + 1e-5) + resolved
        assert f_lower <= f * (1 + 1e-12)


def test_f_of_a_plant_that_once_showed_the_opposite() -> None:
    """f was 0.0082 for a recovery in 0.2 s and 0.0246 in 10 s: the bandwidth followed the recovery time."""
    plant = PlantModel(19.416211763234617, (), (Mode(64.83351679861622, 0.006065211741852967),), 0.04289450322705625)
    plant = PlantModel(plant.gain, (Mode(13.998610151745932, 0.0081),), plant.pole_modes, plant.delay_s)
    bound = AdditiveBound(0.0930769359974999, (), (), (), (23.246528149884053,))
    times = (0.08, 0.2, 1.0, 10.0)
    found = [
        design_extended(IdentifiedModel(plant, bound), [1.5], 4.0, [(2.0, 1.0)], recovery_s=time).corrected
        for time in times
    ]
    judged = [each.judgement for each in found]
    assert [each.bandwidth for each in found] == pytest.approx([64.83351679861622] * len(times))
    assert all(np.diff([each.f for each in judged]) <= 2 * WORTH * judged[0].f)
    assert all(each.recovery_s <= time * (1 + 1e-9) for each, time in zip(judged, times, strict=True))


@settings(max_examples=6, deadline=None)
@given(bounds, st.floats(-9.0, 9.0), st.floats(-15.0, 15.0), st.integers(0, 2), st.floats(0.2, 2.0))
def test_the_units_do_not_matter(
    bound: AdditiveBound, time_unit: float, gain_unit: float, integrators: int, decades: float
) -> None:
    T, k = 10**time_unit, 10**gain_unit
    scaled = AdditiveBound(
        bound.gain * k,
        (),
        tuple(Mode(mode.omega / T, mode.zeta) for mode in bound.pole_modes),
        tuple(rate / T for rate in bound.real_zeros),
        tuple(rate / T for rate in bound.real_poles),
    )
    recovery_s = np.log(1 / SETTLED) / 100.0 * 10**decades
    f, _ = least_f(bound, recovery_s, integrators, 0.9, 100.0)
    other, _ = least_f(scaled, recovery_s * T, integrators, 0.9, 100.0 / T)
    assert other == pytest.approx(f * k, rel=1e-5, abs=RESOLVED * block_norm(bound_block(scaled))[0])


@settings(max_examples=6, deadline=None)
@given(
    pairs=st.lists(st.tuples(st.floats(1.0, 4.0), st.floats(0.5, 9.0), st.floats(0.3, 1.5)), min_size=1, max_size=8),
    modes=st.lists(st.tuples(st.floats(0.5, 2.5), st.floats(-2.5, -0.5)), min_size=2, max_size=2),
    bound=st.tuples(st.floats(-4.0, -2.0), st.floats(0.5, 2.5), st.floats(0.5, 2.5), st.floats(-2.5, -0.5)),
    robust=st.booleans(),
    time_unit=st.floats(-9.0, 9.0),
    gain_unit=st.floats(-15.0, 15.0),
)
def test_a_whole_extended_design_in_other_units(
    pairs: list[tuple[float, float, float]],
    modes: list[tuple[float, float]],
    bound: tuple[float, float, float, float],
    robust: bool,
    time_unit: float,
    gain_unit: float,
) -> None:
    """One to eight reference frequencies, a plant with a pair of zeros and of poles: everything that is printed."""
    omegas, level = np.cumsum([pair[2] for pair in pairs]), 0.9 if robust else None
    gain, corner, omega, zeta = 10 ** np.array(bound)

    def designed(T: float, k: float) -> dict[str, float]:
        zero, pole = (Mode(10 ** each[0] / T, 10 ** each[1]) for each in modes)
        model = IdentifiedModel(
            PlantModel(2.0 * k / T, (zero,), (pole,), 0.01 * T),
            AdditiveBound.printed_form(gain * k, corner / T, omega / T, zeta),
        )
        factors = [(e / T, f / T**2) for e, f, _ in pairs]
        design = design_extended(model, omegas / T, 2.0 / T, factors, robust_level=level)
        rolled = design.free.roll_off
        found = {"roll_off": rolled.rate * T if rolled is not None and rolled.order else 0.0}
        for name, each in design.anti_windup.items():
            found[name + " f"] = each.judgement.f / k
            found[name + " sector"] = each.judgement.popov_sector or np.inf
            found[name + " at zero"] = each.judgement.theta1_tilde_at_zero
            found[name + " recovery"] = each.judgement.recovery_s / T
        return found

    try:
        here = designed(1.0, 1.0)
    except InputError:
        with pytest.raises(InputError):
            designed(10**time_unit, 10**gain_unit)
        return
    # gamma is the minimum of a flat function: to the root of the accuracy of f
    assert designed(10**time_unit, 10**gain_unit) == pytest.approx(here, rel=1e-6)


@pytest.mark.parametrize("bandwidth", [None, 1e8])
def test_a_root_of_the_bound_far_beyond_the_loop_makes_no_recovery_faster(bandwidth: float | None) -> None:
    """W_a has a root at 1e8 rad/s where nobody measured: theta1~ was as fast as that, the loop takes 3.5 s."""
    plant, bound = PlantModel(1.0, (), (), 0.1, 1, (), (1.0,)), AdditiveBound(0.02, (), (), (), (1e8,))
    found = design_extended(IdentifiedModel(plant, bound), [0.1 * np.pi], bandwidth=bandwidth)
    own_rate = found.free.pace
    assert found.corrected.bandwidth == pytest.approx(1000 * own_rate if bandwidth is None else bandwidth)
    slowest = min(-pole.real for pole in found.corrected.kind.one_plus.poles)
    assert own_rate * (1 - 1e-9) <= slowest <= own_rate * 10 ** (1 / 48)
    assert found.corrected.judgement.f <= 0.02 * (1 + 1e-9)  # of the washout
