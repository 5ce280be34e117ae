"""antiwindup check: what it calls moved, what it says of a design, what it writes, and with which status it ends."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from scipy import stats

from antiwindup.__main__ import main
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from design.stability.margins import Margins
from experiments.checking.answers import Outcome, _margins, answers, fails
from experiments.checking.check_model import LEVEL, check_model
from experiments.checking.design_on_plant import on_plant, promise, sector_with
from experiments.checking.new_sweep import NewSweep, fitted
from experiments.checking.parameter_moves import moves
from experiments.checking.within_bound import reach_at_lines, reach_between_lines
from experiments.checking.words import first_sentence
from identification.base.errors import InputError
from identification.fit_model import fit
from identification.fitting.same_structure import fit_same_structure
from identification.fitting.small_sample import sureness
from identification.model.model_file import IdentifiedModel, read_model
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.structure import Structure
from identification.sweeps.response import FrequencyResponse

PLANT = PlantModel(-2.0, (Mode(50.0, 0.03),), (Mode(80.0, 0.02),), 5e-3)
OMEGA = np.geomspace(20.0, 320.0, 150)


def measured(plant: PlantModel, seed: int, noise: float = 0.02, name: str = "new") -> FrequencyResponse:
    response = plant(1j * OMEGA)
    error = noise * np.abs(response) * (np.random.default_rng(seed).standard_normal((OMEGA.size, 2)) @ [1, 1j])
    return FrequencyResponse(OMEGA, response + error / np.sqrt(2), None, name)


def moved(plant: PlantModel, share: float) -> PlantModel:
    *others, last = plant.pole_modes
    return replace(plant, pole_modes=(*others, replace(last, omega=last.omega * (1 + share))))


def asked(found: object, question: str) -> tuple[Outcome, str]:
    (answer,) = (each for each in answers(found) if each.question == question)  # type: ignore[arg-type]
    return answer.outcome, answer.sentence


@pytest.fixture(scope="module")
def model() -> IdentifiedModel:
    tests = [measured(PLANT, seed, name=f"test {seed}") for seed in range(3)]
    return fit(tests, modes=1, real=0, integrators=1)


@pytest.fixture(scope="module")
def design(model: IdentifiedModel) -> Design:
    return design_extended(model, reference_omegas=[3.0], guarantee="robust")


@pytest.mark.parametrize("seed", range(12))
def test_theta_is_the_plant(seed: int) -> None:
    rng = np.random.default_rng(seed)
    left, right, poles, real_left, real_right, real_poles = (int(n) for n in rng.integers(0, 3, 6))
    integrators = 2 * max(0, left + right - poles) + max(0, real_left + real_right - real_poles)
    zetas = rng.permutation([*rng.uniform(0.01, 2, left), *-rng.uniform(0.01, 2, right)])
    plant = PlantModel(
        gain=float(rng.choice([-1, 1]) * rng.uniform(0.1, 9)),
        zero_modes=tuple(
            Mode(float(omega), float(zeta)) for omega, zeta in zip(rng.uniform(1, 9, zetas.size), zetas, strict=True)
        ),
        pole_modes=tuple(
            Mode(*map(float, rng.uniform(0.1, 9, 2))) for _ in range(poles + max(0, left + right - poles))
        ),
        delay_s=float(rng.uniform()),
        integrators=min(2, integrators) - int(rng.integers(0, 2)),
        real_zeros=tuple(
            float(x) for x in rng.permutation([*rng.uniform(1, 9, real_left), *-rng.uniform(1, 9, real_right)])
        ),
        real_poles=tuple(rng.uniform(1, 9, real_poles + 4).tolist()),
    )
    structure = Structure.of(plant)
    again = structure.plant(structure.theta(plant), np.sign(plant.gain))
    s = 1j * np.geomspace(0.1, 100, 9)
    np.testing.assert_allclose(again(s), plant(s), rtol=1e-12)
    assert structure == Structure.of(again)


def test_a_plant_that_no_fit_has_has_no_structure() -> None:
    with pytest.raises(InputError, match="right half plane"):
        Structure.of(replace(PLANT, real_poles=(-3.0,)))


def test_the_noise_of_a_gain_is_that_of_a_mean() -> None:
    """One parameter of 2 M real numbers: the variance is that of their mean, with 2 M - 1 degrees of freedom."""
    rng = np.random.default_rng(5)
    errors = 0.1 * (rng.standard_normal((6, 2)) @ [1, 1j])
    omega, gain = np.arange(1.0, 7.0), PlantModel(3.0, (), (), 0.0, 0)
    test = FrequencyResponse(omega, 3.0 * (1 + errors), None, "gain")
    found = fit_same_structure(test, Structure.of(gain, delayed=False), gain, soft=False)
    known = sureness(found, test)
    real = np.concatenate([test.response.real, test.response.imag + found.plant.gain])  # 0 beside the gain's own part
    variance = np.sum((real - found.plant.gain) ** 2) / (2 * 6 - 1)
    assert found.plant.gain == pytest.approx(test.response.real.mean(), rel=1e-6)
    assert known.covariance[0, 0] == pytest.approx(variance / 6 / found.plant.gain**2, rel=1e-4)
    assert known.freedom[0] == pytest.approx(2 * 6 - 1, rel=1e-6)


def test_a_notch_that_few_lines_tell_is_no_surer_than_they_are() -> None:
    """Its error over its standard error follows Student's distribution, not the normal one."""
    plant = PlantModel(7.0, (Mode(40.0, 0.01),), (Mode(65.0, 0.05),), 8e-3)
    structure, omega = Structure.of(plant), np.linspace(20.0, 200.0, 180)
    response = plant(1j * omega)
    sigma = 0.02 * np.hypot(np.abs(response), 0.1 * np.median(np.abs(response)))
    ranks = []
    for seed in range(30):
        error = sigma * (np.random.default_rng(seed).standard_normal((omega.size, 2)) @ [1, 1j]) / np.sqrt(2)
        test = FrequencyResponse(omega, response + error, None, "notch")
        found = fit_same_structure(test, structure, plant, soft=False)
        known = sureness(found, test)
        off = (found.theta - structure.theta(plant))[:5] / np.sqrt(np.diag(known.covariance))[:5]
        ranks.append(stats.t.cdf(off, known.freedom[:5]))
    assert known.freedom[1] < 20 < known.freedom[3]
    for column in np.transpose(ranks):
        assert stats.kstest(column, "uniform").pvalue > 1e-3


def test_a_plant_that_did_not_move_passes(model: IdentifiedModel, design: Design) -> None:
    found = check_model(
        model, [measured(PLANT, seed, noise, f"new {seed}") for seed, noise in ((7, 0.02), (8, 0.05))], design
    )
    assert {each.outcome for each in answers(found)} == {Outcome.HOLDS}
    assert first_sentence(found) == (
        "Nothing to do: every sweep lies within W_a except for noise, no parameter moved by more than chance, "
        "the design keeps its margins and its guarantee"
    )


@pytest.mark.parametrize(("share", "noise"), [(0.02, 0.02), (-0.02, 0.08), (0.5, 0.02)])
def test_a_mode_that_moved_is_named(model: IdentifiedModel, share: float, noise: float) -> None:
    found = check_model(model, [measured(moved(PLANT, share), 9, noise)])
    outcome, sentence = asked(found, "parameters")
    assert (outcome, asked(found, "within W_a")[0]) == (Outcome.MOVED, Outcome.MOVED)
    assert sentence.startswith(f"the frequency of pole mode 1 moved by {100 * share:+.2g}"[:-1])
    assert first_sentence(found).startswith("Fit a new model: the sweep leaves W_a at ")


@pytest.fixture(scope="module")
def scattering() -> IdentifiedModel:
    """Of three tests whose gains have a standard deviation of 0.5 %."""
    tests = [measured(replace(PLANT, gain=PLANT.gain * (1 + x)), k, 2e-3) for k, x in enumerate((-5e-3, 0.0, 5e-3))]
    return fit(tests, modes=1, real=0, integrators=1)


@pytest.mark.parametrize(("share", "outcome"), [(4e-3, Outcome.HOLDS), (0.012, Outcome.OUTSIDE), (0.3, Outcome.MOVED)])
def test_a_sweep_outside_the_bound_has_moved_only_if_the_tests_scatter_less(
    scattering: IdentifiedModel, share: float, outcome: Outcome
) -> None:
    """By Student's prediction of a fourth test from three, for each of six parameters."""
    chance = 6 * 2 * stats.t.sf(share / (5e-3 * np.sqrt(1 + 1 / 3)), 2)
    assert (chance < LEVEL / 2) == (outcome is Outcome.MOVED)
    found = check_model(scattering, [measured(replace(PLANT, gain=PLANT.gain * (1 + share)), 40, 2e-3)])
    told, sentence = asked(found, "within W_a")
    assert told is outcome
    assert fails(answers(found)) == (outcome is not Outcome.HOLDS)
    assert sentence.endswith("nothing shows that the plant moved") == (outcome is Outcome.OUTSIDE)
    todo = "Fit a new model to the old tests and the new sweep together: the sweep leaves W_a at "
    assert first_sentence(found).startswith(todo) == (outcome is Outcome.OUTSIDE)
    assert ("the gain moved by +30 %" in first_sentence(found)) == (outcome is Outcome.MOVED)


def test_the_scatter_of_the_tests_does_not_explain_a_single_line(scattering: IdentifiedModel) -> None:
    test = measured(PLANT, 41, 2e-3)
    response = test.response.copy()
    response[70] *= 1.05
    told, sentence = asked(check_model(scattering, [replace(test, response=response)]), "within W_a")
    assert told is Outcome.MOVED
    hertz = OMEGA[70] / (2 * np.pi)
    assert sentence.endswith(f"; no plant with the model's structure meets the line at {hertz:.4g} Hz")


def test_a_test_of_the_model_touches_the_bound_at_most(model: IdentifiedModel, design: Design) -> None:
    """W_a is the tightest of its order over the tests, so that one of them touches it."""
    said = []
    for seed in range(3):
        found = check_model(model, [measured(PLANT, seed)], design)
        said.append(asked(found, "within W_a"))
        assert not fails(answers(found))
    assert any(sentence.startswith("the sweep lies within W_a, which it touches at ") for _, sentence in said)


@pytest.mark.parametrize(("share", "words"), [(1e-9, "as with the model"), (0.02, "and 0.608 with the model")])
def test_margins_that_three_digits_do_not_tell_apart_are_told_as_the_same(
    design: Design, share: float, words: str
) -> None:
    true = replace(design.plant, gain=design.plant.gain * (1 + share))
    told, sentence = _margins(promise(design), on_plant(design, true), is_within=True)
    assert told is Outcome.HOLDS
    assert re.match(rf"the loop is stable, and its modulus margin is 0\.\d{{3}}, {words}; ", sentence)


def test_the_moves_are_those_of_the_textbook(model: IdentifiedModel) -> None:
    """Of tests that agree a difference of means, of others the prediction of one more, both by Student's t."""
    assert model.fit is not None
    sweep = fitted(model, measured(moved(PLANT, 3e-4), 21))
    assert isinstance(sweep, NewSweep)
    k = 3  # the pole's frequency
    difference = np.log(sweep.fit.plant.pole_modes[0].omega / model.plant.pole_modes[0].omega)
    own = sweep.sure.covariance[k, k]
    before = (model.fit.noise[k] / model.plant.pole_modes[0].omega) ** 2
    found = moves(model, model.fit, sweep, LEVEL)[k]
    assert found.errors == pytest.approx(difference / np.sqrt(own + before), rel=1e-9)
    nu = (own + before) ** 2 / (own**2 / sweep.sure.freedom[k] + before**2 / (3 * sweep.sure.freedom[k]))
    assert found.chance == pytest.approx(min(1, 6 * 2 * stats.t.sf(abs(found.errors), nu)), rel=1e-6)
    assert np.log1p(found.found_from) / np.sqrt(own + before) == pytest.approx(stats.t.isf(LEVEL / 12, nu), rel=1e-6)
    spread = 1e-3 * model.plant.pole_modes[0].omega
    scattered = replace(model.fit, agreement_of_tests=1e-6, scatter=(spread / np.sqrt(3),) * 6)
    found = moves(model, scattered, sweep, LEVEL)[k]
    noisier = max(0.0, own - 3 * before)
    assert found.errors == pytest.approx(difference / np.sqrt(1e-6 * (1 + 1 / 3) + noisier), rel=1e-6)
    assert found.chance == pytest.approx(min(1, 12 * stats.t.sf(abs(found.errors), 2)), rel=0.02)


def test_a_gain_of_the_other_sign_moved(model: IdentifiedModel) -> None:
    outcome, sentence = asked(check_model(model, [measured(replace(PLANT, gain=2.0), 3)]), "parameters")
    assert (outcome, sentence) == (Outcome.MOVED, "the gain moved to the other sign")


def test_what_is_left_of_noise_beyond_the_bound_is_chance(model: IdentifiedModel) -> None:
    """A plant on the edge of W_a passes whatever the noise; one well beyond does not."""
    bound = model.additive_bound
    s = 1j * np.geomspace(OMEGA[0], OMEGA[-1], 20_000)
    edge = 1 + np.min(np.abs(bound(s) / model.plant(s)))
    for factor, leaves in ((1.0, False), (2.0, True)):
        plant = replace(model.plant, gain=model.plant.gain * (1 + factor * (edge - 1)))
        beyond = []
        for seed in range(20):
            sweep = fitted(model, measured(plant, seed, 0.005 if leaves else 0.05))
            assert isinstance(sweep, NewSweep)
            beyond += [reach_at_lines(model, sweep).chance < LEVEL, reach_between_lines(model, sweep).chance < LEVEL]
        assert (sum(beyond) >= 20) if leaves else (sum(beyond) <= 2)


def test_the_chance_of_a_line_is_that_of_f(model: IdentifiedModel) -> None:
    test = measured(model.plant, 4)
    response = test.response.copy()
    response[70] += np.exp(1j * np.angle(response[70] - model.plant(1j * OMEGA[70]))) * 0.12
    sweep = fitted(model, replace(test, response=response))
    assert isinstance(sweep, NewSweep)
    found = reach_at_lines(model, sweep)
    assert found.omega == OMEGA[70]
    ratio = (found.distance - found.bound) ** 2 / (sweep.noise[70] ** 2)
    expected = OMEGA.size * stats.f.sf(ratio, 2, 2 * OMEGA.size - 8)
    assert found.chance == pytest.approx(min(1.0, expected), rel=1e-9)


def test_the_sector_is_that_of_the_loop_itself(design: Design) -> None:
    """1 + theta1~ by the quotient of the return differences, on a dense grid."""
    forward, feedback = design.controller_parts()
    s = 1j * np.geomspace(1e-2, 1e5, 400_001)
    C = forward(s) / (1 - feedback(s) * np.exp(-design.plant.delay_s * s))
    M = design.corrected.kind.one_plus(s)
    for share in (0.02, 0.3, -0.3):
        true = moved(replace(design.plant, gain=1.1 * design.plant.gain), share)
        lowest = np.min((M * (1 + design.plant(s) * C) / (1 + true(s) * C)).real) - 1
        expected = 1.0 if lowest >= -1 else -1 / lowest
        assert sector_with(design, design.corrected.kind, true) == pytest.approx(expected, rel=1e-6)


def test_every_plant_within_the_bound_keeps_what_is_promised(model: IdentifiedModel, design: Design) -> None:
    promised = promise(design)
    assert isinstance(promised.margins, Margins)
    assert promised.modulus == pytest.approx(promised.margins.modulus.value / 2, rel=0.01)  # |W_a C S| is chosen as 1/2
    s, rng = 1j * np.geomspace(1e-2, 1e5, 5000), np.random.default_rng(1)
    for _ in range(3):
        true = moved(model.plant, rng.normal())
        apart = np.max(np.abs(true(s) - model.plant(s)) / np.abs(model.additive_bound(s)))
        scale = 0.9 / apart
        true = moved(model.plant, (true.pole_modes[0].omega / model.plant.pole_modes[0].omega - 1) * scale)
        if np.max(np.abs(true(s) - model.plant(s)) / np.abs(model.additive_bound(s))) > 1:
            continue
        found = on_plant(design, true)
        assert isinstance(found.margins, Margins)
        assert found.margins.modulus.value >= promised.modulus
        assert found.sector is not None
        assert found.sector >= promised.sector


def test_a_loop_that_is_not_stable_is_not_to_be_run(model: IdentifiedModel, design: Design) -> None:
    late = replace(PLANT, delay_s=0.3)
    found = check_model(model, [measured(late, 2)], design)
    assert first_sentence(found).startswith("Do not run this design: ")
    assert asked(found, "margins")[1].startswith("the loop is NOT stable with the new plant (the loop has ")
    assert asked(found, "guarantee") == (Outcome.LOST, "an unstable loop has no guarantee")


@pytest.mark.parametrize(("height", "is_told"), [(0.0, False), (0.1, True)])
def test_a_resonance_of_its_own_is_told(model: IdentifiedModel, height: float, is_told: bool) -> None:
    s = 1j * OMEGA / 120
    extra = 1 + height * s**2 / (1 + 0.1 * s + s**2)
    test = measured(PLANT, 1)
    outcome, sentence = asked(check_model(model, [replace(test, response=test.response * extra)]), "parameters")
    assert (outcome is Outcome.MOVED) == is_told
    assert ("the sweep shows dynamics that the model's structure lacks, near 1" in sentence) == is_told  # of 19 Hz


def test_few_scattered_tests_do_not_tell_that_nothing_moved(model: IdentifiedModel) -> None:
    """14 standard errors are no chance if these are known, but of 2 degrees of freedom they may be."""
    assert model.fit is not None
    gain = abs(model.plant.gain)
    spread = 0.03 * gain / np.sqrt(3)
    scatter = (spread, *(10 * np.array(model.fit.noise[1:])))
    scattered = replace(model, fit=replace(model.fit, agreement_of_tests=1e-6, scatter=scatter))
    sweep = measured(replace(PLANT, gain=1.5 * PLANT.gain), 5)
    errors = np.log(1.5) / (0.03 * np.sqrt(1 + 1 / 3))
    assert 12 * stats.norm.sf(errors) < LEVEL / 2 < 12 * stats.t.sf(errors, 2)
    outcome, sentence = asked(check_model(scattered, [sweep]), "parameters")
    assert outcome is Outcome.OPEN
    assert re.match(r"3 tests are too few to show whether a parameter moved: the gain differs by \+\d\d % ", sentence)
    least = np.expm1(stats.t.isf(LEVEL / 24, 2) * 0.03 * np.sqrt(4 / 3))
    told = re.search(r"only a move of (\d+) % or more can be detected", sentence)
    assert told is not None
    assert float(told[1]) == pytest.approx(100 * least, rel=0.1)


# the command


def write(path: Path, test: FrequencyResponse) -> Path:
    table = pd.DataFrame({"omega": test.omega, "real": test.response.real, "imag": test.response.imag})
    table.to_csv(path, index=False)
    return path


@pytest.fixture(scope="module")
def bench(model: IdentifiedModel, design: Design, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench")
    (folder / "model.json").write_text(model.to_json(), encoding="utf-8")
    (folder / "design.json").write_text(design.to_json(), encoding="utf-8")
    write(folder / "same.csv", measured(PLANT, 31))
    write(folder / "a|b <&>\x07.csv", measured(moved(PLANT, 0.02), 32))
    return folder


def check(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["check", *map(str, words)])
    return result.exit_code, result.output


def test_the_command_ends_as_it_says(bench: Path, tmp_path: Path) -> None:
    junit, markdown = tmp_path / "check.xml", tmp_path / "check.md"
    given = bench / "model.json", bench / "same.csv", "--against", bench / "design.json"
    status, said = check(*given, "--junit", junit, "--markdown", markdown)
    assert (status, said.split(":")[0]) == (0, "Nothing to do")
    root = ElementTree.parse(junit).getroot()
    assert (root.get("tests"), root.get("failures")) == ("4", "0")
    status, said = check(*given, bench / "a|b <&>\x07.csv", "--junit", junit, "--markdown", markdown)
    assert (status, said.split(":")[0]) == (1, "Fit a new model")
    suite = ElementTree.parse(junit).getroot()[0]
    assert [suite.get(name) for name in ("tests", "failures", "errors", "skipped")] == ["8", "2", "0", "0"]
    failed = {case.get("name"): case[0].get("message") for case in suite.iter("testcase") if case[0].tag == "failure"}
    assert set(failed) == {f"a|b <&>\\x07.csv: {question}" for question in ("within W_a", "parameters")}
    assert "the frequency of pole mode 1 moved by +2 %" in str(failed["a|b <&>\\x07.csv: parameters"])
    lines = markdown.read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("**Fit a new model: ")
    for row in (line for line in lines if line.startswith("|")):
        assert len(re.findall(r"(?<!\\)\|", row)) in (4, 5, 7), row  # of the tables of margins, answers and parameters
        assert "<" not in re.sub(r"\\.", "", row)


def test_a_model_without_a_fit_is_compared_with_its_bound_alone(
    bench: Path, model: IdentifiedModel, tmp_path: Path
) -> None:
    bare = tmp_path / "bare.json"
    bare.write_text(replace(model, fit=None, standard_errors=None).to_json(), encoding="utf-8")
    status, said = check(bare, bench / "same.csv")
    assert status == 0
    assert said.startswith("Nothing to do: the sweep lies within W_a; unknown: parameters\n")
    status, said = check(bare, bench / "a|b <&>\x07.csv")
    assert (status, "MOVED" in said, "could show whether the plant moved" in said) == (1, False, True)


@pytest.mark.parametrize("change", [{"tests": []}, {"band": [0.0, 9.0]}, {"band": [9.0]}])
def test_a_fit_that_does_not_say_where_it_was_made_is_refused(
    bench: Path, tmp_path: Path, change: dict[str, list[float]]
) -> None:
    content = json.loads((bench / "model.json").read_text(encoding="utf-8"))
    content["fit"] |= {"tests": [each | change for each in content["fit"]["tests"]]} | change
    (tmp_path / "model.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=f"'{next(iter(change))}' is .*of 'fit', which may be left out"):
        read_model(tmp_path / "model.json")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"model": "nowhere.json"}, "nowhere.json: no such file"),
        ({"design": "model.json"}, "schema is 1; expected 3"),
        ({"design": "other.json"}, "the design's plant is not that of the model"),
        ({"sweep": "elsewhere.csv"}, "has lines from 3183.1 to 50929.6 Hz; expected some from 3.1831 to 50.9296 Hz"),
        (
            {"sweep": "narrow.csv"},
            "has lines from 35.7622 to 50.9296 Hz; expected 80 % or more of the decades from 3.18",
        ),
        ({"sweep": "few.csv"}, "few.csv: has 7 lines where the model was measured; expected 8 or more"),
        ({"output": "same.csv"}, "same.csv: is an input too"),
    ],
)
def test_what_is_refused_writes_nothing(
    bench: Path, model: IdentifiedModel, design: Design, tmp_path: Path, change: dict[str, str], sentence: str
) -> None:
    test = measured(PLANT, 1)
    write(tmp_path / "narrow.csv", replace(test, omega=OMEGA[130:], response=test.response[130:]))
    few = np.append(OMEGA[:140:20], [400.0, 500.0])
    write(tmp_path / "few.csv", replace(test, omega=few, response=PLANT(1j * few)))
    write(tmp_path / "elsewhere.csv", replace(test, omega=1e3 * OMEGA))
    other = replace(design, plant=moved(design.plant, 1e-9))
    (tmp_path / "other.json").write_text(other.to_json(), encoding="utf-8")
    for name in ("model.json", "design.json", "same.csv"):
        (tmp_path / name).write_bytes((bench / name).read_bytes())
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    names = {"model": "model.json", "sweep": "same.csv", "design": "design.json", "output": "check.xml"} | change
    at = {key: tmp_path / name for key, name in names.items()}
    status, said = check(at["model"], at["sweep"], "--against", at["design"], "--junit", at["output"])
    assert status == 2
    assert sentence in said
    assert "Traceback" not in said
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
