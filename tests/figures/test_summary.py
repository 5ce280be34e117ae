"""The one page on a plant: what it says, that all of it is on the page, legible, and the same bytes every time."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result
from matplotlib.figure import Figure

from data.thesis import model_named
from design.anti_windup.compensator import second_order
from design.anti_windup.judge import CorrectedCompensator, Judgement, PrintedCompensator
from design.blocks.block import Block
from design.design_file import Design
from design.hinf.mixed_sensitivity import Synthesis
from design.parameters import DelayFreeParameters, ExtendedParameters, RollOff
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.fit_record import Criterion, FitRecord, FittedTest, Noise
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.reports import BoundReport, Excess, ModeCheck, SubspaceCheck, Touch
from identification.model.structure import Structure
from identification.sweeps.response import FrequencyResponse
from paper_figures.__main__ import main
from paper_figures.look import style
from paper_figures.summary import page
from paper_figures.summary.of_designs import sentences
from paper_figures.summary.of_fit import parameter_table
from paper_figures.summary.words import Summary, summarise

NO_INTEGRATOR = "the plant has 0 integrators; the design expects exactly one, Eq. (2.20)"
SIMPLE = AdditiveBound.printed_form(0.3, 40.0, 60.0, 0.2)
RICH = AdditiveBound(0.3, (Mode(20.0, 0.4),), (Mode(15.0, 0.3), Mode(70.0, 0.2)), (40.0,), ())


def plant_of(modes: int, integrators: int = 1, poles: int = 0) -> PlantModel:
    return PlantModel(
        2.0,
        tuple(Mode(20.0 * 1.5**i, 0.05) for i in range(modes)),
        tuple(Mode(25.0 * 1.5**i, 0.04) for i in range(modes)),
        0.004,
        integrators,
        real_poles=(12.5,) * poles,
    )


def sweeps_of(plant: PlantModel, count: int, synthetic: bool = False) -> list[FrequencyResponse]:
    omega = np.geomspace(5.0, 400.0, 60)
    response = plant(1j * omega)
    return [
        FrequencyResponse(omega, response * (1.02 + 0.01 * i + 0.01 * np.sin(40 * omega)), None, f"day_{i}.csv")
        if not synthetic
        else FrequencyResponse(omega, 1.1 * response, None, f"day_{i}.csv", synthetic=True)
        for i in range(count)
    ]


def record_of(plant: PlantModel, tests: list[FrequencyResponse], bound: AdditiveBound) -> FitRecord:
    zeros, poles = (
        2 * len(modes) + len(rates)
        for modes, rates in ((plant.zero_modes, plant.real_zeros), (plant.pole_modes, plant.real_poles))
    )
    structure = Structure(plant.integrators, zeros, poles)

    def share(part: float) -> tuple[float, ...]:
        return tuple(part * parameter.value for parameter in plant.parameters)

    return FitRecord(
        source="identification fit",
        synthetic=any(test.synthetic for test in tests),
        structure=str(structure),
        method="maximum likelihood",
        loss="least squares",
        criterion=Criterion("BIC", 1.0, {str(structure): 5.0, "1 integrator": 99.0}, str(structure)),
        lower=share(0.98),
        upper=share(1.02),
        noise=share(0.003),
        misfit=share(0.0),
        scatter=share(0.01) if len(tests) > 1 else None,
        agreement_of_tests=1e-9 if len(tests) > 1 else None,
        median_distances=(0.012,) * len(tests),
        cautions=("no dead time can be told from none",) if plant.delay_s == 0 else (),
        tests=tuple(
            FittedTest(
                name=test.name,
                lines=test.omega.size,
                plant=plant,
                standard_errors=share(0.003),
                noise=Noise(2e-4, 0.0125),
                chi_square=1.02,
                residual_correlation=0.03,
                median_distance=0.012,
                sha256=None,
                synthetic=test.synthetic,
                band=(float(test.omega[0]), float(test.omega[-1])),
                left_out=(),
                remarks=(),
                conjugated=False,
            )
            for test in tests
        ),
        bound=BoundReport(
            bound, 12.5, 3.25, 11.75, Excess(1.0, 1.0, 1.0), None, (Touch(55.5, tests[0].name, False, 1.0),)
        ),
        checks={},
    )


def model_of(plant: PlantModel, tests: list[FrequencyResponse], bound: AdditiveBound = SIMPLE) -> IdentifiedModel:
    return IdentifiedModel(plant, bound, None, record_of(plant, tests, bound))


def design_of(kind: str) -> Design:
    judged = Judgement(0.0625, 50.0, None, 0.0, 48.5, False, None, 0.125)
    delay_free = kind == "delay-free"
    return Design(
        kind=kind,
        plant=plant_of(1),
        additive_bound=SIMPLE,
        reference_omegas=(1.5,),
        blocks={"K": Block(1.0, (), (1 + 0j,)), "C0": Block(1.0), "T_so": Block(1.0, (), (-4 + 0j, -1 + 2j, -1 - 2j))},
        hinf=Synthesis(0.3125, "", 0.375, 0.5, 0.3125, "", 0.375, Block(1.0), Block(1.0)) if delay_free else None,
        parameters=DelayFreeParameters(4.0, 1e-4) if delay_free else ExtendedParameters(4.0, (), "zeros", 0.0, {}),
        thesis=PrintedCompensator(second_order(0.03, 0.02, 48.5), judged, 0.03, 0.02, 48.5),
        corrected=CorrectedCompensator(
            second_order(0.5, 0.5, -1.0),
            replace(judged, popov_sector=1.0, theta2_stable=True, recovery_s=1.75),
            "sector",
            "",
            0.75,
            275.0,
            0.03125,
            None,
        ),
    )


DESIGNS: dict[str, Design | str] = {"delay_free": design_of("delay-free"), "extended": design_of("extended")}


def outcomes() -> dict[str, pd.DataFrame | str]:
    rows = [
        {
            **{
                "run": run,
                "limit": 6.5,
                "required": 7.25,
                "last_saturation_s": last,
                "peak_error_after_1s": 4.5,
            },
            "relative_error_percent": error,
            **{"guaranteed_sector": sector, "needed_sector": np.inf, "largest_control": 123.5},
            **{"covered_control": 17.25, "covered": 0},
        }
        for run, last, error, sector in (
            ("none", np.nan, np.nan, np.nan),
            ("thesis", np.nan, 62.5, 0.0),
            ("corrected", 3.125, 0.75, 0.875),
        )
    ]
    return {
        **dict.fromkeys(("delay_free", "extended"), pd.DataFrame(rows)),
        "f_gamma": pd.DataFrame([{"f_best": 0.03125}]),
    }


def page_of(
    plant: PlantModel, count: int, bound: AdditiveBound = SIMPLE, refused: bool = False, synthetic: bool = False
) -> tuple[Summary, Figure]:
    tests = sweeps_of(plant, count, synthetic)
    model = model_of(plant, tests, bound)
    said = (
        summarise(model, tests, dict.fromkeys(DESIGNS, NO_INTEGRATOR), {})
        if refused
        else summarise(model, tests, DESIGNS, outcomes())
    )
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
    tables = [said.parameters, *([said.loops] if said.loops else [])]
    cells = {cell for table in tables for row in table.rows for cell in row if cell}
    assert {cell for cell in cells if "omega" not in cell} <= page
    assert all(cell in text for cell in cells)
    assert all(len(line) <= 140 for line in text.splitlines())
    assert ("SYNTHETIC" in text) == any("SYNTHETIC" in line for line in page) == bool(said.synthetic)


FULL_PAGE = """
SYNTHETIC DATA: 2 of 2 tests
gain K 2.000 1.960 to 2.040 0.006 0.02
0.0500 0.0490 to 0.0510
2 tests in day_0.csv, day_1.csv; 120 lines from 5 to 400 rad/s
Its BIC is 94 better than that of the next best, 1 integrator.
Student's distribution of the scatter of 2 tests
probability below 1e-06
noise of 1.2 % of the response
W_a = 0.3 (1 + s/40) / (1 + 2 0.2 s/60 + (s/60)^2)
3.25 times their envelope on average and 12.5 times at most (no bound of this order gets below 11.7)
It touches day_0.csv at 55.5 rad/s
= 0.375, no stabilising controller below 0.3125. K itself is UNSTABLE
poles of T_so -1+2j, -1-2j, -4
gamma = 48.5 by (2.23); corrected, guarantee sector 0.75, recovery in 1.75 s
The least f of (2.23) found over beta is 0.0312
exceeds the limits of +-6.5
no anti-windup diverges
thesis's anti-windup 0.0625 any NOT stable none to the end
1 stable LEFT 3.12 s 4.5 0.75 %
Chapter 2: With the corrected anti-windup the run is NOT covered by its guarantee, since the reference takes more
"""


def test_numbers_and_sentences_of_a_full_page():
    words = " ".join(page_of(plant_of(1), 2, synthetic=True)[0].text().split())
    assert [part for part in FULL_PAGE.strip().splitlines() if part not in words] == []
    assert "Refused" not in words


def test_refusals_stand_in_their_place_with_what_is_not_drawn():
    plant = plant_of(1)
    tests = sweeps_of(plant, 1)
    results = outcomes() | {"f_gamma": "f-gamma will not"}
    said = summarise(model_of(plant, tests), tests, DESIGNS | {"delay_free": NO_INTEGRATOR}, results)
    assert said.refused == (
        ("Chapter 2", f"Refused: {NO_INTEGRATOR}. Not drawn: Fig. 2.12 to 2.14, A.4."),
        ("Chapters 3, 4", "Refused: f-gamma will not. Not drawn: Fig. 2.10, 2.11."),
    )
    assert [head for head, _ in said.designs] == ["Chapter 2", "Chapters 3, 4", "Chapters 3, 4"]
    assert said.loops is not None
    assert all(row[0].startswith("Chapters 3, 4") for row in said.loops.rows)


def test_nothing_tried_is_nothing_said():
    plant = plant_of(1)
    tests = sweeps_of(plant, 1)
    said = summarise(model_of(plant, tests), tests, {}, {})
    assert said.designs == said.refused == ()
    assert said.loops is None
    assert "how tests would differ is not known" in said.text()


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
        cautions=("a median distance of 25 % is more than noise leaves", "no dead time can be told from none"),
        agreement_of_tests=0.5,
        criterion=Criterion("BIC", 19.5, {fit.structure: 5.0}, fit.structure),
        checks={
            "day_0.csv": SubspaceCheck(4, 0.01, (found, missed)),
            "day_1.csv": SubspaceCheck(4, 0.01, (replace(found, found_omega=20.5), missed)),
            "day_2.csv": SubspaceCheck(4, 0.01, (), "too short"),
        },
    )
    text = " ".join(summarise(replace(model, fit=fit), tests, {}, {}).text().split())
    for part in (
        "differ by no more: tests of one plant would differ as much with a probability of 0.5",
        "No other structure was tried. The deviance is divided by 19.5",
        "A median distance of 25 % is more than noise leaves.",
        "No dead time can be told from none.",
        "the intervals are widened for it",
        "finds 2 of their 4 modes, omega within 2.5 % and zeta within 50 % of the fit.",
        "N4SID finds no pole of 20 rad/s (day_0.csv), pole of 20 rad/s (day_1.csv).",
        "No answer by N4SID from day_2.csv: too short.",
    ):
        assert part in text, part


def test_long_lists_of_files_are_cut():
    plant = plant_of(1)
    tests = sweeps_of(plant, 9)
    text = summarise(model_of(plant, tests), tests, {}, {}).text()
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
        summarise(model_of(plant, tests), tests[:1], {}, {})
    with pytest.raises(InputError, match="holds no fit that this version reads; expected one that it fitted to sweeps"):
        summarise(model_named("implied"), tests, {}, {})


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
    (tmp_path / "design_delay_free.refused.txt").write_text(f"{NO_INTEGRATOR}.\n", encoding="utf-8")
    (tmp_path / "design_extended.refused.txt").touch()
    return tmp_path


def summary(build: Path) -> Result:
    return CliRunner().invoke(
        main, ["summary", str(build / "model.json"), str(build / "day_0.csv"), "--build", str(build)]
    )


def test_command_reads_what_was_made_and_refused_and_writes_the_same_bytes_twice(build):
    result = summary(build)
    assert result.exit_code == 0, result.output
    said = f"Chapter 2: Refused: {NO_INTEGRATOR}. Not drawn: Fig. 2.12 to 2.14, A.4."
    assert result.output == f"1 test -> {build / 'summary.pdf'}\n{said}\n"
    assert said in " ".join((build / "summary.txt").read_text(encoding="utf-8").split())
    first = {path.suffix: path.read_bytes() for path in build.glob("summary.*")}
    assert set(first) == {".pdf", ".png", ".svg", ".txt"}
    assert summary(build).exit_code == 0
    assert {path.suffix: path.read_bytes() for path in build.glob("summary.*")} == first


def test_command_refuses_what_it_cannot_read(build):
    (build / "design_extended.json").write_text(design_of("extended").to_json(), encoding="utf-8")
    (build / "results" / "extended_summary.csv").write_text("run,limit\nnone,1\n", encoding="utf-8")
    result = summary(build)
    assert result.exit_code == 2
    path = build / "results" / "extended_summary.csv"
    assert result.output == f"Error: {path}: no column guaranteed_sector, which summary needs\n"
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


def test_the_robust_redesign_in_words() -> None:
    plain = design_of("extended")
    design = replace(plain, parameters=replace(plain.free, roll_off=RollOff(0.9, 2, 45.5)))
    table = pd.DataFrame(
        {
            "run": ["design_extended", "design_robust"],
            "peak": [7.25, 0.875],
            "delay_least_s": [0.0, 0.0015],
            "delay_greatest_s": [0.155, 0.144],
        }
    )
    said = sentences(design, "robust", {"robustness": table})
    for part in ("2 more poles of T_so at 45.5 rad/s", "= 0.875, where that design has 7.25", "1.5 ms to 144 ms"):
        assert part in said
    assert sentences(design, "robust", {}).endswith("45.5 rad/s.")
    as_it_is = replace(plain, parameters=replace(plain.free, roll_off=RollOff(0.9, 0, 45.5)))
    assert sentences(as_it_is, "robust", {}) == "As the design of chapters 3, 4."
