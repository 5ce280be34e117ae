"""The one page on a plant in words and numbers: fit, tests, bound, designs, and what was refused and why."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from design.design_file import Design
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel
from identification.sweeps.response import FrequencyResponse
from paper_figures.summary import of_designs, of_fit
from paper_figures.summary.of_designs import DESIGNS, FIGURES, FOLLOWING
from paper_figures.summary.of_fit import Paragraph, Table, fitted

WIDTH = 112  # of the text, in characters


@dataclass(frozen=True)
class Summary:
    """The page in words.

    Parameters
    ----------
    title
        The plant's structure.
    synthetic
        What to say if there are tests that nobody measured, else nothing.
    parameters
        Estimates with their intervals and standard errors.
    basis
        What the numbers rest on.
    loops
        What the simulated loops did, if any was simulated.
    designs
        What each design gives, or the sentence with which it, or an experiment that follows it, was refused.
    refused
        Those of them that are refusals.
    """

    title: str
    synthetic: str
    parameters: Table
    basis: tuple[Paragraph, ...]
    loops: Table | None
    designs: tuple[Paragraph, ...]
    refused: tuple[Paragraph, ...]

    def text(self) -> str:
        """The page as plain text."""
        parts = [self.title, self.synthetic, _aligned(self.parameters), *map(_filled, self.basis)]
        parts += [_aligned(self.loops) if self.loops else "", *map(_filled, self.designs)]
        return "\n\n".join(part for part in parts if part)


def summarise(
    model: IdentifiedModel,
    tests: Sequence[FrequencyResponse],
    designs: Mapping[str, Design | str],
    outcomes: Mapping[str, pd.DataFrame | str],
) -> Summary:
    """Put into words what became of a plant.

    Parameters
    ----------
    model
        As ``python -m identification fit`` wrote it.
    tests
        What it was fitted to.
    designs
        ``delay_free`` and ``extended``: the design, or the sentence that refused it; left out if nobody tried.
    outcomes
        The same of the experiments ``delay_free``, ``extended`` and ``f_gamma``: their tables NAME_summary.

    Raises
    ------
    InputError
        The model does not say how it was fitted, or was fitted to other tests.
    """
    fit = fitted(model)
    names = [test.name for test in fit.tests]
    if names != [test.name for test in tests]:
        raise InputError(f"the model was fitted to {', '.join(names) or 'nothing'}; expected these sweeps")
    synthetic = sum(test.synthetic for test in tests)
    made = {name: design for name, design in designs.items() if isinstance(design, Design)}
    tables = {name: table for name, table in outcomes.items() if isinstance(table, pd.DataFrame)}
    given = [(DESIGNS[name], of_designs.sentences(made[name], name, tables)) for name in made]
    refused = tuple(_refused(designs, outcomes))
    return Summary(
        title=f"Plant with {fit.structure}",
        synthetic=f"SYNTHETIC DATA: {synthetic} of {len(tests)} tests were never measured" if synthetic else "",
        parameters=of_fit.parameter_table(model),
        basis=of_fit.paragraphs(model, tests),
        loops=of_designs.loop_table(made, tables),
        designs=tuple(sorted((*given, *refused))),
        refused=refused,
    )


def _refused(designs: Mapping[str, Design | str], outcomes: Mapping[str, pd.DataFrame | str]) -> Iterator[Paragraph]:
    """What was refused, the sentence with which it was, and the figures that are not drawn for it."""
    text = "Refused: {}. Not drawn: Fig. {}."
    for name, said in designs.items():
        if isinstance(said, str):
            yield DESIGNS[name], text.format(said, ", ".join(FIGURES[experiment] for experiment in FOLLOWING[name]))
        for experiment in FOLLOWING[name]:
            outcome = outcomes.get(experiment)
            if isinstance(outcome, str):
                yield DESIGNS[name], text.format(outcome, FIGURES[experiment])


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
