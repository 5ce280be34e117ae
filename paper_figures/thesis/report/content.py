"""What the report says: the ledger's part, the figures, the fit, the designs, versions and hashes."""

from __future__ import annotations

import platform
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

import pandas as pd

from design.auditing.as_text import audit_text
from design.auditing.audit_design import audit
from design.design_file import Design
from identification.base.errors import InputError, printable
from identification.model.plant import PlantModel
from identification.output.fit_facts import bound_text
from paper_figures.look.captions import number
from paper_figures.summary.of_fit import Paragraph, Table, cautions, paragraphs, parameter_table, plant_table
from paper_figures.thesis.report.coefficients import coefficient_table
from paper_figures.thesis.report.embedded import Embedded, embedded, packed
from paper_figures.thesis.report.inputs import Inputs, Picture, experiment_of
from paper_figures.thesis.report.ledger import Consequence, Row, Verdict, consequences, row, verdicts
from paper_figures.thesis.report.of_designs import DESIGNS, FOLLOWING, loop_table, sentences

PACKAGES = (
    *("antiwindup-thesis", "numpy", "scipy", "control", "slycot", "numba", "pandas", "matplotlib", "sippy-unipi"),
    *("dask", "pyarrow", "jinja2", "latex2mathml"),
)
"""The distributions whose versions are given."""


@dataclass(frozen=True)
class Figure:
    """A figure: its picture packed, with its width and height in points; or ``refused`` says why there is none."""

    name: str
    label: str
    caption: str
    alt: str
    picture: str
    size: tuple[str, str]
    tables: tuple[str, ...]
    synthetic: bool
    refused: str


@dataclass(frozen=True)
class DesignPart:
    """A design in words with its audit and its transfer functions, and the sentences of what was refused of it."""

    name: str
    title: str
    said: str
    audit: str
    coefficients: Table | None
    refused: tuple[str, ...]


@dataclass(frozen=True)
class Content:
    """All that the page says; ``tables`` holds what the page has of each CSV file, by its name."""

    model: str
    fitted: bool
    synthetic: str
    verdicts: tuple[Verdict, ...]
    consequences: tuple[Consequence, ...]
    rows: tuple[Row, ...]
    figures: tuple[Figure, ...]
    tables: Mapping[str, Embedded]
    parameters: Table
    basis: tuple[Paragraph, ...]
    loops: Table | None
    designs: tuple[DesignPart, ...]
    versions: tuple[tuple[str, str], ...]
    hashes: tuple[tuple[str, str], ...]


def report_content(inputs: Inputs) -> Content:
    """Put into words what was read.

    Raises
    ------
    InputError
        A design contradicts itself.
    """
    fitted = is_fitted(inputs)
    synthetic = sum(test.synthetic for test in inputs.tests)
    made = {name: design for name, design in inputs.designs.items() if isinstance(design, Design)}
    outcomes = {name: table for name, table in inputs.outcomes.items() if isinstance(table, pd.DataFrame)}
    return Content(
        model=_source(inputs, fitted),
        fitted=fitted,
        synthetic=f"SYNTHETIC DATA: {synthetic} of {len(inputs.tests)} tests were never measured" if synthetic else "",
        verdicts=tuple(verdicts(inputs.ledger)),
        consequences=tuple(consequences(inputs.ledger)),
        rows=tuple(row(claim) for claim in inputs.ledger.to_dict("records")),
        figures=tuple(_figure(inputs, name, fitted and synthetic > 0) for name in inputs.figures),
        tables=embedded(inputs.tables),
        parameters=parameter_table(inputs.model) if fitted else _values(inputs.model.plant),
        basis=_basis(inputs) if fitted else _not_fitted(inputs),
        loops=loop_table(made, outcomes),
        designs=tuple(_design(inputs, name, outcomes) for name in inputs.designs),
        versions=(("Python", platform.python_version()), *((name, _version(name)) for name in PACKAGES)),
        hashes=inputs.hashes,
    )


def is_fitted(inputs: Inputs) -> bool:
    """Whether the model says that it was fitted to the very sweeps that were given."""
    if not inputs.tests or inputs.model.fit is None:
        return False
    return [test.name for test in inputs.model.fit.tests] == [test.name for test in inputs.tests]


def figure_label(name: str) -> str:
    """``fig_2_09`` -> ``2.9``, ``fig_a_01`` -> ``A.1``."""
    _, chapter, place = name.split("_")
    return f"{chapter.upper()}.{int(place)}"


def first_sentence(text: str) -> str:
    """The text up to the first full stop that a capital letter follows, abbreviations apart."""
    return re.split(r"(?<=\.)(?<!\bFig\.)(?<!\bEq\.)\s+(?=[A-Z])", text, maxsplit=1)[0]


def _source(inputs: Inputs, fitted: bool) -> str:
    if fitted:
        return f"the plant fitted to {len(inputs.tests)} sweep{'s' if len(inputs.tests) > 1 else ''}"
    names = {"table": "Table 2.1 of the thesis as printed", "implied": "the set behind the printed transfer functions"}
    return names.get(inputs.model_name, f"the plant of {inputs.model_name}, which was not fitted here")


def _figure(inputs: Inputs, name: str, synthetic: bool) -> Figure:
    label, picture, tables = figure_label(name), inputs.figures[name], inputs.figure_tables[name]
    svg, caption = (picture.svg, picture.caption) if isinstance(picture, Picture) else (b"", "")
    size = re.search(rb'<svg[^>]*\swidth="([\d.]+)pt"\s+height="([\d.]+)pt"', svg)
    sweeps = any(test.synthetic for test in inputs.tests) and any(t.startswith("additive_error") for t in tables)
    return Figure(
        name,
        label,
        caption,
        f"Fig. {label}: {first_sentence(caption)}",
        packed(svg),
        (size[1].decode(), size[2].decode()) if size else ("468", "324"),
        tables,
        sweeps or (synthetic and any(experiment_of(table) for table in tables)),
        "" if isinstance(picture, Picture) else picture,
    )


def _values(plant: PlantModel) -> Table:
    """The parameters of a plant that was not fitted here."""
    return plant_table(plant, [(number(parameter.value, 6),) for parameter in plant.parameters], ("value",))


def _basis(inputs: Inputs) -> tuple[Paragraph, ...]:
    said = [("Caution", each) for each in cautions(inputs.model)]
    return (*paragraphs(inputs.model, inputs.tests), *said)


def _not_fitted(inputs: Inputs) -> tuple[Paragraph, ...]:
    names = {printable(test.path.name) if test.path else test.name: None for test in inputs.tests}
    beside = f" The sweeps {', '.join(names)} only stand beside it in Fig. 2.9." if names else ""
    return (
        ("Not fitted here", f"The model is {_source(inputs, False)}, so there are no intervals.{beside}"),
        ("Bound", f"{bound_text(inputs.model.additive_bound)}."),
    )


def _design(inputs: Inputs, name: str, outcomes: Mapping[str, pd.DataFrame]) -> DesignPart:
    design, title = inputs.designs[name], DESIGNS[name]
    refused = tuple(said for each in FOLLOWING[name] if isinstance(said := inputs.outcomes.get(each), str))
    if isinstance(design, str):
        return DesignPart(name, title, "", "", None, (design, *refused))
    try:
        found = audit_text(design, audit(design), 1.0)
    except InputError as error:
        raise InputError(f"design_{name}.json: {error}") from None
    return DesignPart(name, title, sentences(design, name, outcomes), found, coefficient_table(design), refused)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
