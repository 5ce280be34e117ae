"""Margins against closed forms and python-control, and against the characteristic roots at every margin."""

from __future__ import annotations

import dataclasses

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.blocks.block import Block, bound_block, geometric_scale, plant_block
from design.blocks.state_space import realize
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from design.stability.characteristic_roots import rightmost_roots, roots_right_of
from design.stability.delay_loop import DelayLoop
from design.stability.margins import Margins, delay_loop, margins_of, tracking_floor
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

ONE, NONE = Block(1.0), Block(0.0)
BOUND = AdditiveBound.printed_form(0.01, 20.0, 280.0, 0.05)
some = settings(max_examples=5, deadline=None, derandomize=True)


def integrator(gain: float, delay_s: float) -> DelayLoop:
    return DelayLoop(Block(gain, (), (0.0,), delay_s), ONE, NONE, 0.0)


def with_gain(loop: DelayLoop, factor: float) -> DelayLoop:
    return dataclasses.replace(loop, plant=loop.plant.scaled(factor))


def with_delay(loop: DelayLoop, delay_s: float) -> DelayLoop:
    return dataclasses.replace(loop, plant=Block(loop.plant.gain, loop.plant.zeros, loop.plant.poles, delay_s))


def sensitivity(loop: DelayLoop, omega: np.ndarray) -> np.ndarray:
    """S from the blocks as they are."""
    s = 1j * omega
    inner = 1 - loop.feedback(s) * np.exp(-loop.delay_s * s)
    return np.asarray(inner / (inner + loop.plant(s) * loop.forward(s)))


def expect_on_the_axis(loop: DelayLoop, omega: float | None) -> None:
    assert omega is not None
    roots = rightmost_roots(loop, 6).roots
    assert np.abs(roots - 1j * omega).min() < 1e-6 * max(omega, geometric_scale(loop.plant, loop.forward))


def check_against_roots(loop: DelayLoop, margins: Margins) -> None:
    """At each margin a root on the axis where it says, none right of it just inside, one or more just outside."""
    inside = 1e-4
    assert margins.gain_down.value < 1 < margins.gain_up.value
    delay_s = loop.plant.delay_s
    assert margins.delay_least_s.value <= delay_s <= margins.delay_greatest_s.value
    for margin, sign in ((margins.gain_down, 1), (margins.gain_up, -1)):
        if margin.omega is not None:
            expect_on_the_axis(with_gain(loop, margin.value), margin.omega)
            assert roots_right_of(with_gain(loop, margin.value * (1 + sign * inside)), 0.0) == 0
            assert roots_right_of(with_gain(loop, margin.value * (1 - sign * inside)), 0.0) > 0
    for factor in (2e-3, 900.0):
        if margins.gain_down.value < factor < margins.gain_up.value:
            assert roots_right_of(with_gain(loop, factor), 0.0) == 0
    for margin, sign in ((margins.delay_least_s, 1), (margins.delay_greatest_s, -1)):
        if margin.omega is not None:
            expect_on_the_axis(with_delay(loop, margin.value), margin.omega)
            nearer = margin.value + sign * inside * abs(margin.value - delay_s)
            farther = max(margin.value - sign * inside * abs(margin.value - delay_s), 0.0)
            assert roots_right_of(with_delay(loop, nearer), 0.0) == 0
            assert margin.value == 0 or roots_right_of(with_delay(loop, farther), 0.0) > 0
        elif margin is margins.delay_least_s:
            assert roots_right_of(with_delay(loop, 0.0), 0.0) == 0
        else:
            assert roots_right_of(with_delay(loop, 30 * delay_s + 1 / geometric_scale(loop.plant)), 0.0) == 0


def check_against_a_grid(loop: DelayLoop, bound: AdditiveBound, margins: Margins, omega: np.ndarray) -> None:
    """No point of a dense grid beats a peak, and the peak is attained where it says."""
    P, F, W = loop.plant, loop.forward, bound_block(bound)
    for margin, function in (
        (margins.modulus, lambda w: 1 / np.abs(sensitivity(loop, w))),
        (margins.T_peak, lambda w: np.abs(1 - sensitivity(loop, w))),
        (
            margins.W_a_C_S,
            lambda w: np.abs(
                W(1j * w)
                * F(1j * w)
                / (1 - loop.feedback(1j * w) * np.exp(-1j * w * loop.delay_s) + P(1j * w) * F(1j * w))
            ),
        ),
    ):
        values = function(omega)
        extreme = values.min() if margin is margins.modulus else values.max()
        assert margin.value == pytest.approx(extreme, rel=1e-3)
        beaten = extreme - margin.value if margin is margins.modulus else margin.value - extreme
        assert beaten > -1e-9 * margin.value
        if margin.omega and np.isfinite(margin.omega):
            at = np.array([max(margin.omega, 1e-4 * omega[0])])
            assert function(at)[0] == pytest.approx(margin.value, rel=1e-6)


# closed forms


@pytest.mark.parametrize(
    ("delay", "turn"), [(1e-5, 1e-2), (1e-5, 1.5), (0.1, 0.3), (0.1, 1.2), (40.0, 1e-2), (40.0, 1.5)]
)
def test_integrator_with_dead_time(delay: float, turn: float) -> None:
    gain = turn / delay
    loop = integrator(gain, delay)
    margins = margins_of(loop, BOUND)
    assert margins.gain_up.value == pytest.approx(np.pi / 2 / turn, rel=1e-12)
    assert margins.gain_up.omega == pytest.approx(np.pi / 2 / delay, rel=1e-12)
    assert margins.gain_down == (0.0, None)
    assert margins.phase_deg.value == pytest.approx(np.degrees(np.pi / 2 - turn), rel=1e-11)
    assert margins.phase_deg.omega == pytest.approx(gain, rel=1e-12)
    assert margins.delay_greatest_s.value == pytest.approx(np.pi / 2 / gain, rel=1e-12)
    assert margins.delay_least_s == (0.0, None)
    omega = np.linspace(1e-3, 12, 20_001) / delay
    assert margins.modulus.value == pytest.approx(np.min(np.abs(1 + gain / (1j * omega) * np.exp(-1j * omega * delay))))
    check_against_roots(loop, margins)


def test_first_order_lag_without_limits() -> None:
    """0.5/(s + 1): |L| < 1 at all frequencies, whatever the dead time."""
    margins = margins_of(DelayLoop(Block(0.5, (), (-1.0,)), ONE, NONE, 0.0), BOUND)
    assert (margins.gain_down, margins.gain_up) == ((0.0, None), (np.inf, None))
    assert margins.phase_deg == (np.inf, None)
    assert (margins.delay_least_s, margins.delay_greatest_s) == ((0.0, None), (np.inf, None))
    assert margins.modulus == (1.0, np.inf)
    assert margins.T_peak.value == pytest.approx(1 / 3, rel=1e-9)
    assert margins.hidden == ()


def test_conditional_stability() -> None:
    """k (s + 1)^2/s^3 is stable for k > 1/2 alone."""
    loop = DelayLoop(Block(2.0, (-1.0, -1.0), (0.0, 0.0, 0.0)), ONE, NONE, 0.0)
    margins = margins_of(loop, BOUND)
    assert margins.gain_down.value == pytest.approx(0.25, rel=1e-12)
    assert margins.gain_down.omega == pytest.approx(1.0, rel=1e-12)
    assert margins.gain_up == (np.inf, None)
    check_against_roots(loop, margins)
    late = with_delay(loop, 0.05)
    check_against_roots(late, margins_of(late, BOUND))


def test_unstable_plant_needs_its_gain() -> None:
    """k/(s - 1) is stable for k > 1, with a root at 0 where k = 1; a dead time allows k up to about pi/(2 h)."""
    for delay in (0.0, 0.1):
        loop = DelayLoop(Block(4.0, (), (1.0,), delay), ONE, NONE, 0.0)
        margins = margins_of(loop, BOUND)
        assert margins.gain_down.value == pytest.approx(0.25, rel=1e-12)
        assert margins.gain_down.omega == 0
        check_against_roots(loop, margins)


def test_least_dead_time() -> None:
    """1/(s^2 + 1) with gain -0.2 is stable only for dead times in bands between about k pi, one of them 0 to pi."""
    loop = DelayLoop(Block(-0.2, (), (1j, -1j), 1.0), ONE, NONE, 0.0)
    with_floor = with_delay(DelayLoop(Block(0.2, (), (1j, -1j)), ONE, NONE, 0.0), 4.5)
    for each in (loop, with_floor):
        check_against_roots(each, margins_of(each, BOUND))
    # e^(-j w h) = (w^2 - 1)/0.2: w^2 = 1.2 where w h = 2 pi k, w^2 = 0.8 where w h = (2 k + 1) pi
    margins = margins_of(with_floor, BOUND)
    assert margins.delay_least_s.value == pytest.approx(np.pi / np.sqrt(0.8), rel=1e-11)
    assert margins.delay_greatest_s.value == pytest.approx(2 * np.pi / np.sqrt(1.2), rel=1e-11)


# python-control


@pytest.mark.parametrize(
    "L",
    [
        Block(4.0, (), (-1.0, -1.0, -1.0)),
        Block(20.0, (-3.0,), (0.0, -1.0, -8.0, -10.0)),
        Block(5.0, (-2.0,), (0.0, -0.1 + 4j, -0.1 - 4j, -9.0)),
        Block(3e3, (-1.0, -2.0), (0.0, 0.0, 0.0, -40.0, -50.0)),
        Block(6.0, (3.0,), (-1.0, -2.0, -5.0)).scaled(-1.0),
    ],
)
def test_delay_free_margins_are_python_controls(L: Block) -> None:
    system = realize(L)
    model = control.ss(system.A, system.b[:, None], system.C, system.d[:, None])
    margins = margins_of(DelayLoop(L, ONE, NONE, 0.0), BOUND)
    gains, phases, stability, at_gain, at_phase, _ = control.stability_margins(model, returnall=True)
    up = gains > 1
    if np.any(up):
        best = int(np.argmin(gains[up]))
        assert margins.gain_up.value == pytest.approx(gains[up][best], rel=1e-6)
        assert margins.gain_up.omega == pytest.approx(at_gain[up][best], rel=1e-6)
    down = (gains < 1) & (gains > 1e-3)
    assert margins.gain_down.value == pytest.approx(gains[down].max() if np.any(down) else 0.0, rel=1e-6)
    least = int(np.argmin(np.abs(phases)))
    assert margins.phase_deg.value == pytest.approx(abs(phases[least]), rel=1e-6)
    assert margins.phase_deg.omega == pytest.approx(at_phase[least], rel=1e-6)
    assert margins.modulus.value == pytest.approx(stability.min(), rel=1e-6)


def test_modulus_margin_is_the_disk_margin_of_s() -> None:
    L = Block(20.0, (-3.0,), (0.0, -1.0, -8.0, -10.0))
    system = realize(L)
    model = control.ss(system.A, system.b[:, None], system.C, system.d[:, None])
    omega = np.geomspace(0.05, 100, 4001)
    margins = margins_of(DelayLoop(L, ONE, NONE, 0.0), BOUND)
    assert margins.modulus.value == pytest.approx(control.disk_margins(model, omega, skew=1.0)[0], rel=1e-5)
    assert margins.T_peak.value == pytest.approx(1 / control.disk_margins(model, omega, skew=-1.0)[0], rel=1e-5)


# the thesis's designs


def test_extended_design_has_no_guarantee(extended_design: Design, implied: IdentifiedModel) -> None:
    """|W_a C S| peaks at 8.8 where the controller inverts the anti-resonance at 175 rad/s."""
    loop = delay_loop(extended_design, implied.plant)
    margins = margins_of(loop, implied.additive_bound)
    assert margins.W_a_C_S.value == pytest.approx(8.84, abs=0.005)
    assert margins.W_a_C_S.omega == pytest.approx(175.0, abs=0.05)
    assert not margins.is_guaranteed
    assert margins.hidden == (0.0,)
    check_against_roots(loop, margins)
    omega = np.concatenate([np.geomspace(1e-3, 1e4, 50_001), np.linspace(174, 176, 20_001)])
    check_against_a_grid(loop, implied.additive_bound, margins, omega)


@pytest.mark.parametrize("factor", [0.0, 1.0, 2.5])
def test_delay_free_design_on_the_plant_with_dead_time(
    delay_free_design: Design, implied: IdentifiedModel, factor: float
) -> None:
    plant = dataclasses.replace(implied.plant, delay_s=factor * implied.plant.delay_s)
    loop = delay_loop(delay_free_design, plant)
    margins = margins_of(loop, implied.additive_bound)
    assert margins.hidden == (0.0,)
    check_against_roots(loop, margins)
    omega = np.concatenate([np.geomspace(1e-3, 1e4, 50_001), *(np.linspace(w - 1, w + 1, 10_001) for w in (282, 958))])
    check_against_a_grid(
        loop, implied.additive_bound, margins, omega[np.abs(omega - delay_free_design_omega(loop)) > 0]
    )


def delay_free_design_omega(loop: DelayLoop) -> float:
    """The controller's pole on the axis, where S is 0/0 when evaluated from L."""
    return max(abs(pole) for pole in loop.forward.poles if pole.real == 0)


def test_delay_margin_does_not_depend_on_where_it_starts(delay_free_design: Design, implied: IdentifiedModel) -> None:
    greatest = [
        margins_of(
            delay_loop(delay_free_design, dataclasses.replace(implied.plant, delay_s=delay)), implied.additive_bound
        ).delay_greatest_s.value
        for delay in (0.0, 5e-3, 20e-3)
    ]
    np.testing.assert_allclose(greatest, greatest[0], rtol=1e-10)


def test_tracking_floor(implied: IdentifiedModel, extended_design: Design) -> None:
    plant, bound = implied.plant, implied.additive_bound
    assert tracking_floor(plant, bound, [0.0]) == 0  # the plant integrates
    floors = [abs(complex(bound(1j * w)) / complex(plant(1j * w))) for w in (1.5, 20.0)]
    assert tracking_floor(plant, bound, [1.5]) == pytest.approx(floors[0], rel=1e-12)
    assert tracking_floor(plant, bound, [0.0, 20.0, 1.5]) == pytest.approx(max(floors), rel=1e-12)
    without = dataclasses.replace(plant, integrators=0)
    assert tracking_floor(without, bound, [0.0]) == pytest.approx(bound.gain / plant.gain, rel=1e-12)
    # attained at the reference's frequency, exceeded elsewhere
    omega = extended_design.reference_omegas[0]
    loop = delay_loop(extended_design, plant)
    s = np.array([1j * omega * (1 + 1e-7)])
    inner = 1 - loop.feedback(s) * np.exp(-loop.delay_s * s)
    W_a_C_S = abs((bound(s) * loop.forward(s) / (inner + loop.plant(s) * loop.forward(s)))[0])
    assert pytest.approx(tracking_floor(plant, bound, [omega]), rel=1e-5) == W_a_C_S
    assert margins_of(loop, bound).W_a_C_S.value >= W_a_C_S


# random loops


@st.composite
def models(draw: st.DrawFn) -> IdentifiedModel:
    count = draw(st.integers(0, 3))
    speeds = np.geomspace(40.0, 900.0, 2 * count + 1) * draw(st.floats(0.7, 1.4))
    order = draw(st.permutations(range(2 * count)))
    damping = [draw(st.sampled_from([1e-3, 0.01, 0.1])) for _ in range(2 * count)]
    modes = [Mode(float(speeds[k]), zeta) for k, zeta in zip(order, damping, strict=True)]
    gain = draw(st.sampled_from([-1.0, 1.0])) * draw(st.floats(0.1, 30.0))
    plant = PlantModel(gain, tuple(modes[:count]), tuple(modes[count:]), draw(st.sampled_from([1e-3, 8e-3, 0.05])))
    bound = AdditiveBound.printed_form(0.002 * abs(gain), 20.0, draw(st.floats(100.0, 500.0)), 0.02)
    return IdentifiedModel(plant, bound)


@some
@given(
    model=models(),
    omega=st.floats(0.3, 6.0),
    a=st.floats(1.0, 12.0),
    mismatch=st.sampled_from([0.7, 1.0, 1.3]),
    detuned=st.booleans(),
)
def test_margins_of_random_extended_designs(
    model: IdentifiedModel, omega: float, a: float, mismatch: float, detuned: bool
) -> None:
    design = design_extended(model, reference_omegas=[omega], a=a, pairs=[(2.0, 1.0)])
    plant = dataclasses.replace(model.plant, delay_s=mismatch * model.plant.delay_s)
    if detuned:  # so that the controller's zeros and poles no longer cancel the plant's
        plant = dataclasses.replace(
            plant, pole_modes=tuple(Mode(1.002 * mode.omega, mode.zeta) for mode in plant.pole_modes)
        )
    loop = delay_loop(design, plant)
    unstable = roots_right_of(loop, 0.0)
    if unstable:
        with pytest.raises(InputError, match=f"{unstable} roots in the right half plane"):
            margins_of(loop, model.additive_bound)
        return
    margins = margins_of(loop, model.additive_bound)
    check_against_roots(loop, margins)
    roots = rightmost_roots(loop, 12).roots
    modes = np.concatenate([roots, loop.plant.zeros, [mode.omega * 1j for mode in model.additive_bound.pole_modes]])
    near = [np.abs(m.imag) + max(abs(m.real), 1e-4) * np.linspace(-3, 3, 401) for m in modes if abs(m.imag) > 0]
    grid = np.unique(np.abs(np.concatenate([np.geomspace(1e-3, 1e5, 10_001), *near])))
    check_against_a_grid(loop, model.additive_bound, margins, grid[(grid > 1e-3) & (np.abs(grid - omega) > 1e-5)])


@pytest.mark.parametrize("zeta", [1e-2, 1e-4, 1e-6])
def test_no_resonance_is_narrow_enough_to_hide(zeta: float) -> None:
    """An integrator whose plant rings: the gain is limited by the mode alone, however narrow it is."""
    mode = Mode(300.0, zeta)
    plant = PlantModel(1.0, (), (mode,), 4 * np.pi / 300)
    loop = DelayLoop(plant_block(plant), Block(300.0 * zeta), NONE, 0.0)
    margins = margins_of(loop, BOUND)
    assert margins.gain_up.omega == pytest.approx(300.0, rel=5 * zeta)
    assert margins.gain_up.value == pytest.approx(2.0, rel=10 * zeta)
    expect_on_the_axis(with_gain(loop, margins.gain_up.value), margins.gain_up.omega)
    assert roots_right_of(with_gain(loop, 0.99 * margins.gain_up.value), 0.0) == 0
    assert roots_right_of(with_gain(loop, 1.01 * margins.gain_up.value), 0.0) == 2


def test_a_narrow_peak_of_the_bound_far_above_the_loop_counts() -> None:
    bound = AdditiveBound.printed_form(0.01, 20.0, 5e4, 1e-6)
    margins = margins_of(integrator(3.0, 0.01), bound)
    assert margins.W_a_C_S.omega == pytest.approx(5e4, rel=1e-9)
    assert margins.W_a_C_S.value == pytest.approx(abs(complex(bound(5e4j))), rel=1e-3)  # C S is 1 there
    assert not margins.is_guaranteed


def test_a_peak_that_barely_exceeds_one_counts() -> None:
    """|L| > 1 by 1e-8 on a band that no grid would hit: a dead time exists that destabilises, without it none does."""
    zeta, omega = 0.2, 7.0
    top = omega * np.sqrt(1 - 2 * zeta**2)
    for excess, limited in ((1e-8, True), (-1e-8, False)):
        gain = (1 + excess) * 2 * zeta * np.sqrt(1 - zeta**2) * omega**2
        roots = Mode(omega, zeta).roots
        margins = margins_of(DelayLoop(Block(gain, (), roots), ONE, NONE, 0.0), BOUND)
        if limited:
            assert margins.delay_greatest_s.omega == pytest.approx(top, rel=1e-3)
            phase = np.angle(Block(gain, (), roots)(1j * top))
            assert margins.delay_greatest_s.value == pytest.approx((phase + np.pi) / top, rel=1e-3)
            assert margins.phase_deg.value == pytest.approx(np.degrees(phase + np.pi), rel=1e-3)
        else:
            assert margins.delay_greatest_s == (np.inf, None)
            assert margins.phase_deg == (np.inf, None)


def test_no_turn_of_a_long_dead_time_hides() -> None:
    """A broad hump of |L| within which the dead time turns L a hundred times: one of them limits the gain."""
    omega, zeta, delay = 10.0, 0.3, 60.0
    loop = DelayLoop(Block(0.01 * omega**2, (), Mode(omega, zeta).roots, delay), ONE, NONE, 0.0)
    margins = margins_of(loop, BOUND)
    assert margins.gain_up.value == pytest.approx(100 * 2 * zeta * np.sqrt(1 - zeta**2), rel=1e-3)
    assert roots_right_of(with_gain(loop, (1 - 1e-6) * margins.gain_up.value), 0.0) == 0
    assert roots_right_of(with_gain(loop, (1 + 1e-6) * margins.gain_up.value), 0.0) == 2


# refusals


@pytest.mark.parametrize(
    ("loop", "sentence"),
    [
        (integrator(20.0, 0.1), "2 roots in the right half plane"),
        (integrator(-1.0, 0.1), "1 root in the right half plane"),
        (integrator(np.pi / 2 / 0.1, 0.1), "a root lies on the line of real part 0"),
        # a pole of the plant at 2 that the controller cancels
        (
            DelayLoop(Block(1.0, (), (0.0, 2.0)), Block(3.0, (2.0,), (-5.0,)), NONE, 0.0),
            "1 root in the right half plane",
        ),
    ],
)
def test_unstable_loops_have_no_margins(loop: DelayLoop, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        margins_of(loop, BOUND)


@pytest.mark.parametrize("omegas", [[], [-1.0], [1.0, np.inf], [np.nan]])
def test_references_without_frequencies_are_refused(implied: IdentifiedModel, omegas: list[float]) -> None:
    with pytest.raises(InputError, match="the reference has the frequencies"):
        tracking_floor(implied.plant, implied.additive_bound, omegas)
