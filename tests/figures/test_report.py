"""The report: all is on the page, once, escaped, unchanged and the same every time; what is missing is refused."""

from __future__ import annotations

import gzip
import json
import re
import shutil
from ast import literal_eval
from base64 import b64decode
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from html import escape
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from report_build import BREAKING_OUT, FIGURES, REFUSAL, ROOT, SWEEPS, Page, copied_build, report

from data.thesis import model_named
from design.design_file import Design, read_design
from experiments.thesis.claims.ledger import read_ledger
from identification.base.manifest import Written, content_of, write_manifest
from paper_figures.thesis.figure_registry import figure_module, figure_names
from paper_figures.thesis.report.content import Content, figure_label, first_sentence, report_content
from paper_figures.thesis.report.embedded import embedded
from paper_figures.thesis.report.html import file_size, report_html
from paper_figures.thesis.report.inputs import LEDGER, Inputs, experiment_of, read_inputs
from paper_figures.thesis.report.ledger import chapter_of
from paper_figures.thesis.report.typeset import typeset


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copied_build(tmp_path_factory)


@pytest.fixture(scope="module")
def inputs(build: Path) -> Inputs:
    return read(build)


def read(build: Path) -> Inputs:
    figures = {name: figure_module(name).TABLES for name in FIGURES}
    designs = {"delay_free": REFUSAL, "extended": read_design(build / "design_extended.json"), "robust": REFUSAL}
    outcomes = {"f_gamma": pd.read_csv(build / "results" / "f_gamma_summary.csv", comment="#")}
    return read_inputs(str(build / "model.json"), SWEEPS, build, figures, designs, outcomes)


@pytest.fixture(scope="module")
def content(inputs: Inputs) -> Content:
    return report_content(inputs)


@pytest.fixture(scope="module")
def html(content: Content) -> str:
    return report_html(content)


@pytest.fixture(scope="module")
def page(html: str) -> Page:
    return Page(html)


def words(text: str) -> str:
    return " ".join(text.split())


def test_every_row_of_the_ledger_once_and_whole(page: Page, inputs: Inputs) -> None:
    assert [row["id"] for row in page.rows] == list(inputs.ledger["id"])
    for row, claim in zip(page.rows, inputs.ledger.to_dict("records"), strict=True):
        for column in ("where", "quote", "printed", "unit", "kind", "touches", "reason", "evidence"):
            assert row.get(column, "") == claim[column]
        assert row["verdict"] == claim["verdict"].replace("_", " ")
        for column, error in (("computed", 1e-6), ("tolerance", 0.05)):
            if claim["printed"] == "true":
                assert column == "computed" or column not in row
            elif claim[column] == "":
                assert column not in row
            else:
                assert float(row[column]) == pytest.approx(float(claim[column]), rel=error)


def test_a_statement_holds_or_does_not(inputs: Inputs) -> None:
    claims = inputs.ledger.iloc[:2].assign(printed="true", computed=["1", "0"], verdict=["agrees", "differs"])
    shown = Page(report_html(report_content(replace(inputs, ledger=claims, designs={})))).rows
    assert [row["computed"] for row in shown] == ["holds", "does not hold"]


def test_verdicts_are_counted_and_differences_stand_up_front(page: Page, content: Content, inputs: Inputs) -> None:
    counts = inputs.ledger["verdict"].value_counts()
    assert {verdict.name: verdict.count for verdict in content.verdicts} == counts.to_dict()
    differences = [difference for each in content.consequences for difference in each.differences]
    front = [number[0] for difference in differences for number in difference.numbers]
    wanted = inputs.ledger[inputs.ledger["verdict"].isin(["unchecked", "differs", "not_reproducible"])]
    assert sorted(front) == sorted(wanted["id"])
    touched = list(wanted.set_index("id")["touches"][front])
    order = ["conclusion", "outcome", "value", "derivation", "nothing", ""]
    assert touched == sorted(touched, key=order.index)
    assert len(set(touched)) > 2
    before = words(page.text).split("The ledger A number agrees")[0]
    for difference in differences:
        assert words(difference.reason) in before
        assert all(test in before for test in difference.evidence)


def test_every_figure_once_with_its_very_picture(page: Page, build: Path, inputs: Inputs) -> None:
    assert [name for name in page.ids if name.startswith("fig_")] == FIGURES
    drawn = FIGURES[:-1]
    assert len(page.pictures) == len(drawn)
    for name, picture in zip(drawn, page.pictures, strict=True):
        assert picture["data-picture"] == name
        assert gzip.decompress(b64decode(dict(page.svgs)[name])) == (build / "figures" / f"{name}.svg").read_bytes()
        caption = (build / "figures" / f"{name}.txt").read_text(encoding="utf-8").strip()
        assert words(caption) in words(page.text)
        label = f"Fig. {figure_label(name)}: "
        assert (picture["alt"] or "").startswith(label)
        assert caption.startswith((picture["alt"] or "").removeprefix(label))


def test_tables_are_embedded_once_byte_for_byte(page: Page, build: Path) -> None:
    assert [name for name, _ in page.tables] == ["f_gamma", "f_gamma_summary", "claims"]
    for name, code in page.tables:
        path = build / ("" if name == "claims" else "results") / f"{name}.csv"
        assert gzip.decompress(b64decode(code)) == path.read_bytes()
    assert gzip.decompress(b64decode(dict(page.tables)["f_gamma_summary"])).startswith(BREAKING_OUT.encode())


def test_a_long_table_over_time_keeps_its_envelope() -> None:
    random = np.random.default_rng(1)
    time = np.arange(20_000) * 0.001
    table = pd.DataFrame({"time_s": time, "output_none": random.normal(size=len(time)), "control_none": np.nan})
    table.loc[:9_999, "control_none"] = np.where(time[:10_000] < 3, 12.96, -12.96)
    text = table.to_csv(index=False)
    held = embedded({"extended": text, "short": text[:1000]})
    assert held["short"].text == text[:1000]
    assert "every 6 rows, rounded to 5 digits" in held["extended"].text.splitlines()[0]
    short = pd.read_csv(StringIO(held["extended"].text), comment="#")
    assert short["time_s"].is_monotonic_increasing
    for column in ("output_none", "control_none"):
        blocks = table[column].groupby(np.arange(len(table)) // 6)
        pairs = short[column].groupby(np.arange(len(short)) // 2)
        for end in ("min", "max"):
            expected, found = getattr(blocks, end)(), getattr(pairs, end)()
            np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_every_quote_of_the_thesis_is_typeset() -> None:
    """No command of LaTeX is left in what is shown, and what is no formula stays as it is."""
    for quote in set(read_ledger()["quote"]):
        shown = Page(typeset(quote)).text
        assert not re.search(r"[\\$]|[_^]\{", shown), quote
        assert ("<math" in typeset(quote)) == bool(re.search(r"[\\$^]", quote)), quote
        assert re.sub(r"\W", "", quote) == re.sub(r"\W", "", shown) or "<math" in typeset(quote)


@pytest.mark.parametrize("quote", [r"\unheardof{x}", r"\frac{1", r"\text{<b>x</b>}"])
def test_what_cannot_be_typeset_stays_readable(quote: str) -> None:
    assert typeset(quote) == f"<code>{escape(quote)}</code>"


def test_the_page_links_to_every_table_of_every_figure(html: str) -> None:
    for name in FIGURES[:-1]:
        figure = html.split(f'id="{name}"')[1].split("</figure>")[0]
        tables = re.findall('data-table="(.*?)"', figure)
        assert tuple(tables) == figure_module(name).TABLES
        assert ("A block diagram: no data." in figure) == (not tables)
        assert all(f'download="{table}.csv"' in figure for table in tables)


def test_text_is_escaped(inputs: Inputs, html: str, page: Page) -> None:
    assert "<i>a</i>" not in html
    assert "<i>a</i> < b & \\frac{1}{2}" in page.text
    nasty = "<img src=x onerror=alert(1)> & \"quoted\" 'too' {{ 7 * 7 }}. Second"
    figures = {name: replace(inputs.figures[name], caption=nasty) for name in FIGURES[:1]}
    content = report_content(replace(inputs, figures=figures, designs={"delay_free": nasty}))
    text = report_html(content)
    shown = Page(text)
    assert "<img src=x" not in text
    assert len(shown.pictures) == 1
    assert shown.pictures[0]["alt"] == f"Fig. 2.1: {nasty.removesuffix(' Second')}"
    assert shown.text.count(nasty) == 2


def test_nothing_is_fetched_from_anywhere(html: str) -> None:
    assert "default-src 'none'" in html
    assert not re.findall(r'(?:src|href|action)="(?!#|data:)[^"]*"', html)
    assert "@import" not in html
    assert "url(" not in html
    assert "://" not in html


def test_two_runs_in_other_folders_write_the_same_bytes(build: Path, tmp_path: Path) -> None:
    pages = []
    for name in ("one", "another"):
        copy = shutil.copytree(build, tmp_path / name / "build")
        result = report(copy, *SWEEPS)
        assert result.exit_code == 0, result.output
        assert "4 figures -> " in result.output
        pages.append((copy / "report" / "index.html").read_bytes())
    assert pages[0] == pages[1]
    assert str(tmp_path).encode() not in pages[0]
    assert sorted(path.name for path in (tmp_path / "one" / "build" / "report").iterdir()) == ["index.html"]


def test_hashes_are_those_of_the_files(content: Content, build: Path) -> None:
    files = {path.name: path for path in SWEEPS}
    files |= {name: ROOT / name for name in ("data/thesis/thesis.toml", "data/thesis/claims.csv", "requirements.lock")}
    names = ("model.json", "design_extended.json", "results/f_gamma.csv", "results/f_gamma_summary.csv", "claims.csv")
    files |= {name: build / name for name in names}
    assert dict(content.hashes) == {
        name: sha256(path.read_bytes()).hexdigest()
        for name, path in files.items()
    }  # fmt: skip
    assert len(content.hashes) == len(files)


def test_versions_are_given(page: Page, content: Content) -> None:
    versions = dict(content.versions)
    needed = {"Python", "antiwindup-thesis", "numpy", "scipy", "control", "slycot", "numba", "pandas", "matplotlib"}
    assert needed | {"sippy-unipi"} <= versions.keys()
    assert all(re.match(r"\d+\.\d+", version) for version in versions.values())


def test_refusals_are_shown(page: Page, content: Content) -> None:
    assert f"Fig. 2.12 is not drawn. Refused: {REFUSAL}." in words(page.text)
    assert [design.title for design in content.designs if design.refused] == ["Chapter 2", "Robust redesign"]
    assert words(page.text).count(REFUSAL) == 3


def test_synthetic_sweeps_are_called_so(content: Content, html: str, inputs: Inputs) -> None:
    assert html.count("SYNTHETIC DATA: 1 of 1 tests were never measured") == 3  # at the head, the fit, the designs
    assert [figure.label for figure in content.figures if figure.synthetic] == ["2.10", "2.11"]
    measured = [replace(test, synthetic=False) for test in inputs.tests]
    other = report_content(replace(inputs, tests=measured, designs={}))
    assert not other.synthetic
    assert not any(figure.synthetic for figure in other.figures)


def test_the_fit_has_its_intervals_and_the_design_its_audit(page: Page, content: Content, inputs: Inputs) -> None:
    assert "95 % interval" in content.parameters.head
    assert content.parameters.rows[0][0] == "gain K"
    assert {"Tests", "Structure", "Intervals", "Residuals", "Bound"} <= {head for head, _ in content.basis}
    assert all(words(text) in words(page.text) for _, text in content.basis)
    audit = next(design.audit for design in content.designs if design.audit)
    assert audit.startswith("extended design, reference at 1.5 rad/s")
    assert audit in page.text
    design = inputs.designs["extended"]
    assert isinstance(design, Design)
    table = next(part.coefficients for part in content.designs if part.coefficients)
    rows = {name: (float(gain), *(literal_eval(cell) for cell in roots)) for name, gain, *roots in table.rows}
    block = design.blocks["K"]
    assert rows["K"] == (block.gain, list(block.zeros), list(block.poles), block.delay_s)
    assert rows["theta1_tilde, corrected"][0] == design.compensator("corrected").theta1_tilde.gain


@pytest.mark.parametrize("model", ["implied", "table"])
def test_a_printed_set_is_said_not_to_be_fitted(inputs: Inputs, model: str) -> None:
    given = replace(inputs, model_name=model, model=model_named(model), designs={})
    page = Page(report_html(report_content(given)))
    assert "Not fitted here" in page.text
    assert "95 % interval" not in page.text
    assert "gain K" in page.text
    assert "SYNTHETIC DATA" in page.text  # the sweeps still stand beside it


def test_a_model_fitted_to_other_sweeps_is_said_so(inputs: Inputs) -> None:
    content = report_content(replace(inputs, tests=(), designs={}))
    assert not content.fitted
    assert "model.json, which was not fitted here" in content.basis[0][1]


def without_evidence(build: Path) -> None:
    path = build / "claims.csv"
    pd.read_csv(path, dtype=str).drop(columns="evidence").to_csv(path, index=False)


def with_a_row_twice(build: Path) -> None:
    path = build / "claims.csv"
    path.write_text(path.read_text() + path.read_text().splitlines()[-1] + "\n")


def with_a_word_for_a_number(build: Path) -> None:
    path = build / "claims.csv"
    pd.read_csv(path, dtype=str).assign(computed="many").to_csv(path, index=False)


def touching_something_else(build: Path) -> None:
    path = build / "claims.csv"
    pd.read_csv(path, dtype=str).assign(touches="the weather").to_csv(path, index=False)


def with_another_verdict(build: Path) -> None:
    path = build / "claims.csv"
    pd.read_csv(path, dtype=str).assign(verdict="weird").to_csv(path, index=False)


def for_another_plant(build: Path) -> None:
    path = build / "design_extended.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    content["plant"]["gain"] *= 2
    path.write_text(json.dumps(content), encoding="utf-8")


def linked_to_the_ledger(build: Path) -> None:
    (build / "report").mkdir()
    (build / "report" / "index.html").symlink_to(build / "claims.csv")


def removing(name: str) -> Callable[[Path], None]:
    return lambda build: (build / name).unlink()


def changed(name: str) -> Callable[[Path], None]:
    def change(build: Path) -> None:
        path = build / name
        write_manifest(build, {name: Written("", content_of(path))})
        path.write_bytes(path.read_bytes() + b"\n")

    return change


@pytest.mark.parametrize(
    ("spoil", "parts"),
    [
        (removing("claims.csv"), ["claims.csv: no such file"]),
        (without_evidence, ["claims.csv: no column evidence"]),
        (with_a_word_for_a_number, ["claims.csv: 'many' in the column computed"]),
        (with_a_row_twice, ["claims.csv: the id ", "several rows"]),
        (lambda build: (build / "claims.csv").write_text(",".join(LEDGER)), ["claims.csv: holds a header and no rows"]),
        (lambda build: (build / "claims.csv").write_text(""), ["claims.csv: is not a table"]),
        (lambda build: (build / "claims.csv").write_bytes(b"\xff"), ["claims.csv: byte 0 is not UTF-8"]),
        (removing("model.json"), ["model.json: no such file"]),
        (removing("design_extended.json"), ["design_extended.json: no such file", "refused"]),
        (removing("figures/fig_2_10.svg"), ["fig_2_10.svg: no such file", "draw fig_2_10"]),
        (removing("figures/fig_2_01.txt"), ["fig_2_01.txt: no such file"]),
        (removing("results/f_gamma.csv"), ["f_gamma.csv: no such file"]),
        (with_another_verdict, ["the ledger has the verdict weird; expected agrees"]),
        (touching_something_else, ["the ledger has the weather in the column touches; expected conclusion"]),
        (for_another_plant, ["design_extended.json: is for a plant of gain", "expected one for the model"]),
        (
            lambda build: shutil.copy(build / "design_extended.json", build / "design_delay_free.json"),
            ["design_delay_free.json: kind is 'extended'; expected 'delay-free'"],
        ),
        (lambda build: (build / "figures" / "fig_2_10.svg").write_text("<html>"), ["fig_2_10.svg: no SVG picture"]),
        (
            lambda build: (build / "results" / "f_gamma.csv").write_text("alpha\n"),
            ["f_gamma.csv: holds a header and no rows"],
        ),
        (linked_to_the_ledger, ["index.html: is an input too"]),
        (removing("design_delay_free.refused.txt"), ["design_delay_free.json: no such file"]),
        (lambda build: (build / "report").write_text(""), ["report: cannot be made"]),
        (changed("design_extended.json"), ["design_extended.json: was changed since it was written", "manifest.json"]),
        (changed("results/f_gamma.csv"), ["f_gamma.csv: was changed since it was written"]),
        (changed("figures/fig_2_01.svg"), ["fig_2_01.svg: was changed since it was written"]),
        (changed("claims.csv"), ["claims.csv: was changed since it was written"]),
    ],
)
def test_what_is_missing_is_refused_and_nothing_written(
    build: Path, tmp_path: Path, spoil: Callable[[Path], object], parts: list[str]
) -> None:
    copy = shutil.copytree(build, tmp_path / "build")
    spoil(copy)
    before = sorted(copy.rglob("*"))
    result = report(copy, *SWEEPS)
    assert result.exit_code == 2
    assert result.output.startswith("Error: ")
    assert result.output.count("\n") == 1
    assert all(part in result.output for part in parts), result.output
    assert sorted(copy.rglob("*")) == before


def test_a_missing_sweep_is_refused(build: Path) -> None:
    result = report(build, SWEEPS[0].with_name("nowhere.csv"))
    assert result.exit_code == 2
    assert "nowhere.csv: no such file" in result.output


def test_an_experiment_that_was_refused_takes_its_figure_with_it(build: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(build, tmp_path / "build")
    for path in [*copy.glob("results/f_gamma*"), *copy.glob("figures/fig_2_1[01].*")]:
        path.unlink()
    (copy / "results" / "f_gamma.refused.txt").write_text(f"{copy}/model.json: no good.\n")
    result = report(copy, *SWEEPS)
    assert result.exit_code == 0, result.output
    text = words(Page((copy / "report" / "index.html").read_text(encoding="utf-8")).text)
    assert "Fig. 2.10 is not drawn. Refused: model.json: no good." in text
    assert "Fig. 2.11 is not drawn. Refused: model.json: no good." in text
    assert str(copy) not in text


def test_names_become_labels() -> None:
    assert [figure_label(name) for name in ("fig_2_09", "fig_3_01", "fig_a_01")] == ["2.9", "3.1", "A.1"]
    labels = [figure_label(name) for name in figure_names()]
    assert labels[:3] == ["2.1", "2.2", "2.3"]
    assert labels[20:22] == ["A.1", "A.2"]
    assert len(set(labels)) == len(labels)


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("One thing. Another.", "One thing."),
        ("See Fig. A.1 of it (thesis Fig. 2.9). Then more.", "See Fig. A.1 of it (thesis Fig. 2.9)."),
        ("By Eq. (2.23) and Eq. B, 1.5 m. theta is small. It ends", "By Eq. (2.23) and Eq. B, 1.5 m. theta is small."),
        ("", ""),
    ],
)
def test_the_first_sentence_ends_at_a_full_stop(text: str, first: str) -> None:
    assert first_sentence(text) == first


@pytest.mark.parametrize(
    ("where", "chapter"),
    [("section 2.4, Fig. 2.11", "2"), ("Eq. (4.8)", "4"), ("Table 10.1", "10"), ("chapter 5", "5"), ("abstract", "")],
)
def test_the_chapter_of_a_place(where: str, chapter: str) -> None:
    assert chapter_of(where) == chapter


def test_every_table_of_a_figure_belongs_to_an_experiment() -> None:
    assert experiment_of("extended") == experiment_of("extended_summary") == "extended"
    assert experiment_of("limits_extended_summary") == "limits_extended"
    tables = {table for name in figure_names() for table in figure_module(name).TABLES}
    free = {table for table in tables if not experiment_of(table)}
    assert {table.removesuffix("_summary") for table in free} <= {"pid", "additive_error", "conditions"}


@pytest.mark.parametrize(
    ("text", "size"),
    [("", "0 bytes"), ("\u00e9", "2 bytes"), ("x" * 1400, "1.4 kB"), ("x" * 73800, "74 kB"), ("x" * 6483314, "6.5 MB")],
)
def test_sizes_are_in_words(text: str, size: str) -> None:
    assert file_size(text) == size
