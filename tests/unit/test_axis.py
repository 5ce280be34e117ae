"""axis.toml: its keys are options, what it says wins over nothing, and what it leaves out follows from the plant."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import example, given, settings
from hypothesis import strategies as st

from antiwindup.__main__ import main
from antiwindup.build import Build
from antiwindup.commands import refit
from design.choices import GUARANTEES
from design.design_file import Design
from experiments.chosen_axis import Setting, choose_axis
from identification.base.axis_file import KEYS, axis_text, read_axis
from identification.base.axis_option import words_of
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel
from identification.model.signals import Signals

SWEEP = Path(__file__).resolve().parents[2] / "data" / "elevation" / "synthetic_test_1_frf.csv"
EXAMPLES = {name: key.read(tomllib.loads(f"x = {key.example}")["x"], name) for name, key in KEYS.items()}
OPTIONS = {name: option for option in refit.params for name in option.opts}

number = st.floats(-1e9, 1e9)
positive = st.floats(1e-9, 1e9)
VALUES: dict[str, st.SearchStrategy[Any]] = {
    "text": st.text(st.characters(exclude_categories=("Cs", "Cc"), include_characters="\t\"'\\#\x7f"), min_size=1),
    "number": number,
    "positive": positive,
    "size": st.just(0.0) | positive,
    "numbers": st.lists(number, min_size=1, max_size=3).map(tuple),
    "frequencies": st.lists(positive, min_size=1, max_size=3, unique=True).map(tuple),
    "limits": st.lists(number, min_size=2, max_size=2, unique=True).map(sorted).map(tuple),
    KEYS["guarantee"].kind: st.sampled_from(GUARANTEES),
}


def invoke(*words: object) -> str:
    """What a command prints; the sentence of its refusal."""
    return CliRunner().invoke(main, [*map(str, words)]).output


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> list[list[tuple[str, ...]]]:
    """The commands of each refit that is asked for, none of which is run."""
    found: list[list[tuple[str, ...]]] = []
    monkeypatch.setattr(Build, "run", lambda build, tell: found.append([step.command for step in build.steps]))
    return found


def test_every_key_is_an_option_of_refit_and_the_options_of_axis_are_keys() -> None:
    assert not {f"--{name}" for name in KEYS} - set(OPTIONS)
    axis = main.get_command(click.Context(main), "experiments").commands["axis"]  # type: ignore[union-attr]
    assert {name for param in axis.params for name in param.opts} - {f"--{name}" for name in KEYS} == {
        *("model", "--axis", "--output", "--force")
    }
    assert KEYS["guarantee"].kind.split("|") == list(GUARANTEES)


@pytest.mark.parametrize("name", KEYS)
def test_a_value_in_the_file_gives_the_steps_that_the_option_gives(
    steps: list[list[tuple[str, ...]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    values = {name: EXAMPLES[name]}
    Path("trajectory.csv").write_text("time_s,reference\n0,1\n", encoding="utf-8")
    Path("axis.toml").write_text(axis_text(values, {}), encoding="utf-8")
    invoke("refit", SWEEP, "--output", "mine")
    for words in (["--axis", "axis.toml"], words_of(values)):
        said = invoke("refit", SWEEP, "--output", "mine", *words)
        assert "steps were run" in said, said
    nothing, by_file, by_option = steps
    assert by_file == by_option != nothing
    assert all(word in {each for command in by_file for each in command} for word in words_of(values))


@pytest.mark.parametrize("name", KEYS)
def test_an_option_goes_before_the_file(steps: list[list[tuple[str, ...]]], tmp_path: Path, name: str) -> None:
    (tmp_path / "trajectory.csv").write_text("time_s,reference\n0,1\n", encoding="utf-8")
    (tmp_path / "axis.toml").write_text(axis_text({name: EXAMPLES[name]}, {}), encoding="utf-8")
    usual = {tuple: (7.0,), float: 7.0, str: "7"}[type(EXAMPLES[name])]
    other = {"limit": (-1.0, 2.0), "guarantee": "global", "reference": str(SWEEP)}.get(name, usual)
    words = words_of({name: other})
    said = invoke("refit", SWEEP, "--output", tmp_path / "mine", "--axis", tmp_path / "axis.toml", *words)
    assert "steps were run" in said, said
    invoke("refit", SWEEP, "--output", tmp_path / "mine", *words)
    assert steps[0] == steps[1]


@given(st.fixed_dictionaries({}, optional={name: VALUES[key.kind] for name, key in KEYS.items()}))
@example(EXAMPLES | {"reference": 'a "b" \\ \x7f ü.csv'})
@settings(max_examples=60)
def test_what_is_written_is_read_again(tmp_path_factory: pytest.TempPathFactory, values: dict[str, Any]) -> None:
    path = tmp_path_factory.getbasetemp() / "axis.toml"
    path.write_text(axis_text(values, {"limit": "assumed " * 30}), encoding="utf-8")
    sizes = {len(values[name]) for name in ("reference-hz", "amplitude", "phase") if name in values}
    if len(sizes) > 1 or ("reference" in values and {"amplitude", "phase", "offset", "slope"} & set(values)):
        with pytest.raises(InputError, match=re.escape(f"{path}: ") + ".*(expected one of them$|the counts differ)"):
            read_axis(path)
        return
    if "reference" in values:
        values = values | {"reference": str(path.parent / values["reference"])}
    assert read_axis(path) == values


def test_new_writes_a_file_that_says_nothing_yet_and_whose_every_line_may_be_taken(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    assert "remove the #" in invoke("new", path)
    assert read_axis(path) == {}
    text = path.read_text(encoding="utf-8")
    taken = tomllib.loads("\n".join(re.findall(r"^# ([\w-]+ = .*)$", text, flags=re.MULTILINE)))
    assert list(taken) == list(KEYS)
    assert "exists already" in invoke("new", path)
    path.write_text("mine", encoding="utf-8")
    assert "exists already" in invoke("new", path)
    assert path.read_text(encoding="utf-8") == "mine"
    invoke("new", path, "--force")
    assert path.read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("limits = [-1, 1]", "'limits' is not a key of an axis file; did you mean limit?"),
        ("input_unit = 'A'", "did you mean input-unit?"),
        ("[axis]\nlimit = 1", "'axis' is not a key of an axis file; "),
        ("qqqq = 1", "expected input-name, input-unit, "),
        ("limit = [10, -10]", "limit is [10, -10]; expected [low, high] with low < high"),
        ("limit = -10", "limit is -10; expected [low, high]"),
        ("limit = [1, 2, 3]", "limit is [1, 2, 3]"),
        ("limit = inf", "limit is inf; expected"),
        ("limit = '10'", "limit is '10'; expected"),
        ("rate = 0", "rate is 0; expected a positive finite number"),
        ("rate = true", "rate is True; expected"),
        ("offset = nan", "offset is nan; expected a finite number"),
        (f"offset = {'9' * 400}", "expected a finite number"),
        ("amplitude = []", "amplitude is []; expected"),
        ("amplitude = [1, 'a']", "amplitude is [1, 'a']; expected"),
        ("reference-hz = [1, 1]", "reference-hz is [1, 1]; expected a frequency, 0 or more, or several that differ"),
        ("reference-hz = -1", "reference-hz is -1; expected"),
        ("input-name = 3", "input-name is 3; expected text in quotes"),
        ("guarantee = 'all'", "guarantee is 'all'; expected one of ['global', 'robust', 'sector']"),
        ("reference = 'a.csv'\namplitude = 1", "both amplitude and reference "),
        ("reference-hz = [1, 2]\namplitude = 1", "the counts differ: 2 of reference-hz, 1 of amplitude"),
        ("limit = [1", "is not TOML ("),
        ("limit = 1\nlimit = 2", "is not TOML ("),
        ("[" * 5000, "is not TOML ("),
    ],
)
def test_a_file_that_says_what_cannot_be_is_refused_in_one_sentence(tmp_path: Path, text: str, part: str) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(text, encoding="utf-8")
    result = CliRunner().invoke(main, ["refit", str(SWEEP), "--axis", str(path), "--output", str(tmp_path / "mine")])
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert result.stderr.startswith(f"Error: {path}")
    assert part in result.stderr
    assert not (tmp_path / "mine").exists()


def every_command(group: click.Group) -> list[click.Command]:
    found = [group.get_command(click.Context(group), name) for name in group.list_commands(click.Context(group))]
    inner = [every_command(each) if isinstance(each, click.Group) else [each] for each in found if each]
    return [each for several in inner for each in several]


def test_a_command_that_takes_a_key_takes_the_file() -> None:
    """But for those that reproduce the thesis, which is no axis of the user's."""
    of_thesis = main.get_command(click.Context(main), "experiments").commands["thesis"].commands.values()  # type: ignore[union-attr]
    missing = []
    for command in every_command(main):
        options = {name for param in command.params for name in param.opts}
        if options & {f"--{name}" for name in KEYS} and "--axis" not in options and command not in of_thesis:
            missing.append(command.name)
    assert set(missing) <= {"figures", "report"}  # whose --limit is the thesis's


def test_a_command_takes_what_it_has_and_no_part_of_a_reference_is_lost(
    tmp_path: Path, extended_design: Design
) -> None:
    design, axis, run = (tmp_path / name for name in ("design.json", "axis.toml", "run.csv"))
    design.write_text(extended_design.to_json(), encoding="utf-8")
    axis.write_text("reference-hz = 0.2387\namplitude = 2\noffset = 1\nlimit = [-3, 9]\nslope = 0.5", encoding="utf-8")
    simulate = ("experiments", "simulate", design, "--axis", axis, "--anti-windup", "none", "--until", 1)
    simulate = (*simulate, "--sample-time", 0.5, "--output", run)
    assert "3 rows" in invoke(*simulate)
    columns = np.loadtxt(run, delimiter=",", skiprows=1)
    times = columns[:, 0]
    assert columns[:, 1] == pytest.approx(2 * np.sin(1.5 * times) + 1 + 0.5 * times, rel=1e-9)
    assert "3 rows" in invoke(*simulate, "--reference", trajectory(tmp_path))
    assert np.loadtxt(run, delimiter=",", skiprows=1)[:, 1] == pytest.approx([4.0, 4.0, 4.0])
    said = invoke("experiments", "limits", design, "--axis", axis, "--output", tmp_path)
    assert f"{axis}: the axis follows a ramp; expected sinusoids for limits" in said


def trajectory(folder: Path) -> Path:
    path = folder / "trajectory.csv"
    path.write_text("time_s,reference\n0,4\n", encoding="utf-8")
    return path


INTEGRATOR = PlantModel(3.0, (), (), 0.02, integrators=1, real_poles=(20.0,))


def control(axis: Mapping[str, Setting], time_s: np.ndarray) -> np.ndarray:
    """What keeps the output of 3/(s (1 + s/20)) on the axis's reference, from that alone."""
    value = {name: setting.value for name, setting in axis.items()}
    found = np.full(len(time_s), value.get("slope", 0.0) / 3)
    for hertz, size, phase in zip(value["reference-hz"], value["amplitude"], value["phase"], strict=True):
        s = 2j * math.pi * hertz
        found += size * np.imag(np.exp(s * time_s + 1j * phase) * s * (1 + s / 20) / 3)
    return found


@pytest.mark.parametrize(
    "asked",
    [
        {"limit": (-5.0, 5.0), "reference-hz": (0.5,)},
        {"limit": (-2.0, 7.0), "reference-hz": (0.5,), "offset": 11.0},
        {"limit": (-2.0, 7.0), "reference-hz": (0.5, 1.0), "phase": (0.3, -1.0)},
        {"limit": (-8.0, 3.0), "reference-hz": (0.5, 1.0, 1.5), "phase": (0.3, -1.0, 2.0), "slope": -2.0},
    ],
)
def test_the_amplitude_takes_80_percent_of_the_limits(model: IdentifiedModel, asked: dict[str, Any]) -> None:
    axis = choose_axis(model, asked)
    assert len(set(axis["amplitude"].value)) == 1
    reached = control(axis, np.linspace(0.0, 2.0, 200_001)) / 0.8
    low, high = asked["limit"]
    assert max(reached.max() / high, reached.min() / low) == pytest.approx(1.0, rel=1e-7)
    assert {name for name, setting in axis.items() if setting.why} == {"amplitude", "phase"} - set(asked)


def test_limits_that_nobody_gave_are_said_to_be_assumed(model: IdentifiedModel) -> None:
    axis = choose_axis(model, {"reference-hz": (0.5,), "amplitude": (4.0,), "phase": (0.0,)})
    taken = 4 * math.pi * math.hypot(1, math.pi / 20) / 3
    assert axis["limit"].value == pytest.approx((-1.25 * taken, 1.25 * taken))
    assert "ASSUMED" in str(axis["limit"].why)


def test_an_axis_that_was_completed_is_complete(model: IdentifiedModel) -> None:
    once = choose_axis(model, {"reference-hz": (0.5,)})
    again = choose_axis(model, {name: setting.value for name, setting in once.items()})
    assert {name: setting.value for name, setting in again.items()} == {name: s.value for name, s in once.items()}
    assert not any(setting.why for setting in again.values())
    assert once["output-unit"].value == "mm"


@pytest.mark.parametrize(
    ("asked", "part"),
    [
        ({}, "does not say to which lines it was fitted; expected --reference-hz"),
        ({"reference-hz": (0.0,)}, "steady control of 0, from which no limits follow"),
        (
            {"reference-hz": (0.0,), "limit": (-1.0, 1.0)},
            "steady control of 0, from which no amplitude follows; expected --amplitude",
        ),
        ({"reference-hz": (1.0,), "limit": (0.0, 1.0)}, "exceeds 80% of the limits 0 to 1"),
        ({"reference-hz": (1.0,), "slope": 30.0, "limit": (-9.0, 9.0)}, "exceeds 80% of the limits -9 to 9"),
        ({"reference": "trajectory.csv", "reference-hz": (1.0,)}, "expected --limit"),
        ({"reference": "nowhere.csv", "limit": (-1.0, 1.0)}, "nowhere.csv: no such file"),
        ({"reference": "trajectory.csv", "slope": 1.0}, "both slope and reference "),
    ],
)
def test_what_does_not_follow_from_the_plant_is_asked_for(
    model: IdentifiedModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: dict[str, Any], part: str
) -> None:
    monkeypatch.chdir(tmp_path)
    trajectory(tmp_path)
    with pytest.raises(InputError, match=re.escape(part)):
        choose_axis(model, asked)


def test_references_that_are_not_sinusoids(model: IdentifiedModel, tmp_path: Path) -> None:
    ramp = choose_axis(model, {"slope": 2.0})
    assert (ramp["reference-hz"].value, ramp["amplitude"].value) == ((0.0,), (0.0,))
    assert ramp["limit"].value == pytest.approx((-1.25 * 2 / 3, 1.25 * 2 / 3))
    file = choose_axis(model, {"reference": str(trajectory(tmp_path)), "limit": (-1.0, 1.0)})
    assert file["reference-hz"] == Setting((0.0,), file["reference-hz"].why)
    assert "amplitude" not in file


@pytest.fixture(scope="module")
def model(extended_design: Design) -> IdentifiedModel:
    """An integrator with a lag, of no fit."""
    return IdentifiedModel(INTEGRATOR, extended_design.additive_bound, signals=Signals("torque", "Nm", "angle", "mm"))


@pytest.mark.parametrize(
    ("bands_hz", "chosen"), [([(1.0, 50.0), (3.0, 20.0)], 6.0), ([(1.0, 7.0), (4.0, 50.0)], math.sqrt(28.0))]
)
def test_the_frequency_lies_within_the_lines_of_all_tests(
    model: IdentifiedModel, bands_hz: list[tuple[float, float]], chosen: float
) -> None:
    tests = [SimpleNamespace(band=tuple(math.tau * hertz for hertz in band)) for band in bands_hz]
    axis = choose_axis(replace(model, fit=SimpleNamespace(tests=tests)), {})  # type: ignore[arg-type]
    assert axis["reference-hz"].value == pytest.approx((chosen,), rel=5e-3)
