"""The command line of the figures: ``python -m paper_figures`` with draw, summary, bode and report.

Each command imports what it runs, so that a command line answers at once, and make knows what each command hangs on.
"""

from __future__ import annotations

if __name__ == "__main__":
    from identification.base.process import begin

    begin()

from pathlib import Path

import click

from identification.base.command_line import CommandGroup
from identification.base.path_types import INPUT, INPUT_FILE, OUTPUT_FOLDER

OUTPUT = click.option("--output", type=OUTPUT_FOLDER, required=True, help="Existing folder to write to.")


@click.group(cls=CommandGroup)
def main() -> None:
    """Draw a fit, sum up a plant, draw the thesis's figures, write the report."""


@main.command()
@click.argument("names", metavar="NAME...", nargs=-1, required=True)
@click.option(
    "--results",
    type=INPUT,
    required=True,
    help="Folder with the tables that the experiments wrote.",
)
@OUTPUT
def draw(names: tuple[str, ...], results: Path, output: Path) -> None:
    """Draw the thesis's figures NAME.

    NAME is for example fig_2_01. Each figure is written as PDF, SVG and PNG, and its caption as text.
    """
    from paper_figures.look import style
    from paper_figures.result_tables import read_table, sentences_of
    from paper_figures.thesis.figure_registry import figure_module

    files: dict[Path, bytes] = {}
    for name in names:
        module = figure_module(name)
        tables = {table: read_table(results / f"{table}.csv", name) for table in module.TABLES}
        with style.styled(), sentences_of(tables, results, name):
            files |= style.rendered(module.draw(tables), output, name, module.caption(tables))
    style.write(files)


@main.command("axis")
@click.argument("names", metavar="NAME...", nargs=-1, required=True)
@click.option(
    "--refit",
    type=INPUT,
    required=True,
    help="Folder of a refit: it holds design.json and the folder results with the tables.",
)
@OUTPUT
def axis_command(names: tuple[str, ...], refit: Path, output: Path) -> None:
    """Draw the figures NAME of a refit.

    NAME is for example run or rates. Each figure is written as PDF, SVG and PNG, and its caption as text.
    """
    from design.design_file import read_design
    from paper_figures.axis_figures.registry import axis_figure
    from paper_figures.look import style
    from paper_figures.result_tables import read_table, sentences_of

    design = read_design(refit / "design.json", "extended")
    files: dict[Path, bytes] = {}
    for name in names:
        module = axis_figure(name)
        tables = {table: read_table(refit / "results" / f"{table}.csv", name) for table in module.TABLES}
        with sentences_of(tables, refit / "results", name, refit / "design.json"):
            files |= style.rendered(module.draw(design, tables), output, name, module.caption(design, tables))
    style.write(files)


@main.command("summary")
@click.argument("model", type=INPUT_FILE)
@click.argument("sweeps", metavar="SWEEP...", nargs=-1, required=True, type=INPUT)
@click.option(
    "--build",
    type=OUTPUT_FOLDER,
    required=True,
    help="Existing folder with the designs and the folder results with the tables; the summary is written to it.",
)
def summary_command(model: Path, sweeps: tuple[Path, ...], build: Path) -> None:
    """Sum up MODEL on one page.

    The page says what to do, what to avoid, and why. SWEEP files are those to which MODEL was fitted. The command
    writes summary.pdf, .svg, .png and .txt.
    """
    from identification.model.model_file import read_model
    from identification.sweeps.as_fitted import as_fitted
    from identification.sweeps.read_sweeps import read_sweeps
    from paper_figures.look import style
    from paper_figures.result_tables import sentences_of
    from paper_figures.summary import page
    from paper_figures.summary.build_folder import read_refit
    from paper_figures.summary.words import summarise

    identified = read_model(model)
    tests = as_fitted(identified, read_sweeps(sweeps))
    found = read_refit(build)
    with sentences_of(found.files, build / "results", "summary", model):
        said = summarise(identified, tests, found)
        files = style.rendered(page.draw(said, identified, tests), build, "summary", said.text())
    style.write(files)
    click.echo(f"{len(tests)} test{'s' if len(tests) > 1 else ''} -> {build / 'summary.pdf'}")
    for head, sentence in said.refused:
        click.echo(f"{head}: {sentence}")


@main.command("bode")
@click.argument("model", type=INPUT_FILE)
@click.argument("sweeps", metavar="SWEEP...", nargs=-1, required=True, type=INPUT)
@OUTPUT
def bode_command(model: Path, sweeps: tuple[Path, ...], output: Path) -> None:
    """Draw a Bode diagram of SWEEP files and MODEL.

    A third panel shows their distance and the bound W_a. The command writes bode.pdf, .svg, .png and .txt.
    """
    from identification.model.model_file import read_model
    from identification.sweeps.as_fitted import as_fitted
    from identification.sweeps.read_sweeps import read_sweeps
    from paper_figures.look.bode import plot_bode
    from paper_figures.look.style import rendered, write
    from paper_figures.result_tables import sentences_of

    identified, tests = read_model(model), read_sweeps(sweeps)
    names = ", ".join(test.name + (" (synthetic)" if test.synthetic else "") for test in tests)
    caption = f"Magnitude and phase of {names} and of the model {model.name}, and their distance under the bound W_a."
    used = as_fitted(identified, tests)
    if identified.fit is not None and identified.fit.covariance is not None:
        caption += " The band around the model is its 95 % confidence interval, at each frequency by itself."
    if any(test.left_out for test in used):
        caption += " Lines that the fit left out are in another colour."
    if any(test.conjugated for test in used):
        caption += " The sign of the phase is reversed, as in the fit."
    with sentences_of({}, output, "bode", model):
        files = rendered(plot_bode(identified, used), output, "bode", caption)
    write(files)


@main.command("report")
@click.argument("model")
@click.argument("sweeps", metavar="[SWEEP]...", nargs=-1, type=INPUT)
@click.option(
    "--build",
    type=OUTPUT_FOLDER,
    required=True,
    help="Existing folder with claims.csv, the designs, results and figures; report/index.html is written to it.",
)
def report_command(model: str, sweeps: tuple[Path, ...], build: Path) -> None:
    """Write one HTML page with all results.

    They are what was made for MODEL (a model.json, table or implied) and the SWEEP files.
    """
    from paper_figures.result_tables import sentences_of
    from paper_figures.thesis.figure_registry import figure_module, figure_names
    from paper_figures.thesis.report.build_folder import read_build, summaries
    from paper_figures.thesis.report.content import report_content
    from paper_figures.thesis.report.html import write_report
    from paper_figures.thesis.report.inputs import read_inputs

    designs, outcomes = read_build(build, "report")
    figures = {name: figure_module(name).TABLES for name in figure_names()}
    inputs = read_inputs(model, sweeps, build, figures, designs, outcomes)
    with sentences_of(summaries(outcomes), build / "results", "report", Path(model)):
        content = report_content(inputs)
    click.echo(f"{len(content.rows)} claims, {len(figures)} figures -> {write_report(content, build, inputs.files)}")


if __name__ == "__main__":
    main(prog_name="python -m paper_figures")
