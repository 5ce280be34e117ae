"""The sector that a run needs, by other means; what the promise says, put to the test; and that the commands say it."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from design.anti_windup.circle_criterion import circle_sector
from design.anti_windup.compensator import from_one_plus, second_order
from design.anti_windup.popov import popov_sector
from design.blocks.block import Block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.__main__ import main
from experiments.campaign.draw_plants import PlantsWithin
from experiments.engine.simulate import simulate
from experiments.runs.compare_anti_windups import loops, run_all, tracking_summary, verdicts
from experiments.runs.design_loop import design_loop
from experiments.runs.guarantee import Guarantee, guarantee, guarantee_within
from experiments.runs.references import Reference, SampledReference, sinusoid
from experiments.runs.sector_promise import judge_run, needed_sector, steady_control, verdict
from experiments.runs.verdict import Verdict
from experiments.runs.words import sector_text
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies.chapter_2 import delay_free_tables
from experiments.thesis.studies.chapter_4 import extended_tables
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

CHAPTER_4 = sinusoid(50.0, 1.5, np.pi / 2, 0.0)
AMPLITUDE = 50 * 1.5 / 7.105  # of the control that follows it, but for the modes


@pytest.fixture(scope="module")
def extended_design(implied: IdentifiedModel) -> Design:
    """The design of chapter 4 for a sector, which promises nothing beyond it."""
    return design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], sector=0.95)


def judged(
    design: Design,
    limits: tuple[float, float],
    reference: Reference | SampledReference,
    until_s: float,
    rows: int = 100,
) -> Verdict:
    kind = design.compensator("corrected")
    loop = design_loop(design, reference, kind)
    run = simulate(loop, limits, np.linspace(0.0, until_s, rows + 1))
    return judge_run(guarantee(design, kind), loop, limits, run, reference, design.loop_plant)


def densely(design: Design, limits: tuple[float, float], reference: Reference, until_s: float) -> tuple[float, float]:
    """The largest secant and the largest |u| of a plain run, from u, 1/P and the limits, sample by sample."""
    loop = design_loop(design, reference, design.compensator("corrected"))
    time_s = np.linspace(0.0, until_s, 100001)
    control = simulate(dataclasses.replace(loop, outputs={}), limits, time_s).control
    steady = np.zeros(len(time_s))
    for amplitude, omega, phase in zip(reference.amplitudes, reference.omegas, reference.phases_rad, strict=True):
        inverse = 1 / complex(design.loop_plant(1j * omega))
        steady += amplitude * abs(inverse) * np.sin(omega * time_s + phase + np.angle(inverse))
    low, high = limits
    above, below = control > high, control < low
    secants = np.concatenate(
        [
            (control[above] - high) / (control[above] - steady[above]),
            (low - control[below]) / (steady[below] - control[below]),
            [0.0],
        ]
    )
    return float(secants.max()), float(np.abs(control).max())


@settings(max_examples=200, deadline=None)
@given(
    low=st.floats(-10, -0.1),
    high=st.floats(0.1, 10),
    control=st.floats(-1e3, 1e3),
    share=st.floats(0.001, 0.999),
    k=st.floats(0.0, 1.0),
)
def test_the_needed_sector_is_the_least_that_holds(
    low: float, high: float, control: float, share: float, k: float
) -> None:
    """u_tilde lies between 0 and k (u - v_s) if and only if k is no less than the needed sector."""
    steady = low + share * (high - low)
    needed = float(needed_sector(np.array([control]), np.array([steady]), (low, high))[0])
    beyond, away = control - min(max(control, low), high), control - steady
    assert 0 <= needed <= 1
    assert beyond * (needed * away - beyond) >= -1e-9 * (1 + beyond**2)
    if abs(k - needed) > 1e-9:
        assert (beyond * (k * away - beyond) >= 0) == (k > needed or beyond == 0)


@settings(max_examples=200, deadline=None)
@given(
    U=st.floats(1.01, 1e6), V=st.floats(0.0, 0.99), u=st.floats(-1, 1), v=st.floats(-1, 1), limit=st.floats(1e-3, 1e3)
)
def test_no_control_up_to_the_covered_one_leaves_the_guarantee(
    U: float, V: float, u: float, v: float, limit: float
) -> None:
    most = (U - 1) / (U - V)
    found = needed_sector(np.array([u * U * limit]), np.array([v * V * limit]), (-limit, limit))[0]
    assert found <= most * (1 + 1e-9)
    time_s, controls, steady = np.arange(2.0), np.array([0.0, U * limit]), np.array([V * limit, V * limit])
    just = verdict(Guarantee(min(most * (1 + 1e-6), 1.0)), time_s, controls, steady, (-limit, limit))
    assert just.covered
    assert not dataclasses.replace(just, guarantee=Guarantee(most * (1 - 1e-6))).covered
    assert dataclasses.replace(just, guarantee=Guarantee(most)).covered_control == pytest.approx(U * limit, rel=1e-6)


@pytest.mark.parametrize("limits", [(-12.0, 12.0), (-20.0, 20.0), (-45.0, 45.0), (-14.0, 60.0), (-60.0, 14.0)])
def test_the_largest_secant_is_found_whatever_the_rows(extended_design: Design, limits: tuple[float, float]) -> None:
    secant, control = densely(extended_design, limits, CHAPTER_4, 6.0)
    few, many = (judged(extended_design, limits, CHAPTER_4, 6.0, rows) for rows in (6, 6000))
    assert few.needed_sector == pytest.approx(many.needed_sector, rel=1e-11)
    assert few.largest_control == pytest.approx(many.largest_control, rel=1e-11)
    for found in (few, many):
        assert secant * (1 - 1e-12) <= found.needed_sector <= secant * (1 + 1e-4)
        assert control * (1 - 1e-12) <= found.largest_control <= control * (1 + 1e-4)
        assert found.limits == limits
        assert found.covered == (secant < found.guarantee.sector)


def test_the_line_of_the_readme(extended_design: Design) -> None:
    """|u| reaches 569 under +-12, where 0.95 covers (12 - 0.95 * 10.56)/0.05 = 39.5."""
    found = judged(extended_design, (-12.0, 12.0), CHAPTER_4, 30.0)
    assert not found.covered
    assert found.largest_control == pytest.approx(569.3, abs=0.1)
    assert found.steady == pytest.approx((-AMPLITUDE, AMPLITUDE), rel=1e-3)
    k = extended_design.corrected.judgement.popov_sector
    assert found.guarantee.sector == pytest.approx(k, abs=1e-4)
    assert found.covered_control == pytest.approx((12 - k * AMPLITUDE) / (1 - k), rel=3e-3)
    assert found.needed_sector == pytest.approx(0.987, abs=5e-4)
    assert str(found).startswith("NOT covered by its guarantee, which it left at t = 0.006")
    assert "the run needs the sector 0.987 at t = 1.01 s, 0.95 is guaranteed (|u| reached 569; up to 39" in str(found)


@pytest.mark.parametrize("name", ["extended_design", "delay_free_design"])
@pytest.mark.parametrize("slope", [0.0, -20.0])
def test_v_settles_at_the_steady_control(name: str, slope: float, request: pytest.FixtureRequest) -> None:
    design: Design = request.getfixturevalue(name)
    usual = thesis_reference(design.kind, design.reference_omegas)
    reference = dataclasses.replace(usual, offset=3.0, slope=slope)
    time_s = np.linspace(0.0, 400.0, 4001)
    run = simulate(design_loop(design, reference, None), (-np.inf, np.inf), time_s)
    late = time_s > 390
    steady = steady_control(reference, design.loop_plant, time_s)[late]
    np.testing.assert_allclose(run.control[late], steady, atol=1e-6 * np.abs(steady).max())


def test_a_sampled_reference_ends_as_a_constant(extended_design: Design) -> None:
    reference = SampledReference(np.array([0.0, 1.0, 2.0]), np.array([0.0, 40.0, -20.0]))
    time_s = np.linspace(0.0, 30.0, 3001)
    run = simulate(design_loop(extended_design, reference, None), (-np.inf, np.inf), time_s)
    assert np.abs(run.control[time_s > 29]).max() < 1e-6
    assert not steady_control(reference, extended_design.plant, time_s).any()
    found = judged(extended_design, (-5.0, 5.0), reference, 30.0)
    assert found.steady == (0, 0)
    assert found.needed_sector == pytest.approx(1 - 5 / found.largest_control, rel=1e-9)
    assert found.covered_control == pytest.approx(5 / (1 - found.guarantee.sector))


def norm(signal: np.ndarray, time_s: np.ndarray) -> float:
    return float(np.sqrt(np.trapezoid(signal**2, time_s)))


@pytest.mark.parametrize(("phase", "limit"), [(0.0, 11.0), (0.7, 30.0), (0.7, 60.0), (np.pi / 2, 45.0)])
def test_the_promise_is_kept(extended_design: Design, phase: float, limit: float) -> None:
    """||u_tilde|| <= ||v - v_s||/(1/k - 1/k_c), of the run and of its beginnings."""
    reference, kind = sinusoid(50.0, 1.5, phase, 0.0), extended_design.compensator("corrected")
    found = judged(extended_design, (-limit, limit), reference, 8.0)
    assert found.covered
    time_s = np.linspace(0.0, 8.0, 100001)
    run = simulate(design_loop(extended_design, reference, kind), (-limit, limit), time_s)
    transient = run.outputs["v"] - steady_control(reference, extended_design.plant, time_s)
    beyond = run.control - run.saturated_control
    gap = 1 / found.needed_sector - 1 / circle_sector(kind.theta1_tilde)
    for share in (0.01, 0.1, 1.0):
        part = slice(0, int(share * len(time_s)))
        assert norm(beyond[part], time_s[part]) <= norm(transient[part], time_s[part]) / gap
    assert norm(beyond, time_s) > 0


def test_the_promise_is_kept_within_the_bound(implied: IdentifiedModel) -> None:
    """The same for plants within W_a, v and v_s being those of each one's own linear loop."""
    design = design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], robust_level=0.5, sector=0.95)
    kind = design.compensator("corrected")
    given_within = guarantee_within(design, kind)
    assert 0.9 < given_within.sector < circle_sector(kind.theta1_tilde)
    plants = PlantsWithin(design.loop_plant, design.additive_bound)
    time_s = np.linspace(0.0, 5.0, 50001)
    for index in range(3):
        true = plants.draw(5, index).plant
        assert guarantee(design, kind, true) == given_within
        loop = design_loop(design, CHAPTER_4, kind, true)
        run, linear = (simulate(loop, (-limit, limit), time_s) for limit in (25.0, np.inf))
        found = judge_run(given_within, loop, (-25.0, 25.0), run, CHAPTER_4, true)
        assert found.covered
        assert found.needed_sector > 0
        transient = linear.control - steady_control(CHAPTER_4, true, time_s)
        gap = 1 / found.needed_sector - 1 / given_within.sector
        assert norm(run.control - run.saturated_control, time_s) <= norm(transient, time_s) / gap


def test_which_true_plants_a_guarantee_speaks_of(extended_design: Design) -> None:
    kind, plant = extended_design.compensator("corrected"), extended_design.plant
    assert guarantee(extended_design, kind, plant) == guarantee(extended_design, kind)
    near = dataclasses.replace(plant, pole_modes=(Mode(282.001, 0.0195), *plant.pole_modes[1:]))
    assert "|W_a C S| reaches 8.84" in guarantee(extended_design, kind, near).missing
    for far in (
        dataclasses.replace(plant, gain=plant.gain * (1 + 1e-9)),
        dataclasses.replace(plant, delay_s=0.5),
        dataclasses.replace(plant, pole_modes=(Mode(250.0, 0.001), *plant.pole_modes[1:])),
        dataclasses.replace(plant, integrators=2),
    ):
        assert "not within W_a" in guarantee(extended_design, kind, far).missing
        assert guarantee(extended_design, kind, far).sector == 0


@pytest.mark.parametrize(("gain", "rate", "within"), [(1 / 1.2, 0.012, True), (-1.0, -0.01, False)])
def test_a_plant_with_another_number_of_unstable_poles_is_not_within(
    extended_design: Design, gain: float, rate: float, within: bool
) -> None:
    """Both are nearer than |W_a|: 1/(1 + 100 s) and 1/(100 s - 1) differ by 2/(1 + 100^2 omega^2)."""
    model = PlantModel(1.0, (), (), 0.05, integrators=0, real_poles=(0.01,))
    bound = AdditiveBound(2.3, (), (), (5.0,), (0.0115, 0.0115))
    design = dataclasses.replace(extended_design, plant=model, additive_bound=bound)
    true = PlantModel(gain, (), (), 0.05, integrators=0, real_poles=(rate,))
    omega = np.geomspace(1e-6, 1e3, 2001)
    assert np.all(np.abs(true(1j * omega) - model(1j * omega)) < 0.9 * np.abs(bound(1j * omega)))
    found = guarantee(design, from_one_plus(Block(1.0, (-0.02 + 0j,), (-0.01 + 0j,))), true)
    assert ("not within W_a" in found.missing) != within


@pytest.mark.parametrize("gamma", [-1.0, -0.5, 5.0, 97.0])
@pytest.mark.parametrize("beta", [0.01, 0.025, 0.3])
def test_the_circle_criterion_by_brute_force(gamma: float, beta: float) -> None:
    theta = second_order(0.05, beta, gamma).theta1_tilde
    omega = np.append(0.0, np.geomspace(1e-4, 1e6, 50001))
    least = (gamma / ((1 + 0.05j * omega) * (1 + 1j * beta * omega))).real.min()
    found = circle_sector(theta)
    assert found == pytest.approx(-1 / least, rel=1e-6)
    assert found <= popov_sector(theta)[0] * (1 + 1e-4)


def test_the_thesiss_compensator_has_no_guarantee(extended_design: Design) -> None:
    """Popov's condition holds for any sector, but by a multiplier, and theta2 integrates."""
    kind = extended_design.compensator("thesis")
    assert extended_design.thesis.judgement.popov_sector is None
    given_one = guarantee(extended_design, kind)
    assert given_one.sector == 0
    assert "theta2 is not stable" in given_one.missing
    assert f"the circle criterion gives the sector {circle_sector(kind.theta1_tilde):.3g})" in given_one.missing


def test_nothing_is_promised_where_the_reference_needs_more_than_the_limits(extended_design: Design) -> None:
    for limits in ((-10.0, 10.0), (-10.0, 80.0), (-80.0, 10.0)):
        found = judged(extended_design, limits, CHAPTER_4, 10.0)
        assert not found.covered
        assert found.needed_sector == np.inf
        sign = "" if limits[1] == 10 else "-"
        assert f"the reference takes a control of {sign}10.56, beyond the limit {sign}10;" in str(found)


def test_a_ramp_within_unequal_limits(extended_design: Design) -> None:
    """v_s is a constant beyond the nearer limit, on the side of the other one."""
    reference = Reference((0.0,), (1.5,), (0.0,), 0.0, 100.0)
    found = judged(extended_design, (-2.0, 15.0), reference, 20.0)
    secant = (found.largest_control - 15) / (found.largest_control - 100 / extended_design.plant.gain)
    assert found.needed_sector == pytest.approx(secant, rel=1e-6)


LIMIT_CYCLE = IdentifiedModel(
    PlantModel(
        2.3417605040210936,
        (Mode(112.65285988353095, 0.02947766716137056),),
        (Mode(169.97330700992794, 0.025287837418215248),),
        0.00299602035166441,
    ),
    AdditiveBound(
        0.06735855203213664,
        (Mode(100.64620859820079, 0.025808510320547623),),
        (Mode(169.02537782217485, 0.0025735290211285674), Mode(910.4420893446743, 34.45875191632487)),
        (3955.6636938837983,),
        (),
    ),
)


@pytest.fixture(scope="module")
def limit_cycle() -> Design:
    """Its corrected anti-windup does not let a step of 1 settle under +-5."""
    return design_extended(LIMIT_CYCLE, reference_omegas=[0.0], a=20.0, pairs=[], sector=0.95)


def said(command: str, design: Design, folder: Path, *arguments: str) -> str:
    (folder / "design.json").write_text(design.to_json(), encoding="utf-8")
    reference = () if "--amplitude" in arguments else ("--amplitude", "50", "--phase", str(math.pi / 2))
    options = ["--until", "5", *arguments, *reference, "--output", str(folder / "run.csv")]
    result = CliRunner().invoke(main, [command, str(folder / "design.json"), *options])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_simulate_says_first_that_a_limit_cycle_left_its_guarantee(limit_cycle: Design, tmp_path: Path) -> None:
    options = ("--sample-time", "0.01", "--limit", "5", "--amplitude", "1", "--anti-windup")
    text = said("simulate", limit_cycle, tmp_path, *options, "corrected")
    assert text.startswith("NOT covered by its guarantee, which it left at t = ")
    assert "the run needs the sector 1 - " in text
    assert "e+06; up to 100 is covered); 501 rows ->" in text
    assert said("simulate", limit_cycle, tmp_path, *options, "none").startswith("501 rows -> ")


@pytest.mark.parametrize(
    ("limit", "anti_windup", "begins"),
    [
        ("12", "corrected", "NOT covered by its guarantee, which it left at t = 0.006"),
        (
            "10",
            "corrected",
            "NOT covered by its guarantee: the reference takes a control of 10.56, beyond the limit 10",
        ),
        ("45", "corrected", "Covered by its guarantee: the run needs the sector 0.913 at t = 0.0176 s, 0.95 is"),
        ("400", "corrected", "501 rows -> "),
        ("inf", "corrected", "501 rows -> "),
        ("12", "thesis", "No guarantee: theta2 is not stable"),
        ("400", "thesis", "501 rows -> "),
        ("12", "none", "501 rows -> "),
    ],
)
def test_simulate_says_first_whether_its_run_is_covered(
    extended_design: Design, limit: str, anti_windup: str, begins: str, tmp_path: Path
) -> None:
    options = ("--sample-time", "0.01", "--limit", limit, "--anti-windup", anti_windup)
    assert said("simulate", extended_design, tmp_path, *options).startswith(begins)


@pytest.mark.parametrize(
    ("limit", "anti_windup", "begins"),
    [
        ("12", "corrected", "NOT covered by its guarantee, which it left at t = 0.006"),
        (
            "45",
            "corrected",
            "No guarantee on a computer; in continuous time it would cover the run: the run",
        ),
        ("400", "corrected", "10001 rows -> "),
        ("12", "thesis", "No guarantee: theta2 is not stable"),
        ("12", "none", "10001 rows -> "),
    ],
)
def test_a_drive_says_first_whether_its_run_is_covered(
    extended_design: Design, limit: str, anti_windup: str, begins: str, tmp_path: Path
) -> None:
    drive = ("--rate", "2000", "--method", "tustin")
    asked = (*drive, "--limit", limit, "--anti-windup", anti_windup)
    linear, promised = said("sampled", extended_design, tmp_path, *asked).splitlines()
    assert linear.startswith("At 2000 Hz with the method tustin the linear loop is stable")
    assert promised.startswith(begins)


def test_another_true_plant_has_no_guarantee_here(extended_design: Design, tmp_path: Path) -> None:
    options = ("--sample-time", "0.01", "--limit", "12", "--anti-windup", "corrected", "--plant")
    text = said("simulate", extended_design, tmp_path, *options, "table")
    assert text.startswith(
        "No guarantee: the true plant is not within W_a of the model, or has another number of poles "
    )
    assert said("simulate", extended_design, tmp_path, *options, "implied").startswith("NOT covered by its guarantee")


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ((-0.1, 5.0), "takes a control of -0.3293, beyond the limit -0.1; |u| reached 1"),
        ((0.1, 2.0), "takes a control of -0.3293, beyond the limit 0.1; |u| reached 1"),
        ((-2.0, 0.3293), "takes a control of 0.3293, the limit itself; |u| reached 1"),
    ],
)
def test_a_limit_is_named_with_its_sign(limits: tuple[float, float], said: str) -> None:
    steady, control = np.array([0.3293, -0.3293, 0.1]), np.array([0.5, -1.0, 0.2])
    assert said in str(verdict(Guarantee(1.02), np.arange(3.0), control, steady, limits))


@pytest.mark.parametrize("limits", [(-0.5, 3.0), (0.1, 2.0), (-2.0, -0.1), (-1.0, np.inf)])
def test_no_control_within_the_covered_ones_leaves_the_guarantee(limits: tuple[float, float]) -> None:
    """With unequal limits, each with the v_s that is nearest to it."""
    low, high = max(limits[0], -5.0), min(limits[1], 5.0)
    steady, k = np.array([low + 0.2 * (high - low), high - 0.3 * (high - low)]), 0.9
    least, greatest = verdict(Guarantee(k), np.arange(2.0), steady, steady, limits).covered_controls
    for end in (end for end in (least, greatest) if np.isfinite(end)):
        needed = max(needed_sector(np.full(2, end), steady, limits))
        assert needed == pytest.approx(k, rel=1e-12)
    left = verdict(Guarantee(k), np.arange(2.0), np.array([least - 5, steady[1]]), steady, limits)
    assert f"(u reached {least - 5:.3g}; from {least:.3g} to {greatest:.3g} is covered)" in str(left)


def test_where_a_limit_is_reached_no_sector_is_large_enough() -> None:
    """A stable plant's is above 1: a reference of 1.05 beyond +-0.5 for ever was covered by it."""
    time_s, steady = np.arange(3.0), np.array([0.0, 0.3, 1.05])
    found = verdict(Guarantee(1.02), time_s, np.array([0.0, 0.6, 1.05]), steady, (-0.5, 0.5))
    assert (found.covered, found.needed_sector, found.left_at_s) == (False, np.inf, 2.0)
    assert verdict(Guarantee(1.0), time_s[:2], np.array([0.0, 1e20]), steady[:2], (-0.5, 0.5)).covered


def test_a_sector_in_words() -> None:
    assert [sector_text(k) for k in (0.95019, 0.9994, 1 - 9.8e-8, 1.0, np.inf)] == [
        "0.95",
        "0.999",
        "1 - 9.8e-08",
        "1",
        "inf",
    ]


def test_the_summaries_hold_what_is_promised(extended_design: Design, delay_free_design: Design) -> None:
    for limit in (12.0, 45.0, 400.0):
        rows = extended_tables(extended_design, limit)["extended_summary"].set_index("run")
        found = judged(extended_design, (-limit, limit), CHAPTER_4, 5 * 2 * np.pi / 1.5)
        corrected = rows.loc["corrected"]
        assert corrected["covered"] == found.covered
        assert corrected["needed_sector"] == pytest.approx(found.needed_sector, rel=1e-9)
        if found.needed_sector:
            assert corrected["largest_control"] == pytest.approx(found.largest_control, rel=1e-9)
        assert corrected["covered_control"] == pytest.approx(found.covered_control, rel=1e-4)  # as v_s is sampled
        assert corrected["guaranteed_sector"] == found.guarantee.sector
        assert rows.loc["thesis", "guaranteed_sector"] == 0
        assert not rows.loc[["none", "thesis", "none_pade", "thesis_pade"], "covered"].any()
        assert rows.loc[["none", "none_pade", "thesis_pade"], "guaranteed_sector"].isna().all()
    rows = delay_free_tables(delay_free_design)["delay_free_summary"].set_index("run")
    assert rows.loc["corrected", "needed_sector"] == np.inf  # the reference takes 11.05, beyond the limits of 10
    assert not rows["covered"].any()


def test_a_run_that_diverges_is_not_covered(delay_free_design: Design) -> None:
    """The summary has an empty cell in place of each number."""
    reference = thesis_reference("delay-free", delay_free_design.reference_omegas)
    exact = loops(delay_free_design, reference)
    runs = run_all(exact, 10.0, np.linspace(0.0, 24.0, 2401))
    lost = dataclasses.replace(runs["none"], control=np.full(2401, np.nan))
    found = verdicts(delay_free_design, exact, runs | {"corrected": lost}, 10.0, reference)
    assert set(found) == {"thesis"}
    summary = tracking_summary(runs | {"corrected": lost}, found, 10.0, reference, 11.05, 4.0).set_index("run")
    assert summary.loc["corrected", ["guaranteed_sector", "needed_sector", "largest_control"]].isna().all()
    assert summary.loc["corrected", "covered"] == 0
