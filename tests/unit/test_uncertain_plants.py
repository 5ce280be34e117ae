"""Plants drawn inside the additive bound: their distance by brute force, closed forms, and what no bound covers."""

from __future__ import annotations

from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

from design.auditing.audit_design import covered_delay
from experiments.campaign.distance_certificate import stays_below
from experiments.campaign.draw_plants import ABOVE, PlantsWithin, as_factors
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel


def modes(count: int, first: float, ratio: float) -> tuple[Mode, ...]:
    return tuple(Mode(first * ratio**k, 0.01 * (k + 1)) for k in range(count))


BOUND = AdditiveBound.printed_form(0.02, 30.0, 300.0, 0.05)
PLANTS = {
    "integrator alone": (PlantModel(-2.0, (), (), 0.03), AdditiveBound(0.2, (), (), (), (40.0,))),
    "no integrator": (
        PlantModel(3.0, modes(1, 50.0, 1.0), modes(2, 30.0, 4.0), 0.002, 0, (20.0,), (5.0, 900.0)),
        AdditiveBound(0.9, (), modes(1, 60.0, 1.0), (80.0,)),
    ),
    "no dead time": (PlantModel(5.0, modes(1, 90.0, 1.0), modes(1, 140.0, 1.0), 0.0), BOUND),
    "eight modes": (PlantModel(0.5, modes(8, 20.0, 1.7), modes(8, 25.0, 1.7), 0.001), BOUND),
    "rolls off": (PlantModel(4.0, (), modes(2, 80.0, 2.5), 0.004, 1, (12.0,), (15.0, 60.0)), BOUND),
    "two integrators": (PlantModel(-9.0, (Mode(20.0, -0.3),), modes(2, 15.0, 3.0), 0.004, 2, (), (90.0,)), BOUND),
    "two integrators alone": (PlantModel(3.0, (), (), 0.02, 2), BOUND),
    "zeros at s = 0": (PlantModel(0.3, (), modes(2, 20.0, 2.0), 0.01, -2, (-70.0,), (40.0,)), BOUND),
    "zero and pole in the right half plane": (
        PlantModel(2.0, (Mode(30.0, -1.7),), (Mode(25.0, 0.04), Mode(60.0, 0.1)), 0.003, -1, (), (-8.0,)),
        AdditiveBound(0.2, (), (Mode(200.0, 0.5),), (30.0,)),
    ),
}


def brute(plant: PlantModel, true: PlantModel, bound: AdditiveBound) -> float:
    """The largest |P_true - P|/|W_a| on a dense grid, also around every mode of the three, and near s = 0."""
    roots = [mode for model in (plant, true, bound) for mode in (*model.zero_modes, *model.pole_modes)]
    omega = [np.geomspace(1e-4, 1e7, 40_001)]
    omega += [mode.omega * np.exp(min(abs(mode.zeta), 1.0) * np.linspace(-20, 20, 1001)) for mode in roots]
    s = 1j * np.concatenate(omega)
    if plant.integrators == 2:
        s = s[s.imag > 0.05]  # below, doubles lose the difference
    near = max(in_forty_digits(plant, true, bound, omega) for omega in (1e-5, 1e-3, 1e-2, 0.03, 0.1))
    return max(near, float(np.max(np.abs(true(s) - plant(s)) / np.abs(bound(s)))))


def in_forty_digits(plant: PlantModel, true: PlantModel, bound: AdditiveBound, omega: float) -> float:
    """|P_true - P|/|W_a| at one frequency."""
    with mp.workdps(40):
        s = mp.mpc(0, omega)

        def at(model: PlantModel | AdditiveBound) -> mp.mpc:
            value = mp.mpf(model.gain)
            if isinstance(model, PlantModel):
                value *= mp.exp(-mp.mpf(model.delay_s) * s) / s**model.integrators
            for kind, power in ((model.zero_modes, 1), (model.pole_modes, -1)):
                value *= mp.fprod((1 + 2 * mp.mpf(m.zeta) * s / m.omega + (s / m.omega) ** 2) ** power for m in kind)
            for rates, power in ((model.real_zeros, 1), (model.real_poles, -1)):
                value *= mp.fprod((1 + s / mp.mpf(rate)) ** power for rate in rates)
            return value

        return float(abs(at(true) - at(plant)) / abs(at(bound)))


@pytest.mark.parametrize("name", [*PLANTS, "implied", "table"])
def test_every_plant_is_inside_and_its_distance_is_what_it_is(name: str, request: pytest.FixtureRequest) -> None:
    if name in PLANTS:
        plant, bound = PLANTS[name]
    else:
        model: IdentifiedModel = request.getfixturevalue(name)
        plant, bound = model.plant, model.additive_bound
    within = PlantsWithin(plant, bound)
    for index in range(3):
        member = within.draw(5, index)
        found = brute(plant, member.plant, bound)
        assert found <= member.distance * (1 + 1e-6) + 1e-9
        assert found >= 0.98 * member.distance
        assert 0 < member.distance <= 1


@pytest.mark.parametrize("name", PLANTS)
def test_a_level_is_proved_above_the_distance_and_never_below(name: str) -> None:
    """The largest ratio by brute force, of plants inside and far outside: no level below it, any level well above."""
    plant, bound = PLANTS[name]
    within = PlantsWithin(plant, bound)
    for index in range(3):
        member = within.draw(7, index)
        looser = replace(bound, gain=bound.gain / (1 + index))
        models = [as_factors(model) for model in (member.plant, without_change(plant, member.plant), looser)]
        found = brute(plant, member.plant, looser)
        assert not any(stays_below(*models, found * (1 - share)) for share in (1e-12, 1e-9, 1e-6, 1e-3, 0.1))
        level = member.distance * (1 + index) * (1 + ABOVE)
        assert all(stays_below(*models, level * more) for more in (1.0, 1.1, 3.0))


def without_change(plant: PlantModel, true: PlantModel) -> PlantModel:
    """P with as many factors as P_true: a real zero and a real pole that cancel."""
    zeros, poles = true.real_zeros[len(plant.real_zeros) :], true.real_poles[len(plant.real_poles) :]
    corners = tuple(np.sqrt(np.multiply(zeros, poles)))
    return replace(plant, real_zeros=(*plant.real_zeros, *corners), real_poles=(*plant.real_poles, *corners))


@pytest.mark.parametrize("zeta", [1e-2, 1e-4, 1e-6])
def test_a_needle_is_not_overlooked(zeta: float) -> None:
    """k/(mode) against 0 within a constant: the largest ratio is that of the peak, k/(2 zeta sqrt(1 - zeta^2))."""
    nominal = PlantModel(1e-30, (), (Mode(7.0, 0.3),), 0.0, 0)
    true = PlantModel(1e-3, (), (Mode(7.0, zeta),), 0.0, 0)
    bound = AdditiveBound(1.0, (), (), (1e6,), (1e6,))
    models = [as_factors(model) for model in (true, nominal, bound)]
    peak = 1e-3 / (2 * zeta * np.sqrt(1 - zeta**2))
    assert stays_below(*models, peak * (1 + 1e-5))
    assert not stays_below(*models, peak * (1 - 1e-9))


@pytest.mark.parametrize("name", PLANTS)
def test_every_parameter_is_perturbed(name: str) -> None:
    plant, bound = PLANTS[name]
    within = PlantsWithin(plant, bound)
    drawn = [within.draw(0, index).plant for index in range(8)]
    for true in drawn:
        assert true.integrators == plant.integrators
        assert true.relative_degree == plant.relative_degree
        pairs = zip((*true.zero_modes, *true.pole_modes), (*plant.zero_modes, *plant.pole_modes), strict=True)
        assert all(mine.omega != other.omega and mine.zeta != other.zeta for mine, other in pairs)
        more = max(0, plant.integrators)
        assert len(true.right_zeros) == len(plant.right_zeros)
        assert len(true.unstable_poles) == len(plant.unstable_poles)
        assert len(true.real_zeros) == len(plant.real_zeros) + more
        assert len(true.real_poles) == len(plant.real_poles) + more
        assert true.delay_s >= 0
        if more:
            assert true.gain == plant.gain
            assert true.real_zeros[-1] != true.real_poles[-1]
        else:
            assert true.gain != plant.gain
    later = [true.delay_s - plant.delay_s for true in drawn]
    if plant.delay_s == 0:
        assert min(later) >= 0
    else:
        assert min(later) < 0 < max(later)
    assert any(later)


def test_a_plant_is_its_number_and_seed(implied: IdentifiedModel) -> None:
    one, other = (PlantsWithin(implied.plant, implied.additive_bound) for _ in range(2))
    in_order = [one.draw(3, index) for index in range(4)]
    assert [other.draw(3, index) for index in (3, 1)] == [in_order[3], in_order[1]]
    assert len({member.plant for member in in_order}) == 4
    assert other.draw(4, 1) != in_order[1]


def test_the_shares_fill_the_bound(implied: IdentifiedModel) -> None:
    """Without another dead time the distance is, to first order, the uniform share."""
    within = PlantsWithin(replace(implied.plant, delay_s=0.0), AdditiveBound.printed_form(1e-3, 25.0, 285.0, 0.03))
    distances = np.array([within.draw(1, index).distance for index in range(100)])
    assert np.allclose(np.quantile(distances, [0.25, 0.5, 0.75]), [0.25, 0.5, 0.75], atol=0.1)


def only(within: PlantsWithin, place: int, value: float) -> np.ndarray:
    n = 2 * (len(within.plant.zero_modes) + len(within.plant.pole_modes))
    n += len(within.plant.real_zeros) + len(within.plant.real_poles) + 2
    direction = np.zeros(n)
    direction[place] = value
    return direction


def test_another_dead_time_alone_in_closed_form() -> None:
    """|K/s| 2|sin(omega tau/2)| over w/sqrt(1 + (omega/a)^2) is largest at omega = 0: |K| tau/w."""
    plant, bound = PlantModel(-2.0, (), (), 0.03), AdditiveBound(0.02, (), (), (), (1000.0,))
    within = PlantsWithin(plant, bound)
    for sign in (-1, 1):
        member = within.along(only(within, -1, sign * 1e-3), 1.0, 1.0)
        assert member.plant.delay_s - plant.delay_s == pytest.approx(sign * 0.01, rel=2e-4)
        assert member.distance == pytest.approx(1.0, abs=2e-4)
    half = within.along(only(within, -1, 1e-3), 0.5, 1.0)
    assert half.distance == pytest.approx(0.5, abs=2e-4)


def test_another_dead_time_alone_is_the_audits(implied: IdentifiedModel) -> None:
    within = PlantsWithin(implied.plant, implied.additive_bound)
    member = within.along(only(within, -1, 1e-3), 1.0, 100.0)
    expected = covered_delay(implied.plant, implied.additive_bound)
    assert member.plant.delay_s - implied.plant.delay_s == pytest.approx(expected, rel=2e-3)


def test_another_gain_alone_in_closed_form() -> None:
    """k/(1 + s/a) within w/(1 + s/a): the distance is |k' - k|/w."""
    plant, bound = PlantModel(3.0, (), (), 0.01, 0, (), (7.0,)), AdditiveBound(0.6, (), (), (), (7.0,))
    within = PlantsWithin(plant, bound)
    for sign in (-1, 1):
        member = within.along(only(within, -2, sign), 1.0, 1.0)
        assert member.plant.gain == pytest.approx(3.0 + sign * 0.6, rel=1e-4)
        assert member.plant.delay_s == plant.delay_s


@pytest.mark.parametrize("factor", [1.1, 1 + 1e-6])
def test_no_finite_bound_covers_the_integrators_gain(implied: IdentifiedModel, factor: float) -> None:
    plant, bound = implied.plant, implied.additive_bound
    other = replace(plant, gain=factor * plant.gain)
    omega = np.array([1e-6, 1e-8, 1e-10, 1e-12])
    ratio = np.abs(other(1j * omega) - plant(1j * omega)) / np.abs(bound(1j * omega))
    assert np.allclose(ratio[1:] / ratio[:-1], 100.0, rtol=1e-3)
    assert ratio[-1] > 1


def test_two_integrators_keep_both_coefficients_at_zero() -> None:
    """K, and the slope of the rest: the sum of 2 zeta/omega and 1/rate, zeros less poles, less the dead time."""

    def slope(plant: PlantModel) -> float:
        zeros = sum(2 * mode.zeta / mode.omega for mode in plant.zero_modes) + sum(
            1 / rate for rate in plant.real_zeros
        )
        poles = sum(2 * mode.zeta / mode.omega for mode in plant.pole_modes) + sum(
            1 / rate for rate in plant.real_poles
        )
        return zeros - poles - plant.delay_s

    for name in ("two integrators", "two integrators alone"):
        plant, bound = PLANTS[name]
        for index in range(5):
            true = PlantsWithin(plant, bound).draw(6, index).plant
            assert true.gain == plant.gain
            assert slope(true) == pytest.approx(slope(plant), abs=1e-15)
            later = replace(true, delay_s=true.delay_s + 1e-6)
            assert in_forty_digits(plant, later, bound, 1e-9) > 1e2


def test_a_dead_time_that_no_plant_within_may_change_stays() -> None:
    """Where 2 |P| exceeds |W_a| as omega grows, no plant with another dead time is within."""
    plant = PLANTS["no dead time"][0]
    bound = AdditiveBound.printed_form(1e-3, 30.0, 300.0, 0.05)
    for delay_s in (0.0, 0.01):
        within = PlantsWithin(replace(plant, delay_s=delay_s), bound)
        assert {within.draw(2, index).plant.delay_s for index in range(5)} == {delay_s}


def test_a_bound_that_falls_faster_than_the_plant_is_refused() -> None:
    with pytest.raises(InputError, match=r"falls faster than \|P\| as omega grows"):
        PlantsWithin(PlantModel(1.0, (), (), 0.01), AdditiveBound(1.0, (), modes(1, 5.0, 1.0)))
