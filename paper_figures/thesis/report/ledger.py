"""What the report says of the ledger: how many rows have each verdict, what differs and why, and every row."""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass

import pandas as pd

from experiments.thesis.claims.printed_number import read_number
from identification.base.errors import InputError
from paper_figures.look.captions import number
from paper_figures.look.style import LINES
from paper_figures.thesis.report.inputs import LEDGER

VERDICTS = {
    "agrees": (
        "corrected anti-windup",
        "computed again to half a unit of the last printed digit, or a statement that holds",
    ),
    "differs": ("without anti-windup", "something else comes out, or the statement does not hold"),
    "not_reproducible": ("bound", "the thesis does not print what it depends on"),
    "unchecked": ("second-order Pade", "nothing here computes it"),
    "input": ("family 1", "chosen or measured by the thesis: transcribed, not reproduced"),
}
"""The verdicts that are known: the line of the figures whose colour each has, and what it means."""

DIFFERING = ("unchecked", "differs", "not_reproducible")
"""The verdicts that stand up front with their reasons."""

STATEMENT = "true"
"""What a statement is printed as; it has no digits, and so no tolerance."""


@dataclass(frozen=True)
class Verdict:
    """A verdict, how many rows of the ledger have it, its meaning and its colour."""

    name: str
    count: int
    meaning: str
    colour: str


@dataclass(frozen=True)
class Difference:
    """Printed numbers that one reason keeps from agreeing: each as id, place, printed, computed and unit."""

    verdict: str
    reason: str
    numbers: tuple[tuple[str, str, str, str, str], ...]
    quotes: tuple[str, ...]
    evidence: tuple[str, ...]


@dataclass(frozen=True)
class Cell:
    """A cell of the ledger: its column, its text, and the number it is sorted by, if any."""

    column: str
    text: str
    value: str = ""


@dataclass(frozen=True)
class Row:
    """A row of the ledger."""

    cells: tuple[Cell, ...]
    verdict: str
    kind: str
    chapter: str


def chapter_of(where: str) -> str:
    """The chapter of a place in the thesis, ``Table 2.1`` -> ``2``; empty if the place has none."""
    found = re.search(r"\d+", where)
    return found.group() if found else ""


def colour(verdict: str) -> str:
    """The colour of one of :data:`VERDICTS`."""
    return str(LINES[VERDICTS[verdict][0]]["color"])


def verdicts(ledger: pd.DataFrame) -> Iterator[Verdict]:
    """Each verdict of the ledger with its count.

    Raises
    ------
    InputError
        A verdict is not one of :data:`VERDICTS`.
    """
    counts = ledger["verdict"].value_counts()
    if unknown := set(counts.index) - set(VERDICTS):
        raise InputError(f"the ledger has the verdict {', '.join(sorted(unknown))}; expected {', '.join(VERDICTS)}")
    for name, (_, meaning) in VERDICTS.items():
        if name in counts:
            yield Verdict(name, int(counts[name]), meaning, colour(name))


def differences(ledger: pd.DataFrame) -> Iterator[Difference]:
    """What does not agree, one for each reason, in the order of the ledger."""
    for verdict in DIFFERING:
        for reason, claims in ledger[ledger["verdict"] == verdict].groupby("reason", sort=False):
            numbers = claims.assign(computed=[_computed(claim) for claim in claims.to_dict("records")])
            yield Difference(
                verdict,
                str(reason),
                tuple(numbers[["id", "where", "printed", "computed", "unit"]].itertuples(index=False, name=None)),
                tuple(dict.fromkeys(claims["quote"])),
                tuple(dict.fromkeys(" ".join(claims["evidence"]).split())),
            )


def row(claim: Mapping[Hashable, str]) -> Row:
    """A row of the ledger as it is shown."""
    shown = {**claim, "computed": _computed(claim), "tolerance": _rounded(claim["tolerance"], 2)}
    if claim["printed"] == STATEMENT:
        shown["tolerance"] = ""
    values = {"printed": _value(claim["printed"]), "computed": claim["computed"], "tolerance": claim["tolerance"]}
    cells = tuple(Cell(column, shown[column], values.get(column, "")) for column in LEDGER)
    return Row(cells, claim["verdict"], claim["kind"], chapter_of(claim["where"]))


def _value(printed: str) -> str:
    try:
        return f"{read_number(printed).value:.12g}"
    except InputError:  # words that are no number are sorted as words
        return ""


def _computed(claim: Mapping[Hashable, str]) -> str:
    """The computed value to seven digits; of a statement, which is printed as true, whether it holds."""
    computed = _rounded(claim["computed"])
    return {"1": "holds", "0": "does not hold"}.get(computed, computed) if claim["printed"] == STATEMENT else computed


def _rounded(text: str, digits: int = 7) -> str:
    return number(float(text), digits) if text else ""
