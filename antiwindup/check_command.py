"""The command ``check``: whether a model, and a design of it, still hold for new sweeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from identification.__main__ import reading_options
from identification.base.path_types import INPUT, INPUT_FILE, OUTPUT_FILE


@click.command("check")
@click.argument("model")
@click.argument("sweeps", metavar="SWEEP...", nargs=-1, required=True, type=INPUT)
@click.option(
    "--against",
    type=INPUT_FILE,
    metavar="DESIGN",
    help="A design.json made for MODEL; its margins and its guarantee are computed again for the new plant.",
)
@click.option(
    "--junit", type=OUTPUT_FILE, help="Write JUnit XML here, with a test case for each question and each sweep."
)
@click.option("--markdown", type=OUTPUT_FILE, help="Write Markdown here, for example for the summary page of a CI job.")
@reading_options
def check(
    model: str,
    sweeps: tuple[Path, ...],
    against: Path | None,
    junit: Path | None,
    markdown: Path | None,
    **reading: Any,
) -> None:
    """Check new SWEEP files against MODEL.

    The command says whether they lie within the bound W_a of MODEL, and which parameters have moved. MODEL is a
    model.json, table or implied. The exit status is 0 if everything holds; 1 if a sweep leaves W_a, a parameter has
    moved or the design has lost a margin or its guarantee; 2 if the input is refused.
    """
    from design.asked_model import asked_model
    from design.design_file import read_design
    from experiments.checking import files
    from experiments.checking.answers import answers, fails
    from experiments.checking.check_model import check_model
    from experiments.checking.words import text
    from identification.base.files import require_writable, write_whole
    from identification.formats.reading import Reading
    from identification.sweeps.input_files import input_files
    from identification.sweeps.read_sweeps import read_sweeps

    inputs = [Path(model), *input_files(sweeps), *([against] if against else [])]
    targets = {path: made for path, made in ((junit, files.junit), (markdown, files.markdown)) if path is not None}
    require_writable(*targets, inputs=inputs)
    content, design = asked_model(model), None if against is None else read_design(against)
    tests = read_sweeps(sweeps, Reading.of_options(reading))
    found = check_model(content, tests, design)
    said = text(found)
    write_whole({path: made(found) for path, made in targets.items()}, inputs)
    click.echo(said)
    if fails(answers(found)):
        click.get_current_context().exit(1)
