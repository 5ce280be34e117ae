"""The command line of this room: python -m identification fit SWEEP... --output model.json."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click
import matplotlib.style
from tqdm import tqdm

from identification.base.command_line import CommandGroup
from identification.base.errors import InputError
from identification.base.files import write_whole
from identification.bound.bound_residuals import HIGHEST_ORDER, bound_residuals
from identification.fitting.fit_plant import fit_plant
from identification.fitting.subspace_check import check_modes
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel
from identification.model.reports import SubspaceCheck
from identification.model.structure import Wanted
from identification.output.fit_facts import bound_remarks, bound_text, check_lines, fit_record, standard_errors, table
from identification.output.plots import draw_fit
from identification.sweeps.read_sweeps import input_files, read_sweeps
from identification.sweeps.response import FrequencyResponse, alias_free

FIGURES = (".pdf", ".svg", ".png")


class Counts(click.ParamType):  # type: ignore[type-arg]  # generic in the newest click only
    """``auto`` (None), a number of zeros and of poles such as 1/2, or one number for both."""

    name = "counts"

    def __init__(self, most: int) -> None:
        self.most = most

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int] | None:
        if value == "auto":
            return None
        words = value.split("/") if "/" in value else [value, value]
        if len(words) != 2 or not all(word in map(str, range(self.most + 1)) for word in words):
            self.fail(f"'{value}' is no count; expected auto, N or ZEROS/POLES from 0 to {self.most}", param, ctx)
        return int(words[0]), int(words[1])


@click.group(cls=CommandGroup)
def main() -> None:
    """From sine sweeps to a plant model with its uncertainty."""


@main.command()
@click.argument("sweeps", metavar="SWEEP...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--output", required=True, type=click.Path(path_type=Path), help="The model.json to write.")
@click.option(
    "--modes", default="auto", type=Counts(8), metavar="auto|N|Z/P", help="Zero and pole modes.  [default: auto]"
)
@click.option(
    "--real", default="auto", type=Counts(1), metavar="auto|N|Z/P", help="Real zeros and poles.  [default: auto]"
)
@click.option(
    "--integrators",
    default="auto",
    type=click.Choice(["auto", "0", "1", "2"]),
    show_default=True,
    help="Poles at s = 0.",
)
@click.option(
    "--loss",
    default="least-squares",
    type=click.Choice(["least-squares", "soft-l1"]),
    show_default=True,
    help="soft-l1: outliers can hardly move the fit.",
)
@click.option(
    "--bound-order",
    default=2,
    type=click.IntRange(1, HIGHEST_ORDER),
    show_default=True,
    help="Of W_a; 2 is Eq. (2.22).",
)
@click.option("--seed", default=0, type=click.IntRange(min=0), show_default=True, help="Of the random restarts.")
@click.option("--figure", type=click.Path(path_type=Path), help="Draw the fit; .pdf, .svg or .png.")
def fit(
    sweeps: tuple[Path, ...],
    output: Path,
    modes: tuple[int, int] | None,
    real: tuple[int, int] | None,
    integrators: str,
    loss: str,
    bound_order: int,
    seed: int,
    figure: Path | None,
) -> None:
    """Fit gain, integrators, modes, real roots and dead time to SWEEP files (raw records or frequency responses)."""
    if figure is not None and figure.suffix not in FIGURES:
        raise InputError(f"{figure}: the suffix is '{figure.suffix}'; expected {', '.join(FIGURES)}")
    if figure == output:
        raise InputError(f"{figure}: given as --output and as --figure; expected two files")
    tests = read_sweeps(sweeps)
    with tqdm(desc="fits", unit="", disable=None, leave=False) as bar:
        wanted = Wanted(None if integrators == "auto" else int(integrators), modes, real)
        result = fit_plant(tests, wanted, soft=loss == "soft-l1", seed=seed, tick=bar.update)
        checks = _checks(tests, [test.plant for test in result.tests], bar.update)
    clean = [alias_free(test, result.plant) for test in tests]
    report = bound_residuals(result.plant, clean, [test.plant for test in result.tests], bound_order)
    record = fit_record(tests, result, report, checks)
    text = IdentifiedModel(result.plant, report.bound, standard_errors(result), record).to_json()
    writers: dict[Path, Callable[[Path], object]] = {output: lambda path: path.write_text(text, encoding="utf-8")}
    with matplotlib.style.context(["default", {"svg.hashsalt": "identification", "font.size": 9}]):
        if figure is not None:
            drawing = draw_fit(clean, result.plant, report.bound)
            dateless = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": {}}[figure.suffix]
            writers[figure] = lambda path: drawing.savefig(path, dpi=300, metadata=dateless)
        write_whole(writers, inputs=input_files(sweeps))
    click.echo("\n".join([table(result), bound_text(report.bound), *bound_remarks(report), *check_lines(checks)]))


def _checks(
    tests: list[FrequencyResponse], plants: list[PlantModel], tick: Callable[[], object]
) -> dict[str, SubspaceCheck]:
    """By its name, the subspace check of each test that was read from a raw record against its own fit."""
    checks = {}
    for test, plant in zip(tests, plants, strict=True):
        if test.record is not None:
            checks[test.name] = check_modes(plant, test.record, (float(test.omega[0]), float(test.omega[-1])))
            tick()
    return checks


if __name__ == "__main__":
    main(prog_name="python -m identification")
