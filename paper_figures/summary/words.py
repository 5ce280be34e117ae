"""The one page on a plant in words and numbers: what to do with it, the fit and what it rests on, runs and refusals."""

from __future__ import annotations

import textwrap
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from math import isnan
from typing import Any

import pandas as pd

from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel
from identification.model.signals import Signals
from identification.sweeps.response import FrequencyResponse
from paper_figures.look.captions import capitalised, number
from paper_figures.summary import of_fit
from paper_figures.summary.advice import FOLLOWS, advice
from paper_figures.summary.build_folder import DESIGNS, Found
from paper_figures.summary.of_fit import Paragraph, Table, fitted

WIDTH = 112  # of the text, in characters


@dataclass(frozen=True)
class Summary:
    """The page in words.

    Parameters
    ----------
    title
        The plant's signals and its structure.
    synthetic
        What to say if there are tests that nobody measured, else nothing.
    advice
        What to do and what not to.
    parameters
        Estimates with their intervals and standard errors.
    basis
        What the numbers rest on.
    runs
        What the run under the reference did without and with anti-windup, if there is one.
    designs
        What was chosen for the designs.
    refused
        The sentences with which designs and tables were refused.
    """

    title: str
    synthetic: str
    advice: tuple[Paragraph, ...]
    parameters: Table
    basis: tuple[Paragraph, ...]
    runs: Table | None
    designs: tuple[Paragraph, ...]
    refused: tuple[Paragraph, ...]

    def text(self) -> str:
        """The page as plain text."""
        parts = [self.title, self.synthetic, *map(_filled, self.advice), _aligned(self.parameters)]
        parts += [*map(_filled, self.basis), _aligned(self.runs) if self.runs else ""]
        parts += map(_filled, (*self.designs, *self.refused))
        return "\n\n".join(part for part in parts if part)


def summarise(model: IdentifiedModel, tests: Sequence[FrequencyResponse], found: Found) -> Summary:
    """Put into words what became of a plant.

    Parameters
    ----------
    model
        As ``python -m identification fit`` wrote it.
    tests
        What it was fitted to.
    found
        What a refit has made for it so far.

    Raises
    ------
    InputError
        The model does not say how it was fitted, or was fitted to other tests.
    """
    fit, signals = fitted(model), model.signals
    names = [test.name for test in fit.tests]
    if names != [test.name for test in tests]:
        raise InputError(f"the model was fitted to {', '.join(names) or 'nothing'}; expected these sweeps")
    synthetic = sum(test.synthetic for test in tests)
    tracking = found.made.get("tracking")
    return Summary(
        title=f"{signals.output_name} over {signals.input_name}: plant with {fit.structure}",
        synthetic=f"SYNTHETIC DATA: {synthetic} of {len(tests)} tests were never measured" if synthetic else "",
        advice=advice(model, found),
        parameters=of_fit.parameter_table(model),
        basis=of_fit.paragraphs(model, tests),
        runs=None if tracking is None else _runs(tracking, signals, found.has_file),
        designs=tuple(_designs(found)),
        refused=tuple(_refused(found)),
    )


def _runs(tracking: pd.DataFrame, signals: Signals, from_file: bool) -> Table:
    """A row for each run under the reference: when it was last at a limit, what it asked for, what error is left."""
    units = (signals.input_unit, signals.output_unit)
    asked, left = (f" [{unit}]" if unit else "" for unit in units)
    head = (
        "run",
        "last at a limit [s]",
        f"largest control{asked}",
        f"error at the end{left}",
        "of half the reference's range [%]" if from_file else "of the amplitude [%]",
    )
    count = len(head) - tracking["relative_error_percent"].isna().all()  # a ramp has no amplitude
    return Table(head[:count], tuple(_run(row)[:count] for row in tracking.to_dict("records")))


def _run(row: dict[Hashable, Any]) -> tuple[str, ...]:
    name = "without anti-windup" if row["run"] == "none" else f"anti-windup {row['run']}"
    last, offset, ripple, percent, largest = (
        float(row[column])
        for column in ("last_saturation_s", "offset", "ripple", "relative_error_percent", "asked_control")
    )
    if isnan(offset):
        return name, "diverges", "", "", ""
    said = "to the end" if isnan(last) else "never" if last == 0 else number(last)
    if row["settled"] == 0:
        return name, said, number(largest), f"not settled within {number(row['until_s'])} s", ""
    return name, said, number(largest), number(abs(offset) + ripple), "" if isnan(percent) else number(percent)


def _designs(found: Found) -> Iterator[Paragraph]:
    design = found.design("design")
    if design is not None:
        anti_windup = f"corrected anti-windup: recovery in {number(design.corrected.judgement.recovery_s)} s"
        yield "Design", f"{'; '.join((*design.free.reasons, anti_windup))}."


def _refused(found: Found) -> Iterator[Paragraph]:
    """What was refused, and the sentence with which it was; what hangs on it is not there either."""
    said = {"the axis": found.axis} if isinstance(found.axis, str) else {}
    said |= {DESIGNS[name]: each for name, each in found.designs.items() if isinstance(each, str)}
    said |= {FOLLOWS[name]: each for name, each in found.tables.items() if isinstance(each, str)}
    for what, sentence in said.items():
        yield "Refused", f"{capitalised(what)}: {sentence}."


def _aligned(table: Table) -> str:
    widths = [max(map(len, column)) for column in zip(table.head, *table.rows, strict=True)]
    lines = (
        "  ".join(
            cell.rjust(width) if i else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in (table.head, *table.rows)
    )
    return "\n".join(line.rstrip() for line in lines)


def _filled(paragraph: Paragraph) -> str:
    return textwrap.fill(": ".join(paragraph), WIDTH, break_long_words=False, break_on_hyphens=False)
