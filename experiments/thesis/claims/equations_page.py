"""data/thesis/equations.csv, the thesis's labels with their functions and tests -> docs/thesis/equations.md."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from data.thesis import THESIS
from experiments.tables import read_cells
from identification.base.errors import InputError

EQUATIONS = THESIS / "equations.csv"
REPOSITORY = THESIS.parent.parent
COLUMNS = ("label", "title", "function", "test", "remark")
FORMS = {
    "label": r"\([2-4]\.\d+\)|(Fig\.|Table) [2-4]\.\d+|(Definition|Theorem) [2-4]\.\d+\.\d+|(Lemma|Remark) \d",
    "title": r"\S.*",
    "function": r"[a-z_]\w*(\.[a-z_]\w*)+:[A-Za-z]\w*(\.[A-Za-z]\w*)?",
    "test": r"tests(/\w+)+\.py::test_\w+",
}
EXAMPLES = {
    "label": "(2.18), Lemma 2 or Fig. 2.6",
    "title": "a few words",
    "function": "module:function or module:Class.method",
    "test": "tests/unit/test_x.py::test_y",
}
CHAPTERS = {
    "2": "Chapter 2: anti-windup with an internal model",
    "3": "Chapter 3: with a dead time, by the Smith predictor",
    "4": "Chapter 4: the case study",
}
HEAD = """# The thesis's equations, each with its function and its test

Every numbered equation, definition, lemma, theorem, remark, table and figure of the thesis, in its order, with the one
function, method or class that is it here and the test that checks it. The functions' docstrings name the labels too.

The page is made from `data/thesis/equations.csv` by
`python -m experiments thesis equations --page docs/thesis/equations.md`.
A test fails when a label is missing, has no function that names it or no test; `benchmarks/equations_study.py` runs
each test by itself and says whether it executed the function. Links are to files: search for the name there. What the
thesis claims beyond its equations is judged in [claims.md](claims.md)."""


def read_equations(path: Path = EQUATIONS) -> pd.DataFrame:
    """Read equations.csv; every cell is text as it stands there.

    Raises
    ------
    InputError
        The file is no such table, see :func:`experiments.tables.read_cells`, a label stands twice, or a cell but the
        remark is empty or not of its form.
    """
    table = read_cells(path, COLUMNS)
    for line, row in enumerate(table.to_dict("records"), start=1):
        for column, form in FORMS.items():
            if not re.fullmatch(form, row[column]):
                raise InputError(
                    f"{path}: {column} of row {line}, {row['label'] or 'without a label'}, is '{row[column]}'; "
                    f"expected {EXAMPLES[column]}"
                )
    twice = table["label"][table["label"].duplicated()]
    if len(twice):
        raise InputError(f"{path}: {twice.iloc[0]} occurs twice; expected every label once")
    return table


def named_object(name: str) -> Any:
    """The function, class or property that MODULE:NAME or MODULE:CLASS.NAME names; of a class method its function.

    Raises
    ------
    InputError
        There is no such module or name.
    """
    module, _, path = name.partition(":")
    try:
        found: Any = importlib.import_module(module)
        for part in path.split("."):
            found = inspect.getattr_static(found, part)
    except (ImportError, AttributeError) as error:
        raise InputError(f"there is no '{name}' ({error})") from None
    return found.__func__ if isinstance(found, classmethod | staticmethod) else found


def equations_page(table: pd.DataFrame) -> str:
    """The page as Markdown, a table a chapter.

    Parameters
    ----------
    table
        As :func:`read_equations` returns it. A lemma or remark, whose number has no chapter, belongs to the chapter of
        the row before it.

    Notes
    -----
    Links lead from docs/thesis to the file of a function or test, without line numbers: every edit would move them.
    """
    chapter = table["label"].str.extract(r"(\d)\.", expand=False).ffill()
    parts = [HEAD]
    for digit, rows in table.groupby(chapter, sort=False):
        parts += [f"## {CHAPTERS[str(digit)]} ({len(rows)})", "\n".join(_lines(rows))]
    return "\n\n".join(parts) + "\n"


def _lines(rows: pd.DataFrame) -> Iterator[str]:
    yield "| label | what it is | function | test | remark |"
    yield "| --- | --- | --- | --- | --- |"
    for label, title, function, test, remark in rows[list(COLUMNS)].itertuples(index=False):
        cells = [label, _text(title), _function_link(function), _test_link(test), _text(remark)]
        yield "| " + " | ".join(cells) + " |"


def _text(cell: str) -> str:
    r"""With what Markdown would take for its own escaped, but for formulas between $ signs (a bar there is \lvert)."""
    return re.sub(r"(\$[^$|]*\$)|([|~*<\[])", lambda found: found[1] or "\\" + found[2], cell)


def _function_link(name: str) -> str:
    module, _, path = name.partition(":")
    file = Path(*module.split("."))
    if (REPOSITORY / file).is_dir():
        file /= "__init__"
    return f"[{module.rpartition('.')[2]}.{path}](../../{file.as_posix()}.py)"


def _test_link(test: str) -> str:
    file, _, name = test.partition("::")
    return f"[{name}](../../{file})"
