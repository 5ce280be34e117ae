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

CONSEQUENCES = {
    "conclusion": (
        "A conclusion of the thesis",
        "A conclusion does not hold, or nobody can check it: these rows belong to the errata that the errata's first "
        "paragraph names.",
    ),
    "outcome": (
        "An outcome of a run or of a search",
        "Another number comes out, or the number depends on something that the thesis does not print. The conclusions "
        "do not rest on it.",
    ),
    "value": (
        "A printed number of a plant or of a controller",
        "Other pages of the thesis contradict the number, or it is a misprint or rounding noise. The errata say what "
        "follows.",
    ),
    "derivation": (
        "A step of a derivation",
        "A premise, a formula or a reason is not right as printed. The errata say for each what still stands.",
    ),
    "nothing": ("Nothing", "No result of the thesis uses it: a year of the literature, a block that is 1."),
    "": ("Not yet judged", "The ledger does not say what these rows touch."),
}
"""What a row that does not agree touches, the gravest first: the ledger's word, its heading and its meaning."""

DIFFERING = ("differs", "not_reproducible", "unchecked")
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
class Consequence:
    """One of :data:`CONSEQUENCES` and what touches it; ``count`` is the number of rows."""

    name: str
    title: str
    meaning: str
    count: int
    differences: tuple[Difference, ...]


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
    touches: str
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


def consequences(ledger: pd.DataFrame) -> Iterator[Consequence]:
    """What does not agree by what it touches, the gravest first; within that one for each reason, as in the ledger.

    Raises
    ------
    InputError
        The column ``touches`` holds a word that is not one of :data:`CONSEQUENCES`.
    """
    if unknown := set(ledger["touches"]) - set(CONSEQUENCES):
        expected = ", ".join(filter(None, CONSEQUENCES))
        raise InputError(f"the ledger has {', '.join(sorted(unknown))} in the column touches; expected {expected}")
    differing = ledger[ledger["verdict"].isin(DIFFERING)]
    for name, (title, meaning) in CONSEQUENCES.items():
        rows = differing[differing["touches"] == name]
        if len(rows):
            yield Consequence(name, title, meaning, len(rows), tuple(_differences(rows)))


def _differences(rows: pd.DataFrame) -> Iterator[Difference]:
    for (verdict, reason), claims in rows.groupby(["verdict", "reason"], sort=False):
        numbers = claims.assign(computed=[_computed(claim) for claim in claims.to_dict("records")])
        yield Difference(
            str(verdict),
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
    return Row(cells, claim["verdict"], claim["touches"], claim["kind"], chapter_of(claim["where"]))


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
