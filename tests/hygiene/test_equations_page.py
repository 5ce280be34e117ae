"""docs/thesis/equations.md is what the csv says; every label is there with a function that names it and a test."""

from __future__ import annotations

import ast
import inspect
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from experiments.__main__ import main
from experiments.thesis.claims.equations_page import EQUATIONS, equations_page, named_object, read_equations
from identification.base.errors import InputError

ROOT = Path(__file__).resolve().parents[2]

LABELS = {
    *(f"({chapter}.{k})" for chapter, last in ((2, 23), (3, 31), (4, 9)) for k in range(1, last + 1)),
    *("Definition 2.1.1", "Theorem 2.1.1", "Theorem 2.3.1", "Lemma 1", "Lemma 2", "Remark 1"),
    *("Table 2.1", "Table 4.1", "Table 4.2"),
    *(f"Fig. {chapter}.{k}" for chapter, last in ((2, 14), (3, 2), (4, 4)) for k in range(1, last + 1)),
}


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return read_equations()


def labels_in(text: str) -> set[str]:
    """What a text names: (2.18), Lemma 2, Fig. 2.6; of (2.2)-(2.6) all five."""
    text = " ".join(text.split())
    found = {
        " ".join(name) for name in re.findall(r"(Definition|Theorem|Lemma|Remark|Table|Fig\.) (\d+(?:\.\d+)*)", text)
    }
    for chapter, first, last in re.findall(r"\((\d)\.(\d+)\)(?:-\(\1\.(\d+)\))?", text):
        found |= {f"({chapter}.{k})" for k in range(int(first), int(last or first) + 1)}
    return found


@cache
def said_of(name: str) -> str:
    """Docstring and comments of a function, class or property; of a figure its module's, which is the figure."""
    thing = named_object(name)
    if name.startswith("paper_figures.thesis.figures.fig_"):
        return inspect.getdoc(inspect.getmodule(inspect.unwrap(thing))) or ""
    source = inspect.getsource(thing.fget if isinstance(thing, property) else thing)
    tokens = tokenize.generate_tokens(io.StringIO(inspect.cleandoc("\n" + source)).readline)
    comments = [token.string for token in tokens if token.type == tokenize.COMMENT]
    return "\n".join([inspect.getdoc(thing) or "", *comments])


@cache
def functions_in(file: str) -> tuple[str, set[str]]:
    """The text of a file of tests and the names of its functions; nothing where there is no such file."""
    text = (ROOT / file).read_text(encoding="utf-8") if (ROOT / file).is_file() else ""
    return text, {node.name for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)}


def faults(table: pd.DataFrame) -> Iterator[str]:
    """Everything that is wrong with a table, a sentence each."""
    for label in sorted(LABELS - set(table["label"])):
        yield f"{label} is missing"
    for label in sorted(set(table["label"]) - LABELS):
        yield f"{label} is no label of the thesis"
    for label, function, test in table[["label", "function", "test"]].itertuples(index=False):
        if not function or not test:
            yield f"{label} has no function or no test"
            continue
        module, _, path = function.partition(":")
        try:
            thing = named_object(function)
        except InputError:
            yield f"{label}: there is no {function}"
            continue
        if path.split(".")[-1].startswith("_") or not inspect.getdoc(thing):
            yield f"{label}: {function} is not public or has no docstring"
        if label not in labels_in(said_of(function)):
            yield f"{label}: {function} does not name it"
        file, _, name = test.partition("::")
        text, names = functions_in(file)
        if name not in names:
            yield f"{label}: there is no {test}"
        elif path.split(".")[-1] not in text and module.split(".")[-1] not in text:
            yield f"{label}: {file} names neither {path} nor its module"


def test_the_page_in_the_repository_is_current(table: pd.DataFrame) -> None:
    """After a change of equations.csv: `python -m experiments thesis equations --page docs/thesis/equations.md`."""
    assert (ROOT / "docs" / "thesis" / "equations.md").read_text(encoding="utf-8") == equations_page(table)


def test_every_label_has_its_function_and_its_test(table: pd.DataFrame) -> None:
    assert len(table) == len(LABELS) == 92
    assert list(faults(table)) == []


def test_each_kind_of_label_stands_in_its_order(table: pd.DataFrame) -> None:
    for kind in (r"\(", r"Fig\. ", "Table ", "Lemma ", "Theorem "):
        numbers = table["label"].str.extract(rf"^{kind}([\d.]+)", expand=False).dropna()
        parts = [tuple(int(part) for part in number.split(".")) for number in numbers]
        assert parts == sorted(parts)


def changed(table: pd.DataFrame, row: str, /, **cells: str) -> pd.DataFrame:
    other = table.copy()
    for column, cell in cells.items():
        other.loc[table["label"] == row, column] = cell
    return other


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        ({"function": ""}, "(2.18) has no function or no test"),
        ({"test": ""}, "(2.18) has no function or no test"),
        (
            {"function": "design.anti_windup.compensator:AntiWindup.theta3"},
            "(2.18): there is no design.anti_windup.compensator:AntiWindup.theta3",
        ),
        ({"function": "design.antiwindup:second_order"}, "(2.18): there is no design.antiwindup:second_order"),
        (
            {"function": "design.anti_windup.compensator:second_order"},
            "(2.18): design.anti_windup.compensator:second_order does not name it",
        ),
        (
            {"function": "design.anti_windup.compensator:_require_strictly_proper_and_stable"},
            "(2.18): design.anti_windup.compensator:_require_strictly_proper_and_stable is not public or has no "
            "docstring",
        ),
        ({"test": "tests/unit/test_equations.py::test_x"}, "(2.18): there is no tests/unit/test_equations.py::test_x"),
        ({"test": "tests/unit/test_equation.py::test_x"}, "(2.18): there is no tests/unit/test_equation.py::test_x"),
        (
            {"test": "tests/unit/test_sweep.py::test_shape"},
            "(2.18): there is no tests/unit/test_sweep.py::test_shape",
        ),
        (
            {"test": "tests/unit/test_propagator.py::test_the_queue_is_sorted_and_holds_a_time_once"},
            "(2.18): tests/unit/test_propagator.py names neither AntiWindup.theta2 nor its module",
        ),
        ({"label": "(2.24)"}, "(2.24) is no label of the thesis"),
    ],
)
def test_a_fault_is_found(table: pd.DataFrame, cells: dict[str, str], said: str) -> None:
    assert said in list(faults(changed(table, "(2.18)", **cells)))


@pytest.mark.parametrize("label", ["(2.1)", "(3.27)", "Lemma 2", "Fig. 4.4", "Table 4.2", "Definition 2.1.1"])
def test_a_missing_row_is_found(table: pd.DataFrame, label: str) -> None:
    assert list(faults(table[table["label"] != label])) == [f"{label} is missing"]


@pytest.mark.parametrize(
    ("text", "labels"),
    [
        ("Thesis Eq. (2.2)-(2.4).", {"(2.2)", "(2.3)", "(2.4)"}),
        ("(2.16) and (2.17), (3.1)", {"(2.16)", "(2.17)", "(3.1)"}),
        ("Thesis\n    Lemma\n    2, of Theorem 2.3.1 (Fig. 2.12)", {"Lemma 2", "Theorem 2.3.1", "Fig. 2.12"}),
        ("beta is 2.5, f(2.5), section 2.1", set()),
        ("of Table 4.1 with (s^2 + 2.1)", {"Table 4.1"}),
    ],
)
def test_what_a_text_names(text: str, labels: set[str]) -> None:
    assert labels_in(text) - {"(2.5)"} == labels


def test_only_docstring_and_comments_say_a_label() -> None:
    said = said_of("design.chapters_3_4.design_extended:is_of_thesis_class")
    assert "(2.20)" in labels_in(said)
    assert "(3.16)" not in labels_in(said)  # it stands in a message there
    said = said_of("paper_figures.thesis.figures.fig_2_12:draw")
    assert labels_in(said) == {"Fig. 2.12"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("label,title", "labels,title", "the columns are labels, title"),
        ("(2.18),", "2.18,", "label of row 31, 2.18, is '2.18'; expected (2.18), Lemma 2 or Fig. 2.6"),
        ("(2.18),", "(2.17),", "(2.17) occurs twice"),
        (
            "design.anti_windup.compensator:second_order",
            "second_order",
            "function of row 39, (2.23), is 'second_order'",
        ),
        ("design.anti_windup.compensator:second_order", "", "function of row 39, (2.23), is ''"),
        ("tests/unit/test_plant.py::test_the_printed_form_of_the_bound", "", "test of row 37, (2.22), is ''"),
    ],
)
def test_a_table_of_another_form_is_refused(old: str, new: str, said: str, tmp_path: Path) -> None:
    content = EQUATIONS.read_text(encoding="utf-8")
    assert old in content
    (tmp_path / "equations.csv").write_text(content.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(said)):
        read_equations(tmp_path / "equations.csv")


def test_the_page_is_a_table_a_chapter_and_its_links_lead_to_files(table: pd.DataFrame) -> None:
    page = equations_page(table)
    counts = re.findall(r"^## Chapter (\d): .* \((\d+)\)$", page, flags=re.MULTILINE)
    assert [chapter for chapter, _ in counts] == ["2", "3", "4"]
    assert sum(int(count) for _, count in counts) == len(table)
    lines = [line for line in page.splitlines() if line.startswith("| ")]
    assert all(len(re.findall(r"(?<!\\)\|", line)) == 6 for line in lines)
    links = re.findall(r"\]\((\.\./[^)]*)\)", page)
    assert len(links) == 2 * len(table)
    assert all((ROOT / "docs" / "thesis" / link).is_file() for link in links)


def test_cells_are_escaped(table: pd.DataFrame) -> None:
    page = equations_page(changed(table, "(2.18)", remark="a | b, c~ * d~, `e.f`"))
    assert r"a \| b, c\~ \* d\~, `e.f` |" in page


def test_formulas_are_not_escaped(table: pd.DataFrame) -> None:
    page = equations_page(changed(table, "(2.18)", remark=r"a*, $\lvert [W_1 * S] \rvert < 1$, b*, $c~d$"))
    assert r"| a\*, $\lvert [W_1 * S] \rvert < 1$, b\*, $c~d$ |" in page


def test_command_writes_the_page(tmp_path: Path) -> None:
    page = tmp_path / "equations.md"
    result = CliRunner().invoke(main, ["thesis", "equations", "--page", str(page)])
    assert result.exit_code == 0, result.output
    assert page.read_text(encoding="utf-8") == (ROOT / "docs" / "thesis" / "equations.md").read_text(encoding="utf-8")
    result = CliRunner().invoke(main, ["thesis", "equations", "--page", str(tmp_path / "absent" / "equations.md")])
    assert result.exit_code == 2
