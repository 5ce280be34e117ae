"""Bounds that hold to the last digit: the certificates beside 40 digits, and the chain and the defects they rest on."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import cvxpy
import mpmath as mp
import numpy as np
import pytest
from held_plant import held_response
from scipy.optimize import linprog
from scipy.signal import cont2discrete, zpk2ss

from experiments.physical_limits.certificates import Samples, absolute_integral, forced, reached, whole
from experiments.physical_limits.exact_chain import chain, fastest, positive_exponential
from experiments.physical_limits.least_peak_error import RestLimit, periodic_limit
from experiments.physical_limits.response_cells import UNIT, Cells
from experiments.runs.references import Reference, sinusoid
from experiments.runs.steady_control import PI
from identification.base.errors import InputError
from identification.model.modes import Mode
from identification.model.plant import PlantModel

DIGITS = 40
CELLS = 90
PARTS = 4  # of a cell in which an input stands still
INSTANTS = 500  # of a period in the dense program
POINTS = 16  # of a cell at which a sum is looked at


def random_plant(rng: np.random.Generator, integrators: int = 1, omega: float = 40.0) -> PlantModel:
    """A resonance and an anti-resonance around omega, a real pole, zeros at most two fewer than poles."""
    zero, pole = omega * rng.uniform(0.3, 0.8), omega * rng.uniform(0.9, 1.5)
    modes = (Mode(zero, rng.uniform(0.005, 0.5)),), (Mode(pole, rng.uniform(0.005, 0.1)),)
    gain = float(rng.uniform(0.5, 5.0) * rng.choice([-1.0, 1.0]))
    return PlantModel(gain, *modes, 0.0, integrators, (), (float(omega * rng.uniform(0.1, 0.6)),))


def residues(plant: PlantModel) -> list[tuple[mp.mpc, mp.mpc]]:
    """Poles, all distinct, and the residues of P, to 40 digits."""

    def roots(modes: tuple[Mode, ...], rates: tuple[float, ...]) -> list[mp.mpc]:
        found = [-mp.mpf(rate) for rate in rates]
        for mode in modes:
            zeta, omega = mp.mpf(mode.zeta), mp.mpf(mode.omega)
            spread = mp.sqrt(mp.mpc(zeta**2 - 1))
            found += [omega * (-zeta + spread), omega * (-zeta - spread)]
        return found

    zeros, stable = roots(plant.zero_modes, plant.real_zeros), roots(plant.pole_modes, plant.real_poles)
    gain = mp.mpf(plant.gain) * mp.fprod(-p for p in stable) / mp.fprod(-z for z in zeros)
    poles = stable + [mp.mpf(0)] * plant.integrators
    others = [[q for k, q in enumerate(poles) if k != i] for i in range(len(poles))]
    return [
        (p, gain * mp.fprod(p - z for z in zeros) / mp.fprod(p - q for q in rest))
        for p, rest in zip(poles, others, strict=True)
    ]


def sums(plant: PlantModel, cell_s: mp.mpf, mu: np.ndarray, periodic: bool) -> tuple[list[mp.mpc], list[list[mp.mpc]]]:
    """Rates p_i and, for each cell, c_i with sum mu_j g(t_j - t) = sum c_i exp(p_i (t_end - t)), but for a constant."""
    count = len(mu) - (not periodic)
    rates, cells = [], [[] for _ in range(count)]
    for pole, residue in residues(plant):
        step, end = mp.exp(pole * cell_s), mp.mpf(0)
        if periodic and pole != 0:
            for weight in mu[::-1]:
                end = end * step + mp.mpf(weight)
            end /= 1 - step**count
        value = end if periodic else mp.mpf(mu[-1])
        rates.append(pole)
        for k in reversed(range(count)):
            cells[k].append(residue * value)
            value = value * step + mp.mpf(mu[k])
    return rates, cells


def exact_area(rates: list[mp.mpc], coefficients: list[mp.mpc], cell_s: mp.mpf, middle: mp.mpf) -> mp.mpf:
    """The integral over a cell of |the sum less a constant|, between its zeros by its antiderivative."""

    def value(t: mp.mpf) -> mp.mpf:
        return mp.re(mp.fsum(c * mp.exp(p * t) for c, p in zip(coefficients, rates, strict=True))) - middle

    def antiderivative(t: mp.mpf) -> mp.mpf:
        parts = (c * (mp.exp(p * t) - 1) / p if p else c * t for c, p in zip(coefficients, rates, strict=True))
        return mp.re(mp.fsum(parts)) - middle * t

    times = [cell_s * k / POINTS for k in range(POINTS + 1)]
    values, breaks = [value(t) for t in times], [mp.mpf(0)]
    for k in range(POINTS):
        if values[k] * values[k + 1] < 0:
            breaks.append(mp.findroot(value, (times[k], times[k + 1]), solver="anderson", tol=mp.mpf(10) ** -60))
    at = [antiderivative(t) for t in [*breaks, cell_s]]
    return mp.fsum(abs(b - a) for a, b in pairwise(at))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("coarse", [False, True])
def test_what_weights_prove_is_less_than_forty_digits_say(seed: int, periodic: bool, coarse: bool) -> None:
    """And hardly less in the cells that are used; in a coarse one the resonance turns once, unseen at both ends."""
    rng = np.random.default_rng(seed)
    plant = random_plant(rng)
    span = Fraction(2 * math.pi * CELLS / plant.pole_modes[0].omega) if coarse else Fraction(3, 10)
    cells = Cells(plant, span / CELLS, CELLS, "periodic" if periodic else "rest")
    mu = np.zeros(CELLS + (not periodic))
    mu[rng.choice(len(mu), 5, replace=False)] = rng.normal(size=5)
    if seed % 2:  # as smooth as averaged weights are
        mu = np.convolve(np.append(mu, mu[:12]), np.hanning(13), mode="valid")[: len(mu)]
    if periodic:
        mu -= mu.mean()
    mu = whole(mu / np.abs(mu).sum(), periodic)
    r, gain = rng.normal(size=len(mu)), 0.3
    claimed = forced(cells, mu, Samples(r, 0.0, 0.0), gain)
    with mp.workdps(DIGITS):
        cell_s = mp.mpf(span.numerator) / span.denominator / CELLS
        rates, coefficients = sums(plant, cell_s, mu, periodic)
        middle = mp.mpf(float(np.median([float(mp.re(mp.fsum(c))) for c in coefficients]))) if periodic else mp.mpf(0)
        area = mp.fsum(exact_area(rates, c, cell_s, middle) for c in coefficients)
        size = mp.fsum(abs(mp.mpf(weight)) for weight in mu)
        exact = (mp.fsum(mp.mpf(a) * mp.mpf(b) for a, b in zip(mu, r, strict=True)) - mp.mpf(gain) * area) / size
        share = float((exact - claimed) / (gain * area / size))
    # the median of the forty digits is that of the floats but for a rounding, which counts by its square
    assert 0 < share < (math.inf if coarse else 1e-3)


@pytest.mark.parametrize("integrators", [0, 1])
@pytest.mark.parametrize("shares", [(-1.0, 1.0), (-0.4, 1.0), (0.25, 1.0)])
def test_what_weights_of_means_prove_is_what_the_worst_input_takes(
    integrators: int, shares: tuple[float, float]
) -> None:
    """Of a plant with as many zeros as poles, from rest; the mean of y in every cell by the response of P/s."""
    rng, count, cell = np.random.default_rng(5), 120, Fraction(1, 500)
    plant = PlantModel(2.0, (Mode(30.0, -0.2),), (Mode(40.0, 0.05),), 0.0, integrators, (9.0,) * integrators)
    mu = np.convolve(rng.normal(size=count - 12), np.hanning(13))
    mu = whole(np.append(mu, 0.0) / np.abs(mu).sum(), centred=False)
    r, gain = rng.normal(size=count + 1), 0.3
    claimed = forced(Cells(plant, cell, count, "rest"), mu, Samples(r, 0.0, 0.0), gain, shares)
    integral = held_response(replace(plant, integrators=integrators + 1), float(cell), np.eye(1, count + 1)[0])
    pulse = np.diff(integral) / float(cell)
    taken = np.array([mu[k:count] @ pulse[: count - k] for k in range(count)])
    worst = np.where(taken > 0, shares[1], shares[0]) @ taken
    exact = (mu[:-1] @ (r[1:] + r[:-1]) / 2 - gain * worst) / np.abs(mu).sum()
    assert exact - 0.01 * gain * np.abs(taken).sum() < claimed <= exact + 1e-9


@pytest.mark.parametrize("integrators", [-1, 0, 1, 2])
def test_chain_is_the_plant_and_its_flow_exact_to_the_last_bit(integrators: int) -> None:
    plant = random_plant(np.random.default_rng(abs(integrators)), integrators)
    cell_s = 2 * PI / Fraction(0.7) / 5000
    found = chain(plant, cell_s, 5000)
    for omega in (0.7, 5.0, 38.0, 70.0, 900.0):
        z = 1j * omega * float(cell_s)
        answer = found.c @ np.linalg.solve(z * np.eye(len(found.b)) - found.A, found.b) + found.d
        assert answer == pytest.approx(complex(plant(1j * omega)), rel=1e-9)
    n = len(found.b)
    with mp.workdps(DIGITS):
        exact = mp.expm(mp.matrix(np.block([[found.A, found.b[:, None]], [np.zeros((1, n + 1))]])), method="taylor")
        known = np.array(exact.tolist(), dtype=float)
    # A and b themselves are rounded here, in the chain they are not
    np.testing.assert_allclose(found.flow, known[:n, :n], rtol=4 * UNIT, atol=4 * UNIT**2)
    np.testing.assert_allclose(found.pulse, known[:n, n], rtol=4 * UNIT, atol=4 * UNIT**2)


def test_positive_exponential_is_an_upper_bound() -> None:
    matrix = np.random.default_rng(3).normal(size=(5, 5)) * 3
    with mp.workdps(DIGITS):
        known = np.array(mp.expm(mp.matrix(np.abs(matrix))).tolist(), dtype=float)
    found = positive_exponential(matrix)
    assert (found >= known).all()
    np.testing.assert_allclose(found, known, rtol=1e-5)


@pytest.mark.parametrize("integrators", [0, 1, 2])
@pytest.mark.parametrize("start", ["rest", "periodic"])
def test_states_and_costates_are_adjoint_and_defects_are_roundings(integrators: int, start: str) -> None:
    """Sum mu_k y(t_k) = sum p_{k+1} pulse u_k, and no state leaves what the inputs reach."""
    rng = np.random.default_rng(7 + integrators)
    cells = Cells(random_plant(rng, integrators), Fraction(1, 1000), 777, start)  # type: ignore[arg-type]
    centred = start == "periodic" and integrators > 0
    u, mu = rng.uniform(-1, 1, 777), rng.normal(size=777 + (start == "rest"))
    if centred:
        u, mu = (u - u.mean()) / 2, mu - mu.mean()
    u, mu = whole(u, centred), whole(mu / np.abs(mu).sum(), centred)
    assert not centred or (u.sum() == 0 == mu.sum())
    x, p = cells.states(u), cells.costates(mu)
    y = x @ cells.chain.c
    assert mu @ y[: len(mu)] == pytest.approx(p[1:] @ cells.chain.pulse @ u, abs=1e-11 * np.abs(y).max())
    scale = np.abs(x).max(axis=0)
    assert (cells.state_defects(u, x) < 1e-12 * scale.max()).all()
    assert (cells.costate_defects(mu, p) < 1e-10 * np.abs(p).max()).all()
    bound = cells.reach(np.abs(cells.chain.pulse))
    moved = np.abs(x - x[0] * (np.arange(len(scale)) == len(scale) - 1) * centred)
    assert (moved.max(axis=0) <= bound * (1 + 1e-9)).all()
    assert (bound < 1e6 * scale).all()


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("coarse", [False, True])
def test_what_a_control_reaches_is_more_than_forty_digits_say(seed: int, coarse: bool) -> None:
    """y by residues at points within the cells, from rest; the reference is 0."""
    rng = np.random.default_rng(seed)
    plant, count = random_plant(rng), 60
    cell = Fraction(2 * math.pi / plant.pole_modes[0].omega) if coarse else Fraction(1, 250)
    cells, u = Cells(plant, cell, count, "rest"), whole(rng.uniform(-1, 1, count), False)
    claimed = reached(cells, u, Samples(np.zeros(count + 1), 0.0, 0.0), 1.7, slice(20, count))
    with mp.workdps(DIGITS):
        found, step, parts = mp.mpf(0), mp.mpf(cell.numerator) / cell.denominator, residues(plant)
        states = [mp.mpf(0)] * len(parts)

        def after(states: list[mp.mpc], command: mp.mpf, span: mp.mpf) -> list[mp.mpc]:
            held = [(mp.exp(p * span) - 1) / p if p else span for p, _ in parts]
            return [mp.exp(p * span) * x + command * h for x, (p, _), h in zip(states, parts, held, strict=True)]

        for k in range(count):
            for share in range(1, POINTS + 1):
                inside = after(states, mp.mpf(float(u[k])), step * share / POINTS)
                y = mp.re(mp.fsum(residue * x for x, (_, residue) in zip(inside, parts, strict=True)))
                if k >= 20:
                    found = max(found, abs(mp.mpf(1.7) * y))
            states = inside
        share = float((mp.mpf(claimed) - found) / found)
    assert 0 < share < (math.inf if coarse else 0.02)  # of a cell in which the resonance turns by 0.3 rad


def test_grains_sum_to_nothing_and_do_not_exceed_one() -> None:
    values = np.random.default_rng(1).uniform(-1, 1, 1001)
    values = (values - values.mean()) / np.abs(values - values.mean()).max()
    grains = whole(values, centred=True)
    assert grains.sum() == 0
    assert np.abs(grains).max() == 1.0
    np.testing.assert_allclose(grains, values, atol=1e-12)


def test_integral_of_the_size_of_a_chord() -> None:
    np.testing.assert_allclose(absolute_integral(np.array([1.0, 1.0, 0.0]), np.array([3.0, -3.0, 0.0])), [2, 1.25, 0])


# The interval


@pytest.mark.parametrize("seed", range(4))
def test_closed_form_of_an_integrator_is_inside_without_any_tolerance(seed: int) -> None:
    """a (sqrt(1 - rho^2) - rho arccos(rho)), in any units."""
    rng = np.random.default_rng(seed)
    amplitude, omega, rho = 10.0 ** rng.uniform(-9, 9), 10.0 ** rng.uniform(-9, 9), rng.uniform(0.05, 0.98)
    gain = float(10.0 ** rng.uniform(-15, 15) * rng.choice([-1.0, 1.0]))
    reference = sinusoid(amplitude, omega, rng.uniform(-3, 3), 10.0 ** rng.uniform(0, 3) * amplitude)
    plant = PlantModel(gain, (), (), 0.0)
    limit = rho * reference.required(plant).value
    found = periodic_limit(plant, reference, limit)
    with mp.workdps(DIGITS):
        exact = abs(mp.mpf(gain)) * mp.mpf(limit) / (mp.mpf(amplitude) * mp.mpf(omega))
        known = mp.mpf(amplitude) * (mp.sqrt(1 - exact**2) - exact * mp.acos(exact))
        assert mp.mpf(found.lower) <= known <= mp.mpf(found.upper)
    assert found.upper - found.lower < 1e-3 * amplitude


OF_EVERY_KIND = [
    PlantModel(2.0, (Mode(9.0, -0.3),), (Mode(25.0, 0.04),), 0.2, 1, (-30.0,), (12.0,)),
    PlantModel(2.0, (), (Mode(7.0, 0.1),), 0.2, 2, (-20.0,)),
    PlantModel(-1.0, (), (Mode(15.0, 0.1),), 0.1, -1, (), (30.0,)),
    PlantModel(0.2, (), (Mode(6.0, 0.4),), 0.1, -2, (), (20.0,)),
    PlantModel(0.3, (), (Mode(6.0, 0.4),), 0.1, -2),
    PlantModel(3.0, (Mode(20.0, 0.2),), (), 0.1, 1, (), (15.0,)),
    PlantModel(3.0, (), (), 0.1, 0, (-8.0,), (12.0,)),
]


@pytest.mark.parametrize("seed", range(len(OF_EVERY_KIND) + 1))
def test_dense_program_over_harmonics_lies_above_the_floor_and_near_it(seed: int) -> None:
    """Another formulation: u a sum of harmonics, its limits and the error asked for at many instants, then measured.

    Such a u within its limits is some control, so that its error cannot be below the floor; the best of them is not
    far.
    """
    rng = np.random.default_rng(seed)
    omega = 2.0
    plant = OF_EVERY_KIND[seed - 1] if seed else random_plant(rng, omega=30.0)
    reference = Reference((1.0, 0.4, 0.2), (omega, 2 * omega, 5 * omega), tuple(rng.uniform(-3, 3, 3)), 0.0)
    high = 0.85 * reference.required(plant).value
    low = -0.7 * high if seed else -high
    found = periodic_limit(plant, reference, (low, high))
    time_s = np.arange(INSTANTS) * (2 * math.pi / omega / INSTANTS)
    k = np.arange(1, 51)
    answer = plant(1j * omega * k)
    waves = np.exp(1j * omega * np.outer(time_s, k))
    control = np.hstack([waves.real, -waves.imag])
    output = np.hstack([(waves * answer).real, -(waves * answer).imag])
    if plant.integrators <= 0:
        level = plant.gain if plant.integrators == 0 else 0.0
        control, output = (np.hstack([m, np.full((INSTANTS, 1), x)]) for m, x in ((control, 1.0), (output, level)))
    else:
        control, output = np.hstack([control, np.zeros((INSTANTS, 1))]), np.hstack([output, np.ones((INSTANTS, 1))])
    zero, one = np.zeros((INSTANTS, 1)), np.ones((INSTANTS, 1))
    A = np.block([[output, -one], [-output, -one], [control, zero], [-control, zero]])
    r = reference(time_s)
    solution = linprog(
        np.append(np.zeros(output.shape[1]), 1.0),
        A_ub=A,
        b_ub=np.concatenate([r, -r, np.full(INSTANTS, high), np.full(INSTANTS, -low)]),
        bounds=[(None, None)] * (output.shape[1]) + [(0, None)],
    )
    x = solution.x[:-1]
    excess = 1.05 * max((control @ x).max() / high, (control @ x).min() / low)  # between the instants: 5 % is plenty
    error = np.abs(r - output @ (x / max(1.0, excess))).max()
    assert 0 < found.lower <= found.upper
    assert found.lower <= error
    assert found.upper <= 1.001 * error
    assert found.upper - found.lower < (0.05 if plant.integrators == -2 else 0.005) * np.abs(r).max()


@pytest.mark.parametrize("plant", OF_EVERY_KIND[1:])
def test_held_inputs_from_rest_do_no_better_and_little_worse(plant: PlantModel) -> None:
    """The best of inputs that stand still in 180 cells, by another program, another solver, and scipy's state space."""
    omega, count, first = 2.0, 180, 20
    reference = Reference((1.0, 0.3), (omega, 3 * omega), (0.4, 2.0), 0.0)
    high = 0.8 * reference.required(plant).value
    low = -0.9 * high
    rest = RestLimit(plant, reference, (low, high), steps=60)
    found = rest.at(first * 4)
    cell_s = 2 * math.pi / omega / 60
    assert rest.start_s(first * 4) == pytest.approx(plant.delay_s + first * cell_s)
    poles = [root for mode in plant.pole_modes for root in mode.roots] + [-rate for rate in plant.real_poles]
    zeros = [root for mode in plant.zero_modes for root in mode.roots] + [-rate for rate in plant.real_zeros]
    lead = plant.gain * float(np.real(np.prod([-p for p in poles]) / np.prod([-z for z in zeros])))
    zeros, poles = zeros + [0.0] * -plant.integrators, poles + [0.0] * plant.integrators
    A, B, C, D = zpk2ss(zeros, poles, lead)
    F, G, *_ = cont2discrete((A, B, C, D), cell_s / PARTS)
    x, rows, time_s = np.zeros((len(A), count)), [], []
    for k in range(count):
        unit = np.eye(1, count, k)
        for part in range(PARTS + 1):  # y just after the input has jumped, and up to just before it does again
            rows.append(C @ x + D * unit)
            time_s.append((k + part / PARTS) * cell_s)
            x = F @ x + G @ unit if part < PARTS else x
    counted = np.array(time_s) > (first - 0.5 / PARTS) * cell_s
    u, peak = cvxpy.Variable(count), cvxpy.Variable()
    error = reference(np.array(time_s)[counted] + plant.delay_s) - high * np.vstack(rows)[counted] @ u
    cvxpy.Problem(cvxpy.Minimize(peak), [cvxpy.abs(error) <= peak, low / high <= u, u <= 1]).solve(
        solver="CLARABEL", **dict.fromkeys(("tol_feas", "tol_gap_abs", "tol_gap_rel"), 1e-6)
    )
    best = float(peak.value)
    assert found.lower <= best + 1e-4
    assert best - found.lower < (0.25 if plant.integrators == -2 else 0.1)


def in_units(time_unit: float, gain_unit: float, output_unit: float) -> np.ndarray:
    """The ends of a periodic interval and of one from rest, divided by the unit of the output."""

    def mode(omega: float, zeta: float) -> Mode:
        return Mode(omega / time_unit, zeta)

    gain, omegas = 3.0 * output_unit * gain_unit / time_unit, (1.5 / time_unit, 4.5 / time_unit)
    plant = PlantModel(gain, (mode(30.0, 0.05),), (mode(45.0, 0.02),), 0.03 * time_unit)
    reference = Reference((5.0 * output_unit, output_unit), omegas, (0.4, 1.0), 9.0 * output_unit)
    limit = 2.5 / gain_unit
    found = periodic_limit(plant, reference, limit), RestLimit(plant, reference, limit, steps=40).at(30)
    return np.array([(interval.lower, interval.upper) for interval in found]) / output_unit


@pytest.fixture(scope="module")
def in_usual_units() -> np.ndarray:
    found = in_units(1.0, 1.0, 1.0)
    assert (found > 0.01).all()
    return found


@pytest.mark.parametrize("units", [(2.0**-30, 2.0**50, 1.0), (2.0**30, 2.0**-50, 2.0**20)])
def test_units_that_are_powers_of_two_change_no_bit(in_usual_units: np.ndarray, units: tuple[float, ...]) -> None:
    np.testing.assert_array_equal(in_units(*units), in_usual_units)


@pytest.mark.parametrize("units", [(1e-9, 1e-15, 1e6), (1e9, 1e15, 1e-9), (1e9, 1e-15, 1.0), (1e-9, 1e15, 1.0)])
def test_no_unit_of_time_input_or_output_changes_the_interval(
    in_usual_units: np.ndarray, units: tuple[float, ...]
) -> None:
    np.testing.assert_allclose(in_units(*units), in_usual_units, rtol=1e-3)


def test_refusals() -> None:
    slow = PlantModel(1.0, (), (), 0.0, 0, (), (1e-15,))
    with pytest.raises(InputError, match="a pole of the plant is too slow"):
        periodic_limit(slow, sinusoid(1.0, 1.0, 0.0, 0.0), 1e-3)
    with pytest.raises(InputError, match="has the slope 2 a second; expected a periodic one"):
        periodic_limit(PlantModel(1.0, (), (), 0.0), Reference((1.0,), (1.0,), (0.0,), 0.0, 2.0), 1.0)
    assert fastest(PlantModel(1.0, (), (Mode(3.0, 2.0),), 0.0)) == pytest.approx(3.0 * (2 + math.sqrt(3)))
