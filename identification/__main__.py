"""The command line of this room: python -m identification fit SWEEP... --output model.json.

The command imports what it runs, so that a command line answers at once.
"""

from __future__ import annotations

if __name__ == "__main__":
    from identification.base.process import begin

    begin()

from math import inf
from pathlib import Path
from typing import Any

import click

from identification.base.axis_option import AXIS
from identification.base.command_line import CommandGroup, together
from identification.base.files import Content, require_writable, write_whole
from identification.base.path_types import FIGURE_FILE, INPUT, OUTPUT_FILE
from identification.bound.orders import HIGHEST_ORDER


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
            self.fail(f"'{value}' is not a count; expected auto, N or ZEROS/POLES from 0 to {self.most}", param, ctx)
        return int(words[0]), int(words[1])


class Columns(click.ParamType):  # type: ignore[type-arg]  # as above
    """Pairs such as ``Frequency (Hz)=frequency_hz`` with commas between."""

    name = "columns"

    def convert(
        self, value: str | dict[str, str], param: click.Parameter | None, ctx: click.Context | None
    ) -> dict[str, str]:
        if isinstance(value, dict):
            return value
        pairs = [pair.rpartition("=") for pair in value.split(",")]
        if not all(name.strip() and ours.strip() for name, _, ours in pairs):
            self.fail(f"'{value}' holds no pairs; expected NAME=OURS, with commas between several", param, ctx)
        return {name.strip(): ours.strip() for name, _, ours in pairs}


@click.group(cls=CommandGroup)
def main() -> None:
    """Identify a plant model and its uncertainty from sine sweeps."""


reading_options = together(
    click.option(
        "--columns",
        type=Columns(),
        metavar="NAME=OURS,...",
        help=(
            'Names of columns: the name in the file, =, the name that we use; for example "Frequency '
            '(Hz)=frequency_hz".'
        ),
    ),
    click.option(
        "--node",
        type=int,
        help=(
            "Node to read from a universal file with several: that of the response, or that of the reference if only "
            "the references differ."
        ),
    ),
    click.option("--direction", type=int, help="Direction to read from a universal file where the node has several."),
    click.option("--resample", is_flag=True, help="Interpolate records with uneven time stamps to an even grid."),
)
"""What a file of sweeps does not say itself; the values are those of ``Reading``."""


def _band(
    _ctx: click.Context, _param: click.Parameter, value: tuple[float, float] | None
) -> tuple[float, float] | None:
    if value is not None and not 0 <= value[0] < value[1] < inf:
        raise click.BadParameter(f"the band is {value[0]:.12g} to {value[1]:.12g} Hz; expected 0 <= LOW < HIGH")
    return value


fit_options = together(
    click.option(
        "--modes",
        default="auto",
        type=Counts(8),
        metavar="auto|N|Z/P",
        help="Number of zero and pole modes, up to 8: one number for both, or ZEROS/POLES.",
    ),
    click.option(
        "--real",
        default="auto",
        type=Counts(3),
        metavar="auto|N|Z/P",
        help="Number of real zeros and poles, up to 3: one number for both, or ZEROS/POLES.",
    ),
    click.option(
        "--integrators",
        default="auto",
        type=click.Choice(["auto", "-2", "-1", "0", "1", "2"]),
        help="Number of poles at s = 0; a negative number counts zeros at s = 0.",
    ),
    click.option(
        "--band",
        type=(float, float),
        callback=_band,
        metavar="LOW HIGH",
        help=(
            "Use only the lines between LOW and HIGH, in Hz. Default: lines that are mostly noise at "
            "both ends of a test are left out."
        ),
    ),
    click.option(
        "--loss",
        default="least-squares",
        type=click.Choice(["least-squares", "soft-l1"]),
        help="Loss function of the fit; soft-l1 reduces the influence of outliers on the parameters.",
    ),
    click.option(
        "--bound-order",
        default=2,
        type=click.IntRange(1, HIGHEST_ORDER),
        help="Number of poles of the bound W_a; 2 is Eq. (2.22).",
    ),
    click.option(
        "--bound-below",
        type=click.FloatRange(min=0, min_open=True),
        metavar="LEVEL",
        help=(
            "Largest distance of a plant from the model below the lowest line, in output units per input "
            "unit. W_a covers it."
        ),
    ),
    click.option(
        "--bound-above",
        type=click.FloatRange(min=0, min_open=True),
        metavar="LEVEL",
        help=(
            "Largest distance of a plant from the model from the highest line to ten times its "
            "frequency. Above, W_a falls off like 1/s."
        ),
    ),
    click.option("--seed", default=0, type=click.IntRange(min=0), help="Seed of the random restarts of the fit."),
)
"""How a fit is made."""

signal_options = together(
    click.option("--input-name", default="input", help="Name of the plant's input."),
    click.option("--input-unit", default="", show_default=False, help="Unit of the plant's input, for example A."),
    click.option("--output-name", default="output", help="Name of the plant's output."),
    click.option("--output-unit", default="", show_default=False, help="Unit of the plant's output, for example m."),
)
"""Names and units of the plant's input and output, which model.json and what is made of it keep."""


@main.command()
@click.argument("sweeps", metavar="SWEEP...", nargs=-1, required=True, type=INPUT)
@AXIS
@click.option("--output", required=True, type=OUTPUT_FILE, help="The model.json to write.")
@click.option(
    "--responses",
    type=OUTPUT_FILE,
    help="Keep the fitted responses in this .npz file; later commands read it as a SWEEP.",
)
@click.option(
    "--figure",
    type=FIGURE_FILE,
    help="Draw a Bode diagram of the tests and the model to this file: .pdf, .svg or .png.",
)
@reading_options
@fit_options
@signal_options
def fit(
    sweeps: tuple[Path, ...],
    output: Path,
    modes: tuple[int, int] | None,
    real: tuple[int, int] | None,
    integrators: str,
    band: tuple[float, float] | None,
    loss: str,
    bound_order: int,
    bound_below: float | None,
    bound_above: float | None,
    seed: int,
    input_name: str,
    input_unit: str,
    output_name: str,
    output_unit: str,
    responses: Path | None,
    figure: Path | None,
    **reading: Any,
) -> None:
    """Fit a plant and its bound W_a to SWEEP files.

    The plant has a gain, integrators, modes, real roots and a dead time. A SWEEP is a raw record or a frequency
    response.
    """
    from tqdm import tqdm

    from identification.fit_model import fit_model
    from identification.formats.reading import Reading
    from identification.model.signals import Signals
    from identification.model.structure import Wanted
    from identification.output.fit_facts import bound_remarks, bound_text, check_lines, table
    from identification.sweeps.input_files import input_files
    from identification.sweeps.kept_responses import write_responses
    from identification.sweeps.read_sweeps import read_sweeps

    files = input_files(sweeps)
    require_writable(*(path for path in (output, responses, figure) if path is not None), inputs=files)
    signals = Signals(input_name, input_unit, output_name, output_unit)
    tests = read_sweeps(sweeps, Reading.of_options(reading))
    with tqdm(desc="fits", unit="", disable=None, leave=False) as bar:
        wanted = Wanted(None if integrators == "auto" else int(integrators), modes, real)
        soft = loss == "soft-l1"
        fitted = fit_model(
            tests,
            wanted,
            soft=soft,
            bound_order=bound_order,
            bound_below=bound_below,
            bound_above=bound_above,
            seed=seed,
            band=band,
            signals=signals,
            tick=bar.update,
        )
    contents: dict[Path, Content] = {output: fitted.model.to_json()}
    if responses is not None:
        contents[responses] = lambda path: write_responses(path, fitted.tests)
    if figure is not None:
        from paper_figures.look.bode import plot_bode
        from paper_figures.look.style import figure_writer

        contents[figure] = figure_writer(plot_bode(fitted.model, fitted.tests))
    write_whole(contents, inputs=files)
    bound = [bound_text(fitted.model.additive_bound), *bound_remarks(fitted.bound_fit)]
    of_tests = [f"{test.name}: {said}" for test in fitted.record.tests for said in (*test.remarks, *test.left_out)]
    plant = [table(fitted.plant_fit), *fitted.record.cautions]
    click.echo("\n".join([*plant, *of_tests, *bound, *check_lines(fitted.checks)]))


if __name__ == "__main__":
    main(prog_name="python -m identification")
