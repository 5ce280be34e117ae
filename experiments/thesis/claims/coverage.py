"""Which numbers of a text the ledger quotes, which are named exceptions, and which are left."""

from __future__ import annotations

import hashlib
import re
from bisect import bisect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from data.thesis import THESIS
from experiments.tables import read_cells
from experiments.thesis.claims.printed_number import patterns
from identification.base.errors import InputError, shown
from identification.base.json_object import read_object

EXCEPTIONS = THESIS / "exceptions.csv"
RECORD = THESIS / "coverage.json"
EXCEPTION_COLUMNS = ("name", "scope", "pattern", "why")
RECORDED = ("text_sha256", "ledger_sha256", "numbers", "statuses")
SCOPES = ("text", "formula")
LEFT, QUOTED = "left", "quoted"
CONTEXT = 30  # characters on either side of a number

NUMBER = re.compile(r"\d+(?:\.\d+)*")
FORMULA = re.compile(r"\$\$.*?\$\$|\$(?:(?!\n\s*\n)[^$])*\$", re.DOTALL)  # a formula ends with its paragraph


def read_exceptions(path: Path = EXCEPTIONS) -> pd.DataFrame:
    """Read exceptions.csv: kinds of numbers that are no claims.

    Returns
    -------
    DataFrame
        ``name``, ``scope`` (``formula``: inside $...$ only, ``text``: anywhere), ``pattern`` (a regular expression in
        which a blank stands for any white space; ^ is the beginning of a line) and ``why`` such a number needs no row.

    Raises
    ------
    InputError
        The file is no such table, has another scope, a pattern that is none, or a name with another meaning.
    """
    exceptions = read_cells(path, EXCEPTION_COLUMNS)
    for line, (name, scope, pattern, _) in enumerate(exceptions.itertuples(index=False, name=None), start=2):
        if name in (LEFT, QUOTED):
            raise InputError(f"{path}, line {line}: an exception is named {name}; expected another name")
        if scope not in SCOPES:
            raise InputError(f"{path}, line {line}: scope is {shown(scope)}; expected {' or '.join(SCOPES)}")
        try:
            re.compile(pattern)
        except re.error as error:
            raise InputError(f"{path}, line {line}: {shown(pattern)} is not a regular expression ({error})") from None
    return exceptions


def coverage(text: str, ledger: pd.DataFrame, exceptions: pd.DataFrame) -> pd.DataFrame:
    """Say of every number in a text which row quotes it.

    Parameters
    ----------
    text
        As extracted from the document, formulas between $ signs as LaTeX.
    ledger
        With at least ``id``, ``quote`` and ``printed``.
    exceptions
        As :func:`read_exceptions` returns it.

    Returns
    -------
    DataFrame
        One row for each run of digits, with its decimal points, in the order of the text: ``line`` (from 1),
        ``number``, ``context`` and ``status``: ``quoted`` where it is the printed number of a row inside an
        occurrence of that row's quote, the name of the first exception that covers it, or ``left``. A row's number
        counts wherever its quote stands in the text, white space apart.
    """
    status: dict[int, str] = {}
    for name, start, end in _exceptional(text, exceptions):
        for place in range(start, end):
            status.setdefault(place, name)
    for quote, rows in ledger.groupby("quote", sort=False):
        printed = [pattern for number in rows["printed"] for pattern in patterns(str(number))]
        for found in re.finditer(_blank_tolerant(re.escape(str(quote))), text):
            for pattern in printed:
                for number in re.finditer(pattern, found[0]):
                    status |= dict.fromkeys(range(found.start() + number.start(), found.start() + number.end()), QUOTED)
    numbers = list(NUMBER.finditer(text))
    line_ends = [end.start() for end in re.finditer("\n", text)]
    return pd.DataFrame(
        {
            "line": [bisect(line_ends, number.start()) + 1 for number in numbers],
            "number": [number[0] for number in numbers],
            "context": [
                " ".join(text[max(0, number.start() - CONTEXT) : number.end() + CONTEXT].split()) for number in numbers
            ],
            "status": [status.get(number.start(), LEFT) for number in numbers],
        }
    )


def coverage_record(text: str, covered: pd.DataFrame, ledger: pd.DataFrame, exceptions: pd.DataFrame) -> dict[str, Any]:
    """What is kept of a count, since the text itself is not shipped: data/thesis/coverage.json.

    Parameters
    ----------
    text, covered, ledger, exceptions
        What :func:`coverage` was given and returned.

    Returns
    -------
    dict
        ``text_sha256``, ``ledger_sha256`` (see :func:`quotes_sha256`), ``numbers`` and ``statuses``, status -> count.
    """
    return {
        "text_sha256": hashlib.sha256(text.encode()).hexdigest(),
        "ledger_sha256": quotes_sha256(ledger, exceptions),
        "numbers": len(covered),
        "statuses": {str(name): int(count) for name, count in covered["status"].value_counts().sort_index().items()},
    }


def quotes_sha256(ledger: pd.DataFrame, exceptions: pd.DataFrame) -> str:
    """Tells a ledger's quotes and printed numbers, and the exceptions, from others: a count holds for these only."""
    content = ledger[["quote", "printed"]].to_csv(index=False) + exceptions[["scope", "pattern"]].to_csv(index=False)
    return hashlib.sha256(content.encode()).hexdigest()


def read_record(path: Path = RECORD) -> dict[str, Any]:
    """Read what :func:`coverage_record` counted.

    Raises
    ------
    InputError
        The file is not what that function returns, or see :func:`identification.base.json_object.read_object`.
    """
    content = read_object(path)
    if list(content) != list(RECORDED):
        raise InputError(f"{path}: the members are {', '.join(content) or 'none'}; expected {', '.join(RECORDED)}")
    return content


def quotes_missing_from(text: str, ledger: pd.DataFrame) -> list[str]:
    """The ids of the rows whose quote does not stand in a text."""
    found = {quote: re.search(_blank_tolerant(re.escape(quote)), text) for quote in ledger["quote"].unique()}
    return [row for row, quote in zip(ledger["id"], ledger["quote"], strict=True) if not found[quote]]


def quotes_its_number(quote: str, printed: str) -> bool:
    """Whether a quote holds its row's printed number; ``true`` needs no place in it."""
    return all(re.search(pattern, quote) for pattern in patterns(printed))


def _exceptional(text: str, exceptions: pd.DataFrame) -> Iterator[tuple[str, int, int]]:
    for name, scope, pattern in exceptions[["name", "scope", "pattern"]].itertuples(index=False):
        compiled = re.compile(_blank_tolerant(pattern), re.MULTILINE)
        spans = [(m.start(), m.end()) for m in FORMULA.finditer(text)] if scope == "formula" else [(0, len(text))]
        for start, end in spans:
            for found in compiled.finditer(text, start, end):
                yield name, found.start(), found.end()


def _blank_tolerant(pattern: str) -> str:
    return pattern.replace("\\ ", " ").replace(" ", r"\s+")
