"""The command line of the figures: ``python -m paper_figures`` with draw, summary and report."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from io import StringIO
from pathlib import Path
from traceback import walk_tb
from typing import TYPE_CHECKING, Protocol, TypeVar, cast

import click
import pandas as pd
from matplotlib.figure import Figure

import paper_figures
from identification.files import CommandGroup, InputError, read_text
from paper_figures import style

if TYPE_CHECKING:
    from design.contract import Design

Result = TypeVar("Result")


class FigureModule(Protocol):
    """What a module ``fig_x_yy`` offers."""

    TABLES: tuple[str, ...]
    """Names of the tables it draws, files ``<name>.csv`` among the results."""

    def draw(self, tables: Mapping[str, pd.DataFrame]) -> Figure:
        """Return the figure."""

    def caption(self, tables: Mapping[str, pd.DataFrame]) -> str:
        """Return the caption."""


@click.group(cls=CommandGroup)
def main() -> None:
    """Draw the figures of the thesis."""


@main.command()
@click.argument("names", metavar="NAME...", nargs=-1, required=True)
@click.option(
    "--results",
    type=click.Path(path_type=Path),
    required=True,
    help="Folder of the tables that the experiments wrote.",
)
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Existing folder to write to.")
def draw(names: tuple[str, ...], results: Path, output: Path) -> None:
    """Draw the figures NAME..., such as fig_2_01, each as PDF, SVG and PNG with its caption as text."""
    drawn = {}
    for name in names:
        module = figure_module(name)
        tables = {table: read_table(results / f"{table}.csv", name) for table in module.TABLES}
        with style.styled(), missing_columns_named(tables, results, name):
            drawn[name] = module.draw(tables), module.caption(tables)
    for name, (figure, caption) in drawn.items():
        style.save(figure, output, name, caption)


@main.command("summary")
@click.argument("model")
@click.argument("sweeps", metavar="SWEEP...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--build",
    type=click.Path(path_type=Path),
    required=True,
    help="Existing folder of the designs, with the tables in its folder results; to write to, too.",
)
def summary_command(model: str, sweeps: tuple[Path, ...], build: Path) -> None:
    """Sum up MODEL, fitted to SWEEP files, its designs, and what was refused: summary.pdf, .svg, .png and .txt."""
    # only here: they take a second to import, and no figure needs them
    from identification.discretised import alias_free
    from identification.frequency_response import read_sweeps
    from identification.model import read_model
    from paper_figures import summary_page
    from paper_figures.summary import summarise

    identified = read_model(model)
    tests = [alias_free(test, identified.plant) for test in read_sweeps(sweeps)]
    designs, outcomes = read_build(build, "summary")
    with missing_columns_named(summaries(outcomes), build / "results", "summary"):
        said = summarise(identified, tests, designs, outcomes)
    page = summary_page.draw(said, identified, tests)
    style.save(page, build, "summary", said.text())
    click.echo(f"{len(tests)} test{'s' if len(tests) > 1 else ''} -> {build / 'summary.pdf'}")
    for head, sentence in said.refused:
        click.echo(f"{head}: {sentence}")


@main.command("report")
@click.argument("model")
@click.argument("sweeps", metavar="[SWEEP]...", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--build",
    type=click.Path(path_type=Path),
    required=True,
    help="Existing folder of claims.csv, the designs, results and figures; to write report/index.html to.",
)
def report_command(model: str, sweeps: tuple[Path, ...], build: Path) -> None:
    """Put all that was made for MODEL (a model.json, table or implied) and SWEEP files on one page of HTML."""
    # only here, as above
    from paper_figures.report import write_report
    from paper_figures.report_content import report_content
    from paper_figures.report_inputs import read_inputs

    designs, outcomes = read_build(build, "report")
    figures = {name: figure_module(name).TABLES for name in figure_names()}
    inputs = read_inputs(model, sweeps, build, figures, designs, outcomes)
    with missing_columns_named(summaries(outcomes), build / "results", "report"):
        content = report_content(inputs)
    click.echo(f"{len(content.rows)} claims, {len(figures)} figures -> {write_report(content, build, inputs.files)}")


def figure_names() -> list[str]:
    """Return the names of all figures, in the order of the thesis."""
    return sorted(
        module.name for module in pkgutil.iter_modules(paper_figures.__path__) if module.name.startswith("fig_")
    )


def figure_module(name: str) -> FigureModule:
    """Return the module that draws the named figure.

    Raises
    ------
    InputError
        There is no such figure.
    """
    if name not in figure_names():
        raise InputError(f"{name}: no such figure; the figures are {', '.join(figure_names())}")
    return cast(FigureModule, import_module(f"paper_figures.{name}"))


def read_build(build: Path, figure: str) -> tuple[dict[str, Design | str], dict[str, pd.DataFrame | str]]:
    """Return the designs and the summaries of the experiments in a build folder, or why each was refused.

    Parameters
    ----------
    build
        The folder of the designs, with the tables in its folder results.
    figure
        What needs them, for the message.

    Raises
    ------
    InputError
        A file is not what it should be.
    """
    from design.contract import read_design
    from paper_figures.summary_of_designs import FOLLOWING

    designs = read_attempts({name: build / f"design_{name}" for name in FOLLOWING}, ".json", read_design)
    stems = {name: build / "results" / name for names in FOLLOWING.values() for name in names}
    return designs, read_attempts(stems, "_summary.csv", partial(read_table, figure=figure))


def summaries(outcomes: Mapping[str, pd.DataFrame | str]) -> dict[str, pd.DataFrame]:
    """Return the tables among outcomes by the names of their files."""
    return {f"{name}_summary": table for name, table in outcomes.items() if isinstance(table, pd.DataFrame)}


def read_attempts(stems: Mapping[str, Path], end: str, read: Callable[[Path], Result]) -> dict[str, Result | str]:
    """Return what commands wrote, or the sentences with which they refused.

    Parameters
    ----------
    stems
        For each name the path of its file without ``end``; a refusal stands in STEM.refused.txt. A name that has
        neither is left out.
    end
        Of the files.
    read
        What reads one.

    Raises
    ------
    InputError
        ``read`` refuses a file.
    """
    found: dict[str, Result | str] = {}
    for name, stem in stems.items():
        path, refusal = (stem.with_name(stem.name + ending) for ending in (end, ".refused.txt"))
        if path.is_file():
            found[name] = read(path)
        elif refusal.is_file() and (lines := read_text(refusal).strip().splitlines()):
            found[name] = lines[-1].removeprefix("Error: ").rstrip(".")
    return found


def read_table(path: Path, figure: str = "summary") -> pd.DataFrame:
    """Return a table of results, its ``#`` lines left out.

    Parameters
    ----------
    path
        The CSV file.
    figure
        Name of the figure that needs it, for the message.

    Raises
    ------
    InputError
        The file is missing, is no table or has no rows.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such table, which {figure} needs")
    try:
        table = pd.read_csv(StringIO(read_text(path)), comment="#")
    except (pd.errors.ParserError, pd.errors.EmptyDataError):
        raise InputError(f"{path}: not a table of comma-separated values, which {figure} needs") from None
    if table.empty:
        raise InputError(f"{path}: no rows below the names of the columns, which {figure} needs")
    return table


@contextmanager
def missing_columns_named(tables: Mapping[str, pd.DataFrame], results: Path, figure: str) -> Iterator[None]:
    """Turn the KeyError of a table that lacks a column into a sentence; every other KeyError goes on.

    Raises
    ------
    InputError
        A column that was asked for is missing from one of the tables, or from rows taken out of one.
    """
    try:
        yield
    except KeyError as error:
        column = error.args[0]
        for frame, _ in walk_tb(error.__traceback__):
            asked = frame.f_locals.get("self")
            if not isinstance(asked, pd.DataFrame) or column in asked.columns:
                continue
            for name, table in tables.items():
                if asked.columns.equals(table.columns):
                    raise InputError(f"{results / name}.csv: no column {column}, which {figure} needs") from None
        raise


if __name__ == "__main__":
    main(prog_name="python -m paper_figures")
