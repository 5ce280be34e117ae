"""The one page on a plant: what it says to do, that all is on the page, legible, and the same bytes every time."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result
from made_up_fit import RICH, SIMPLE, design_of, model_of, plant_of, sweeps_of
from matplotlib.figure import Figure

from data.thesis import model_named
from design.design_file import Design
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.fit_record import Criterion
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.reports import ModeCheck, SubspaceCheck
from identification.model.signals import Signals
from paper_figures.__main__ import main
from paper_figures.look import style
from paper_figures.summary import page
from paper_figures.summary.advice import advice
from paper_figures.summary.build_folder import Found
from paper_figures.summary.of_fit import paragraphs, parameter_table
from paper_figures.summary.words import Summary, summarise

SIGNALS = Signals("valve current", "mA", "level", "cm")
REFUSED = "where W_a is as large as the plant, no controller is robust"
NAN = np.nan


def tracking(limits: tuple[float, float] = (-6.5, 6.5), steady: float = 4.25, last: float = 3.125) -> pd.DataFrame:
    rows = [
        {"run": run, "last_saturation_s": last, "offset": offset, "ripple": 0.125, "relative_error_percent": 1.5}
        | {
            "slews": 0,
            "recovery_s": last,
            "rate_limit": NAN,
            "asked_control": 12.5,
            "covered_control": 17.25,
            "largest_control": 12.75,
            "covered": 1,
        }
        for run, offset in (("none", 0.75), ("corrected", 0.0))
    ]
    facts = {"lower_limit": limits[0], "limit": limits[1], "steady_least": -steady, "steady_greatest": steady}
    return pd.DataFrame(rows).assign(**facts, linear_control=9.5, span_s=4.0, until_s=20.0, settled=1)


def compared(none: float = 2.5, corrected: float = 1.25, enough: float = 1.0, **others: float) -> pd.DataFrame:
    times = {"none": none, "corrected": corrected} | others
    rows = [{"run": run, "upset": upset, "recovery_s": times[run]} for upset in ("start", "pulse") for run in times]
    return pd.DataFrame(rows).assign(enough=enough, rate_limit=NAN, refused=NAN, guarantee="sector 0.9")


def rates(asked: float = NAN, **errors: list[float]) -> pd.DataFrame:
    """Of both runs at 100, 200 and 400 Hz; an infinite error is a loop that is not stable."""
    every = {"matched": [0.01, 0.01, 0.01], "tustin": [0.5, 0.125, 0.03], "exact": [37.0, 3.5, 0.5]} | errors
    rows = [{"run": run, "method": "continuous", "rate_hz": NAN, "steady_error": 0.01, "stable": 1} for run in RUNS]
    rows += [
        {"run": run, "method": method, "rate_hz": rate, "steady_error": error, "stable": int(np.isfinite(error))}
        for run in RUNS
        for method, of_method in every.items()
        for rate, error in zip((100.0, 200.0, 400.0), of_method, strict=True)
    ]
    return pd.DataFrame(rows).assign(
        asked_hz=asked, amplitude=10.0, quantum=0.0, rate_limit=NAN, unslewed_error=NAN, settled=1
    )


RUNS = ("none", "corrected")
LIMITS = pd.DataFrame({"periodic_lower": [0.375]})
AXIS = pd.DataFrame(
    [
        {"key": "limit", "value": "-6.5 6.5", "source": "chosen", "why": "ASSUMED: none were given"},
        {"key": "amplitude", "value": "10", "source": "given", "why": ""},
    ]
)


def tables() -> dict[str, pd.DataFrame | str]:
    drawn = pd.DataFrame({"plants": [200]})
    return {
        "tracking": tracking(),
        "compare": compared(),
        "rates": rates(),
        "limits_extended": LIMITS,
        "campaign": drawn,
    }


def found_of(design: Design | None = None, **others: pd.DataFrame | str) -> Found:
    designs = {"design": design or design_of("extended"), "design_delay_free": REFUSED}
    return Found(AXIS, designs, tables() | others)


def page_of(
    plant: PlantModel, count: int, bound: AdditiveBound = SIMPLE, refused: bool = False, synthetic: bool = False
) -> tuple[Summary, Figure]:
    tests = sweeps_of(plant, count, synthetic)
    model = model_of(plant, tests, bound, SIGNALS)
    found = Found(AXIS, {"design": REFUSED, "design_delay_free": REFUSED}) if refused else found_of()
    said = summarise(model, tests, found)
    return said, page.draw(said, model, tests)


PAGES = {
    "one test, four parameters": (plant_of(1), 1, SIMPLE, False, True),
    "17 tests, 31 parameters": (plant_of(7, 2, 1), 17, RICH, False, False),
    "refused": (plant_of(1, 0, 1), 3, RICH, True, False),
    "a gain": (PlantModel(-2.0, (), (), 0.0, 0), 2, SIMPLE, True, False),
}


@pytest.mark.parametrize("arguments", PAGES.values(), ids=PAGES)
def test_all_is_on_the_page_and_legible(arguments, extents):
    said, figure = page_of(*arguments)
    size = figure.get_size_inches()
    assert tuple(size) == pytest.approx((8.27, 11.69))
    figure.set_dpi(200)
    printed = extents(figure, lambda figure: figure.texts)
    for text, box in printed:
        assert box.x0 > 0.6, text
        assert box.x1 < size[0] - 0.6, text
        assert box.y0 > 0.6, text
        assert box.y1 < size[1] - 0.6, text
    for (text, box), (other, beside) in combinations(printed, 2):
        overlap = min(box.x1, beside.x1) - max(box.x0, beside.x0), min(box.y1, beside.y1) - max(box.y0, beside.y0)
        assert min(overlap) < 0.03, (text, other)
    assert min(text.get_fontsize() for text in figure.texts) >= 6
    tops, bottoms = zip(*((panel.get_position().y1, panel.get_position().y0) for panel in figure.axes), strict=True)
    assert not any(min(bottoms) * size[1] < box.y1 and box.y0 < max(tops) * size[1] for _, box in printed)
    assert (max(tops) - min(bottoms)) * size[1] > 2.5
    for words in (said.title, said.synthetic):
        assert words in [text for text, _ in printed] or not words


@pytest.mark.parametrize("arguments", PAGES.values(), ids=PAGES)
def test_page_and_text_hold_the_same_cells(arguments):
    said, figure = page_of(*arguments)
    page, text = {line.get_text() for line in figure.texts}, said.text()
    tables = [said.parameters, *([said.runs] if said.runs else [])]
    cells = {cell for table in tables for row in table.rows for cell in row if cell}
    assert {cell for cell in cells if "omega" not in cell} <= page
    assert all(cell in text for cell in cells)
    assert all(len(line) <= 140 for line in text.splitlines())
    assert ("SYNTHETIC" in text) == any("SYNTHETIC" in line for line in page) == bool(said.synthetic)


FULL_PAGE = """
level over valve current: plant with
SYNTHETIC DATA: 2 of 2 tests
Do: Use the controller of design.json with the anti-windup 'corrected'
stays below 17.2 mA; under this reference it reached 12.8 mA, no more.
The limits +-6.5 mA suffice for this reference: in steady state the reference needs a control of
-4.25 to 4.25 mA, 65 % of the way to the nearer one; in the run
the loop without limits asks for up to 9.5 mA, so the actuator saturates.
by the method 'matched' at 100 Hz or more
Avoid: Do not leave the anti-windup out: without it an error of 0.875 cm is left at the end of the run, with
Do not use Tustin's rule below 400 Hz: at 200 Hz the steady error is 0.125 cm.
Do not use held-input discretisation at any rate up to 400 Hz: at 400 Hz the steady error is 0.5 cm.
Assumed: limit = -6.5 to 6.5 mA: ASSUMED: none were given.
gain K [cm/(mA s)] 2.000 1.960 to 2.040 0.006 0.02
0.0500 0.0490 to 0.0510
2 tests in day_0.csv, day_1.csv; 120 lines from 5 to 400 rad/s
Its BIC is 94 better than that of the next best, 1 integrator.
the scatter of the 2 tests by Student's distribution
probability below 1e-06
noise of 1.2 % of the response
W_a = 0.3 (1 + s/40) / (1 + 2 0.2 s/60 + (s/60)^2)
It is 3.25 times the largest of these distances on average and 12.5 times at most; no bound of this order gets
below 11.7 times
It touches day_0.csv at 55.5 rad/s
run last at a limit [s] largest control [mA]
without anti-windup 3.12 12.5 0.875 1.5
anti-windup corrected 3.12 12.5 0.125 1.5
"""


def test_numbers_and_sentences_of_a_full_page():
    words = " ".join(page_of(plant_of(1), 2, synthetic=True)[0].text().split())
    assert [part for part in FULL_PAGE.strip().splitlines() if part not in words] == []
    assert words.count("Refused") == 1
    assert "Not yet on this page" not in words


def advised(found: Found) -> dict[str, str]:
    plant = plant_of(1)
    return dict(advice(model_of(plant, sweeps_of(plant, 1), signals=SIGNALS), found))


CASES = {
    "limits that do not suffice": (
        {"tracking": tracking(steady=8.125)},
        "Do",
        "Make the reference smaller to 80 % of its size, or widen the limits 1.25 times: the limits +-6.5 mA do NOT "
        "suffice: in steady state the reference needs a control of -8.12 to 8.12 mA, so no controller "
        "follows it: each leaves an error of 0.375 cm or more.",
    ),
    "limits above 0": (
        {"tracking": tracking((0.5, 3.0), 2.5)},
        "Do",
        "Make the reference smaller: the limits 0.5 to 3 mA do NOT suffice",
    ),
    "limits that are never reached": (
        {"tracking": tracking(last=0.0)},
        "Do",
        "asks for up to 9.5 mA, so the actuator never saturates.",
    ),
    "an anti-windup that does harm": (
        {"compare": compared(1.25, 2.5)},
        "Avoid",
        "Do not use the anti-windup 'corrected': from rest it recovers after 2.5 s, without anti-windup the loop "
        "recovers after 1.25 s.",
    ),
    "one that never recovers": ({"compare": compared(1.25, NAN)}, "Avoid", "after a disturbance it recovers never"),
    "a loop that is not stable": (
        {"rates": rates(exact=[np.inf, np.inf, 0.01])},
        "Avoid",
        "Do not use held-input discretisation below 400 Hz: at 200 Hz the loop is unstable.",
    ),
    "the computer's own rate": (
        {"rates": rates(200.0)},
        "Do",
        "At your rate of 200 Hz the steady error is 0.01 cm by the method 'matched', 0.125 cm by Tustin's rule, 3.5 cm "
        "by held-input discretisation.",
    ),
    "no rate": (
        {"rates": rates(matched=[5.0] * 3, tustin=[5.0] * 3)},
        "Do",
        "Look for a faster computer or a slower reference: by no method does the controller come within 1 %",
    ),
    "what is not there yet": ({}, "", ""),
}


@pytest.mark.parametrize(("others", "head", "part"), CASES.values(), ids=CASES)
def test_the_advice_follows_from_the_runs(others, head, part):
    said = advised(found_of(**others))
    assert not part or part in said[head]
    plain = advised(found_of())
    assert all(part not in sentence for sentence in plain.values()) or not part


def test_a_run_that_does_harm_takes_the_anti_windup_back():
    assert "design.json without anti-windup" in advised(found_of(compare=compared(1.25, 2.5)))["Do"]


def test_other_limits_than_the_user_s_own_do_not_judge_an_anti_windup():
    worse = replace(design_of("extended"), compared=("corrected is WORSE than no anti-windup under the limits +-1",))
    assert advised(found_of(worse)) == advised(found_of())
    assert "'corrected'" in advised(Found(AXIS, {"design": worse}))["Do"]


def test_errors_of_rounding_are_not_compared():
    """Of 2.53e-14 and 2.49e-14 neither is the better."""
    alike = tracking().assign(relative_error_percent=6e-13)
    assert "leave the anti-windup out" in advised(found_of())["Avoid"]
    assert "leave the anti-windup out" not in advised(found_of(tracking=alike))["Avoid"]


def test_a_reference_that_takes_no_steady_control_is_said_to_ask_for_what_the_run_did():
    said = advised(found_of(tracking=tracking(steady=0.0, last=0.0)))["Do"]
    assert (
        "in steady state the reference needs a control of 0 mA; in the run the loop without limits asks for up to "
        "9.5 mA, so the actuator never saturates." in said
    )


def test_a_constant_has_no_crest():
    rows = [("reference-hz", "0", "given"), ("amplitude", "2", "given"), ("phase", "1.57", "chosen")]
    axis = pd.DataFrame(
        [{"key": key, "value": value, "source": source, "why": "its crest"} for key, value, source in rows]
    )
    assert "Assumed" not in advised(replace(found_of(), axis=axis))
    axis.loc[0, "value"] = "0.5"
    assert "its crest" in advised(replace(found_of(), axis=axis))["Assumed"]


@pytest.mark.parametrize(
    ("own", "best", "why"),
    [
        ("2 integrators, 1 pole mode", "1 integrator, 1 pole mode, 1 real pole", "most integrators"),
        ("1 pole mode, 1 real zero", "1 pole mode, 1 right-half-plane real zero", "a zero in the right half plane"),
        ("1 integrator", "1 integrator, 1 real zero, 1 real pole", "roots of that one lie far outside the band"),
        ("11 pole modes", "1 integrator, 9 pole modes", "roots of that one lie far outside the band"),
    ],
)
def test_a_worse_criterion_is_explained(own, best, why):
    plant = plant_of(1)
    model = model_of(plant, sweeps_of(plant, 1))
    record = replace(model.fit, criterion=Criterion("BIC", 1.0, {own: 5.0, best: 1.0}, own))
    said = dict(paragraphs(replace(model, fit=record), sweeps_of(plant, 1)))["Structure"]
    assert f"Its BIC is 4 worse than that of {best}; " in said
    assert why in said


@pytest.mark.parametrize(
    ("guarantee", "part"),
    [
        ("global", "stays within them (guaranteed for the fitted plant)"),
        ("robust", "stays within them (guaranteed for every plant within the bound W_a)"),
    ],
)
def test_what_is_guaranteed_is_said(guarantee, part):
    design = design_of("extended")
    own = replace(design, corrected=replace(design.corrected, guarantee=guarantee, sector=None))
    assert part in advised(found_of(own))["Do"]


def test_a_delay_free_design_is_judged_with_the_dead_time(delay_free_design, implied):
    """The printed delay-free loop has no dead time; with half a second it is unstable, and K may be so by itself."""
    stable = replace(delay_free_design.blocks["K"], poles=(-1 + 0j,), zeros=(), gain=1e-6)
    blocks = {**delay_free_design.blocks, "K": stable}
    late = replace(delay_free_design, plant=replace(implied.plant, delay_s=0.5))

    def said(design: Design) -> dict[str, str]:
        return advised(Found(AXIS, {"design": design_of("extended"), "design_delay_free": design}, tables()))

    assert delay_free_design.blocks["K"].is_stable
    assert "with the plant's dead time of 500 ms its loop is unstable" in said(late)["Avoid"]
    soon = replace(late, plant=replace(late.plant, delay_s=1e-9))
    assert (
        "The loop with the controller of design_delay_free.json is stable with the plant's dead time of 1 ns too."
        in said(soon)["Do"]
    )
    unstable = replace(late, blocks=blocks | {"K": replace(stable, poles=(1 + 0j,))})
    assert "it is unstable by itself and diverges" in said(unstable)["Avoid"]


def test_the_page_says_what_is_still_to_come():
    alone = advised(Found())
    assert set(alone) == {"Not yet on this page"}
    assert alone["Not yet on this page"] == "This page holds the fit alone; designs and runs follow."
    assert advised(Found(AXIS))["Not yet on this page"] == "Designs and runs follow."
    part = {name: table for name, table in tables().items() if name not in ("rates", "campaign")}
    said = advised(Found(AXIS, dict.fromkeys(("design", "design_delay_free"), design_of("extended")), part))
    assert said["Not yet on this page"] == "the runs on a computer; the plants within W_a."


def test_refusals_stand_at_the_end_each_with_what_it_is():
    plant = plant_of(1)
    tests = sweeps_of(plant, 1)
    found = Found(AXIS, {"design": design_of("extended"), "design_delay_free": REFUSED}, tables() | {"rates": "no"})
    said = summarise(model_of(plant, tests), tests, found)
    assert said.refused == (
        ("Refused", f"The delay-free design: {REFUSED}."),
        ("Refused", "The runs on a computer: no."),
    )
    assert said.runs is not None
    assert "Run it on a computer" not in said.text()


def test_what_the_fit_leaves_is_said():
    plant = PlantModel(2.0, (), (Mode(20.0, 1.5e-5),), 0.0)
    tests = sweeps_of(plant, 2)
    model = model_of(plant, tests)
    fit = model.fit
    found, missed = ModeCheck("pole", 20.0, 0.25, 20.125, 0.375), ModeCheck("pole", 20.0, 0.25, None, None)
    fit = replace(
        fit,
        tests=tuple(replace(test, median_distance=0.25) for test in fit.tests),
        misfit=fit.noise,
        cautions=(
            "noise does not explain a median distance of 25 %",
            "the data show no dead time",
            f"{tests[0].name}: the plant misses the line at 2 Hz",
        ),
        agreement_of_tests=0.5,
        criterion=Criterion("BIC", 19.5, {fit.structure: 5.0}, fit.structure),
        checks={
            "day_0.csv": SubspaceCheck(4, 0.01, (found, missed)),
            "day_1.csv": SubspaceCheck(4, 0.01, (replace(found, found_omega=20.5), missed)),
            "day_2.csv": SubspaceCheck(4, 0.01, (), "too short"),
        },
    )
    text = " ".join(summarise(replace(model, fit=fit), tests, Found()).text().split())
    for part in (
        "differ by no more: tests of one plant would differ as much with a probability of 0.5",
        "No other structure was tried. The deviance is divided by 19.5",
        "Noise does not explain a median distance of 25 %.",
        f"The data show no dead time. {tests[0].name}: the plant misses",
        "the intervals are widened for it",
        "finds 2 of their 4 modes, with omega within 2.5 % and zeta within 50 % of the fit.",
        "N4SID does not find the pole of 20 rad/s (day_0.csv), pole of 20 rad/s (day_1.csv).",
        "N4SID gives no answer for day_2.csv: too short.",
    ):
        assert part in text, part


def test_long_lists_of_files_are_cut():
    plant = plant_of(1)
    tests = sweeps_of(plant, 9)
    text = summarise(model_of(plant, tests), tests, Found()).text()
    assert "9 tests in day_0.csv, day_1.csv, ..., day_8.csv;" in text


@pytest.mark.parametrize(
    ("half", "shown"),
    [(0.5, "174.00 to 175.00"), (0.0123, "174.488 to 174.512"), (60.0, "114 to 234"), (400.0, "-226 to 574")],
)
def test_an_interval_shows_two_digits_of_its_half_width(half, shown):
    plant = PlantModel(174.5, (), (), 0.0, 0)
    tests = sweeps_of(plant, 1)
    model = model_of(plant, tests)
    fit = replace(model.fit, lower=(174.5 - half, 0.0), upper=(174.5 + half, 0.0))
    row = parameter_table(replace(model, fit=fit)).rows[0]
    assert row[2] == shown


def test_model_of_other_tests_or_of_none_is_refused():
    plant = plant_of(1)
    tests = sweeps_of(plant, 2)
    with pytest.raises(InputError, match=r"fitted to day_0.csv, day_1.csv; expected these sweeps"):
        summarise(model_of(plant, tests), tests[:1], Found())
    with pytest.raises(InputError, match="holds no fit that this version reads; expected one that it fitted to sweeps"):
        summarise(model_named("implied"), tests, Found())


def test_lines_are_broken_at_words_and_symbols_are_set():
    with style.styled():
        words = "one zeta_two.csv omega " * 20 + "$ (s/7)^2 +-3 omega."
        broken = page._broken(words, 3.0, 8.0)
        assert " ".join(broken) == " ".join(words.split())
        assert len(broken) > 3
        assert all(page._width(line, 8.0) <= 3.0 for line in broken)
        assert page._broken("w" * 200, 1.0, 8.0) == ["w" * 200]
    assert page._typeset("omega.csv omega, $5 +-3 omega.") == r"omega.csv $\omega$, \$5 $\pm$3 $\omega$."


@pytest.fixture
def build(tmp_path: Path) -> Path:
    """A folder with a model of one sweep, its sweep and a refused design."""
    plant = plant_of(1)
    (test,) = sweeps_of(plant, 1)
    rows = [f"{w:.9g},{h.real:.9g},{h.imag:.9g}" for w, h in zip(test.omega, test.response, strict=True)]
    (tmp_path / "day_0.csv").write_text("omega,real,imag\n" + "\n".join(rows) + "\n", encoding="utf-8")
    (tmp_path / "model.json").write_text(model_of(plant, [test]).to_json(), encoding="utf-8")
    (tmp_path / "results").mkdir()
    (tmp_path / "design.refused.txt").write_text(f"{REFUSED}.\n", encoding="utf-8")
    (tmp_path / "design_delay_free.refused.txt").touch()
    return tmp_path


def summary(build: Path) -> Result:
    return CliRunner().invoke(
        main, ["summary", str(build / "model.json"), str(build / "day_0.csv"), "--build", str(build)]
    )


def test_command_reads_what_was_made_and_refused_and_writes_the_same_bytes_twice(build):
    result = summary(build)
    assert result.exit_code == 0, result.output
    said = f"Refused: The extended design: {REFUSED}."
    assert result.output == f"1 test -> {build / 'summary.pdf'}\n{said}\n"
    assert said in " ".join((build / "summary.txt").read_text(encoding="utf-8").split())
    first = {path.suffix: path.read_bytes() for path in build.glob("summary.*")}
    assert set(first) == {".pdf", ".png", ".svg", ".txt"}
    assert summary(build).exit_code == 0
    assert {path.suffix: path.read_bytes() for path in build.glob("summary.*")} == first


def test_command_refuses_what_it_cannot_read(build):
    (build / "design.refused.txt").unlink()
    (build / "design.json").write_text(design_of("extended").to_json(), encoding="utf-8")
    (build / "results" / "tracking_summary.csv").write_text("run,limit\nnone,1\n", encoding="utf-8")
    result = summary(build)
    assert result.exit_code == 2
    path = build / "results" / "tracking_summary.csv"
    assert result.output.startswith(f"Error: {path}: no column ")
    (build / "day_0.csv").unlink()
    assert "no such file" in summary(build).output
    assert not list(build.glob("summary.*"))


def test_panels_show_tests_model_and_bound():
    _, figure = page_of(plant_of(1), 3)
    magnitude, _, phase, relative = figure.axes
    assert [len(panel.lines) for panel in figure.axes] == [4, 5, 4, 4]
    assert magnitude.lines[-1].get_zorder() >= magnitude.lines[0].get_zorder()
    ring = figure.axes[1].lines[-1]
    assert ring.get_xdata() == pytest.approx([55.5 / (2 * np.pi)])
    assert ring.get_ydata() == pytest.approx(20 * np.log10(np.abs(SIMPLE(55.5j))).reshape(1))
    assert [panel.get_xlabel() != "" for panel in figure.axes] == [False, False, True, True]
    letters = [text.get_text() for panel in (magnitude, phase, figure.axes[1], relative) for text in panel.texts]
    assert letters == ["(a)", "(b)", "(c)", "(d)"]
    assert all(a < b for a, b in pairwise(letters))


def test_the_anti_windup_is_the_one_whose_run_recovers():
    found = found_of(compare=compared(NAN, NAN, static=1.5, observer=2.5))
    said = advised(found)
    assert "'static' (--anti-windup static): from rest it recovers after 1.5 s" in said["Do"]
    assert "Do not use the anti-windup 'corrected': with it the loop does not recover from rest." in said["Avoid"]
    nothing = advised(found_of(compare=compared(NAN, NAN, enough=4.0)))["Do"]
    assert "With a reference 4 times smaller, or limits 4 times wider, one does" in nothing
    assert "would suffice: in steady state" in nothing
    assert "Run it on a computer" not in nothing


def test_a_rate_limit_that_acts_leaves_no_guarantee_and_is_blamed_for_what_stays():
    slow = tracking().assign(rate_limit=30.0, slews=1)
    said = advised(found_of(tracking=slow))["Do"]
    assert "since the rate limit of 30 mA/s acts in this run and the guarantee covers saturation limits alone" in said
    assert "guaranteed to return" not in said
    never = advised(found_of(tracking=slow.assign(slews=0)))["Do"]
    assert "guaranteed to return" in never
    assert "The rate limit of 30 mA/s is never reached in the run" in never
    table = rates(200.0, matched=[0.01, 5.0, 0.01]).assign(rate_limit=30.0)
    table["unslewed_error"] = table["unslewed_error"].where(table["rate_hz"] != 200.0, 0.015)
    avoided = advised(found_of(rates=table))["Avoid"]
    assert "because of the rate limit of 30 mA/s the loop does not come to rest, and an error of 5 cm stays" in avoided
