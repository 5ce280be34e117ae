"""The page to play on: the state in its address, the ranges of its sliders, and what it computes of a state."""

from __future__ import annotations

import asyncio
import math
import socket
import sys
from dataclasses import replace
from pathlib import Path
from urllib.parse import parse_qs

import numpy as np
import pytest
from click.testing import CliRunner

import experiments
from antiwindup.__main__ import main
from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.engine.simulate import Run
from identification.base.digits import percent
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.signals import Signals
from paper_figures.explore.compute import Explorer, saturated
from paper_figures.explore.newest import Newest
from paper_figures.explore.pictures import Pictures
from paper_figures.explore.ranges import ranges
from paper_figures.explore.state import State, from_words, start_of
from paper_figures.explore.words import run_text, table, true_plant_text, without_tex


@pytest.fixture(scope="module")
def start(extended_design: Design) -> State:
    return start_of(extended_design, (-12.0, 11.0), experiments.sinusoid(50.0, 1.5, 0.3, 7.0))


@pytest.fixture(scope="module")
def explorer(extended_design: Design, start: State) -> Explorer:
    return Explorer(extended_design, start)


def test_an_address_holds_a_state_to_the_last_digit(start: State) -> None:
    rng = np.random.default_rng(3)
    many = start.changed({"reference-omega": (0.0, 1.5, 7.0), "amplitude": (1.0, 2.0, 3.0), "phase": (1.0, 0.0, -1.0)})
    for scale in (1e-300, 1e-5, 1.0, 1e300):
        numbers = {name: tuple(scale * rng.uniform(0.1, 1, len(values))) for name, values in many.numbers.items()}
        state = many.changed(numbers | {"limit": (-scale / 3, scale / 7)}, "robust")
        assert from_words(parse_qs(state.query), many) == state
    assert from_words({}, start) == start


@pytest.mark.parametrize(
    ("query", "said"),
    [
        ("colour=3", "the address has 'colour'; expected limit, amplitude"),
        ("limit=3", "the address has limit 1 times; expected 2 times"),
        ("a=4&a=5", "the address has a 2 times; expected 1 times"),
        ("a=fast", "the address has a = 'fast'; expected numbers"),
        ("a=0", "a is 0; expected a positive number"),
        ("dead-time=-1e-9", "dead-time is -1e-09; expected zero or a positive number"),
        ("gain=nan", "gain is nan; expected a positive number"),
        ("amplitude=inf", "amplitude is inf; expected a finite number"),
        ("limit=5&limit=5", "the limits are 5 and 5; expected the lower one first"),
        ("guarantee=<b>", "guarantee is '<b>'; expected one of global, robust, sector"),
    ],
)
def test_what_an_address_cannot_ask_for_is_one_sentence(query: str, said: str, start: State) -> None:
    with pytest.raises(InputError) as refused:
        from_words(parse_qs(query), start)
    assert str(refused.value).startswith(said)


def test_a_page_begins_with_what_the_reference_needs(delay_free_design: Design) -> None:
    """Perfect tracking of a unit sinusoid takes 1/|P(j omega)|."""
    state = start_of(delay_free_design)
    needed = 1 / abs(complex(delay_free_design.plant(1j * delay_free_design.reference_omegas[0])))
    assert state.limits == pytest.approx((-1.2 * needed, 1.2 * needed), rel=1e-9)
    assert state.numbers["a"] == ()


def test_every_slider_reaches_its_state_and_beyond_what_the_loop_tolerates(
    extended_design: Design, delay_free_design: Design, start: State
) -> None:
    far = start.changed({"limit": (-1e4, 3.0), "gain": (17.0,), "dead-time": (9.0,), "phase": (11.0,)})
    for each in ranges(extended_design, start):
        wide = each.including(far)
        for state, slider in ((start, each), (far, wide)):
            values = state.numbers[each.name]
            ends = values if each.index is None else values[each.index : each.index + 1]
            assert slider.low <= min(ends) <= max(ends) <= slider.high
        assert (each.high - each.low) / 1000 < each.step < (each.high - each.low) / 100
    found = {each.name: each for each in ranges(extended_design, start)}
    assert found["dead-time"].high > 0.129  # the loop's delay margin, as the audit prints it
    assert set(found) == set(start.numbers)
    assert "a" not in {each.name for each in ranges(delay_free_design, start_of(delay_free_design))}


def test_the_run_is_that_of_simulate_with_the_true_plant(extended_design: Design, explorer: Explorer) -> None:
    state = explorer.start.changed({"gain": (1.3,), "mode-frequency": (0.9,), "dead-time": (0.02,)})
    own = extended_design.plant

    def slower(modes: tuple[Mode, ...]) -> tuple[Mode, ...]:
        return tuple(Mode(0.9 * mode.omega, mode.zeta) for mode in modes)

    true = PlantModel(1.3 * own.gain, slower(own.zero_modes), slower(own.pole_modes), 0.02)
    reference = experiments.sinusoid(50.0, 1.5, 0.3, 7.0)
    run = explorer.run(state)
    expected = experiments.simulate(
        extended_design, (-12.0, 11.0), reference, until_s=10 * math.pi / 1.5, samples=len(run.time_s), plant=true
    )
    np.testing.assert_allclose(run.control, expected.control, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.outputs["output"], expected.outputs["output"], rtol=1e-9, atol=1e-9)
    said = "gain times 1.3 and the frequencies of its modes times 0.9 and a dead time of 0.02 s instead of 0.0081 s"
    assert said in true_plant_text(state.true, explorer.start.true)


def test_the_shaded_times_are_those_in_which_the_control_is_beyond_a_limit(explorer: Explorer) -> None:
    for limits in ((-12.0, 11.0), (-5.0, 30.0), (-1e5, 1e5)):
        run = explorer.run(explorer.start.changed({"limit": limits}))
        times, step = saturated(run), run.time_s[1]
        beyond = (run.control < limits[0]) | (run.control > limits[1])
        inside = np.any((times[:, :1] <= run.time_s) & (run.time_s <= times[:, 1:]), axis=0)
        assert np.all(inside[beyond])
        gaps = np.flatnonzero(inside & ~beyond)  # within a merged one beyond is never farther than two steps
        near = [beyond[max(0, k - 3) : k + 4].any() or np.abs(times - run.time_s[k]).min() < 3 * step for k in gaps]
        assert all(near)
        assert (len(times) == 0) == (not beyond.any())


def test_both_limits_are_in_the_view_wherever_they_lie(explorer: Explorer) -> None:
    pictures = Pictures(Signals())
    for low, high in ((4.0, 15.0), (-15.0, -4.0), (-3.0, 8.0)):
        pictures.show_run(explorer.run(explorer.start), (low, high))
        view = pictures.control.y_range
        assert view.start < low < high < view.end


def test_the_discs_are_those_of_the_controller_by_hand(extended_design: Design, explorer: Explorer) -> None:
    """L = T/(1 - T) with T = T_so exp(-h s), so that |W_a C| = |W_a L/P|; (2.22) in its own factors."""
    nyquist = explorer.linear(explorer.start.choices, explorer.start.true).nyquist
    s, bound, plant = 1j * nyquist.omega, extended_design.additive_bound, extended_design.plant
    T = extended_design.blocks["T_so"](s) * np.exp(-plant.delay_s * s)
    mode = bound.pole_modes[0]
    W_a = bound.gain * (1 + s / bound.corner) / (1 + 2 * mode.zeta * s / mode.omega + (s / mode.omega) ** 2)
    np.testing.assert_allclose(nyquist.centres, T / (1 - T), rtol=1e-7)
    np.testing.assert_allclose(nyquist.radii, np.abs(W_a * T / (1 - T) / plant(s)), rtol=1e-7)
    assert len(nyquist.radii) > 20
    # |W_a C S|, which the audit prints as 8.84 at most, is the radius over the distance from -1
    assert (nyquist.radii / np.abs(1 + nyquist.centres)).max() == pytest.approx(8.84, rel=2e-3)


def test_a_true_plant_of_another_gain_scales_the_curve_and_the_step(explorer: Explorer) -> None:
    start = explorer.start
    own = explorer.linear(start.choices, start.true)
    other = explorer.linear(start.choices, replace(start.true, gain=2.0))
    both = np.isfinite(own.nyquist.model) & np.isfinite(other.nyquist.true)
    np.testing.assert_allclose(other.nyquist.true[both], 2 * own.nyquist.model[both], rtol=1e-9)
    np.testing.assert_array_equal(own.model, own.true)
    early = own.time_s < start.true.delay_s  # before the feedback knows of it
    np.testing.assert_allclose(other.true[early], 2 * own.true[early], rtol=1e-9)
    assert own.unstable == other.unstable == 0
    late = replace(start.true, delay_s=0.14)  # beyond the delay margin of 0.129 s
    assert explorer.linear(start.choices, late).unstable == 2


def test_a_drag_of_a_limit_computes_a_run_and_nothing_else(explorer: Explorer) -> None:
    start = explorer.start
    explorer.linear(start.choices, start.true)
    before = [explorer.designed.cache_info().misses, explorer.linear.cache_info().misses]
    runs = explorer.run.cache_info().misses
    for limit in (7.0, 7.5, 8.0):
        state = start.changed({"limit": (-limit, limit)})
        explorer.linear(state.choices, state.true)
        explorer.run(state)
    assert [explorer.designed.cache_info().misses, explorer.linear.cache_info().misses] == before
    assert explorer.run.cache_info().misses == runs + 3


def test_a_change_of_the_choices_designs_as_the_commands_do(
    implied: IdentifiedModel, extended_design: Design, delay_free_design: Design, explorer: Explorer
) -> None:
    start = explorer.start
    assert explorer.designed(start.choices) is extended_design
    assert explorer.saved(start.choices) == extended_design.to_json()
    faster = explorer.designed(start.changed({"a": (5.0,)}).choices)
    assert faster == design_extended(
        implied, [1.5], 5.0, [(2.0, 1.0)], bandwidth=extended_design.corrected.bandwidth, guarantee="global"
    )
    sooner = explorer.designed(start.changed({"recovery": (0.8,)}, "sector").choices)
    assert sooner.corrected.guarantee == "sector"
    assert sooner.corrected.judgement.recovery_s <= 0.8
    assert sooner.blocks["K"] == extended_design.blocks["K"]

    chapter_2 = Explorer(delay_free_design, start_of(delay_free_design))
    moved = chapter_2.start.changed({"reference-omega": (1.9,)}).choices
    found = chapter_2.designed(moved)
    bandwidth = delay_free_design.corrected.bandwidth
    assert found == design_delay_free(implied, [1.9], 1e-4, bandwidth=bandwidth, guarantee="global")
    assert '"compared": [\n    "' in chapter_2.saved(moved)


def test_chosen_pairs_move_with_a_and_a_guarantee_that_does_not_exist_is_refused(implied: IdentifiedModel) -> None:
    bare = IdentifiedModel(
        replace(implied.plant, integrators=2, pole_modes=implied.plant.zero_modes), implied.additive_bound
    )
    design = design_extended(bare, [1.5], 4.0, None, robust_level=0.9)
    explorer = Explorer(design, start_of(design))
    assert explorer.designed(explorer.start.changed({"a": (3.0,)}).choices).free.pairs == ((6.0, 9.0),)
    with pytest.raises(InputError, match="no guarantee for every control exists"):
        explorer.run(explorer.start.changed({}, "global"))


def test_an_unstable_plant_is_run_as_long_as_rounding_allows() -> None:
    """Five periods of the reference would be 63 s; the pole is at 1 rad/s."""
    plant = PlantModel(2.0, (), (), 0.02, 0, (), (-1.0,))
    model = IdentifiedModel(plant, AdditiveBound(0.02, (), (), (), (30.0,)))
    design = design_extended(model, [0.5])
    explorer = Explorer(design, start_of(design))
    assert explorer.run(explorer.start).time_s[-1] == pytest.approx(25.0)
    for end in ("low", "high"):  # of the slider: neither is refused
        sliders = {each.name: each for each in ranges(design, explorer.start)}
        explorer.designed(explorer.start.changed({"recovery": (getattr(sliders["recovery"], end),)}).choices)


def test_the_slow_part_judges_the_run_and_both_loops(explorer: Explorer) -> None:
    late = explorer.start.changed({"dead-time": (0.14,)})
    judged = explorer.judged(late)
    assert not isinstance(judged.model, str)
    assert judged.model.delay_greatest_s.value == pytest.approx(0.129, rel=5e-3)
    assert judged.true == "the loop has 2 roots in the right half plane; margins are those of a stable loop"
    assert judged.promised.startswith("No guarantee: the true plant is not within W_a")


def test_words() -> None:
    time_s = np.linspace(0.0, 1.0, 5)
    none = np.array([])
    run = Run(time_s, np.array([0, 1, 2, np.nan, np.nan]), np.array([0, 1, 2, np.nan, np.nan]), {}, none, none)
    assert run_text(run) == "The run diverges near t = 0.75 s."
    assert run_text(replace(run, control=time_s, saturated_control=time_s)) == "The control stays within the limits."
    assert [percent(share) for share in (0.0012, 0.994, 0.996, 1.0, 2.5)] == ["0.12", "99", "100", "100", "250"]
    assert table([("<b>", "1 & 2")]) == "<table><tr><th scope=row>&lt;b&gt;</th><td>1 &amp; 2</td></tr></table>"
    for name in ("$$x$$<img src=x>", r"\(x\)", r"\[x\]"):  # what Bokeh looks for
        assert not any(sign in without_tex(name) for sign in ("$$", r"\(", r"\["))
    assert without_tex("motor current [A], 3 $") == "motor current [A], 3 $"


def test_of_the_values_that_come_while_it_works_only_the_newest_is_worked_on() -> None:
    done: list[int] = []

    async def work(value: int) -> None:
        await asyncio.sleep(0)
        done.append(value)

    async def drag() -> None:
        newest = Newest(work)
        newest.ask(1)
        await asyncio.sleep(0)  # it begins
        for value in (2, 3, 4):
            newest.ask(value)
        while len(done) < 2:
            await asyncio.sleep(0)
        newest.ask(5)
        while len(done) < 3:
            await asyncio.sleep(0)

    asyncio.run(drag())
    assert done == [1, 4, 5]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--output", "{design}"], "is an input too; expected another file"),
        (["--port", "{port}"], "which cannot be used (Address already in use); expected a free one"),
        (["--limit", "3", "-3"], "--limit is 3 -3; expected the lower limit first"),
        (["--limit", "inf"], "limit is -inf; expected a finite number"),
        (["--phase", "1"], "no --amplitude is given; expected one for each frequency of the design, 1.5 rad/s"),
    ],
)
def test_a_command_that_cannot_serve_says_why(
    words: list[str], said: str, extended_design: Design, tmp_path: Path
) -> None:
    path = tmp_path / "design.json"
    path.write_text(extended_design.to_json(), encoding="utf-8")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        given = {"design": str(path), "port": str(taken.getsockname()[1])}
        result = CliRunner().invoke(
            main, ["explore", str(path), "--no-browser", *(each.format(**given) for each in words)]
        )
    assert result.exit_code == 2
    assert said in result.output


def test_without_its_extra_the_command_says_what_to_install(
    extended_design: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "design.json").write_text(extended_design.to_json(), encoding="utf-8")

    class Missing:
        """A finder to which Bokeh is not installed."""

        @staticmethod
        def find_spec(name: str, _path: object = None, _target: object = None) -> None:
            if name == "bokeh":
                raise ModuleNotFoundError("No module named 'bokeh'", name=name)

    ours = [f"paper_figures.explore.{name}" for name in ("server", "page", "pictures")]
    for name in [*ours, *(name for name in sys.modules if name.partition(".")[0] == "bokeh")]:
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(sys, "meta_path", [Missing, *sys.meta_path])
    with socket.create_server(("127.0.0.1", 0)) as taken:  # so that it ends in any case
        port = str(taken.getsockname()[1])
        refused = CliRunner().invoke(main, ["explore", str(tmp_path / "design.json"), "--no-browser", "--port", port])
    assert refused.exit_code == 2
    assert refused.stderr == (
        'Error: this command needs bokeh, which is not installed; run pip install "antiwindup-thesis[explore]"\n'
    )
