"""The command line of this room: python -m identification fit SWEEP... --output model.json."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import click
import matplotlib.style
from tqdm import tqdm

from identification.files import CommandGroup, InputError, write_whole
from identification.fit import FitResult, fit_plant, fit_to_dict
from identification.frequency_response import FrequencyResponse, read_sweep
from identification.model import IdentifiedModel
from identification.plot import draw_fit
from identification.uncertainty import BoundReport, bound_residuals

FIGURES = (".pdf", ".svg", ".png")


class ModesParam(click.ParamType):
    """``auto`` (None) or a number of mode pairs from 0 to 8."""

    name = "modes"

    def convert(self, value: str | None, param: click.Parameter | None, ctx: click.Context | None) -> int | None:
        if value is None or value == "auto":
            return None
        if value not in map(str, range(9)):
            self.fail(
                f"'{value}' is not a number of mode pairs; expected auto or an integer from 0 to 8",
                param,
                ctx,
            )
        return int(value)


@click.group(cls=CommandGroup)
def main() -> None:
    """From sine sweeps to a plant model with its uncertainty."""


@main.command()
@click.argument("sweeps", metavar="SWEEP...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--output", required=True, type=click.Path(path_type=Path), help="The model.json to write.")
@click.option("--modes", default="auto", type=ModesParam(), metavar="auto|N", help="Mode pairs.  [default: auto]")
@click.option("--seed", default=0, type=click.IntRange(min=0), show_default=True, help="Of the random restarts.")
@click.option("--figure", type=click.Path(path_type=Path), help="Draw the fit; .pdf, .svg or .png.")
def fit(sweeps: tuple[Path, ...], output: Path, modes: int | None, seed: int, figure: Path | None) -> None:
    """Fit gain, integrator, modes and dead time to SWEEP files (raw records or frequency responses)."""
    if figure is not None and figure.suffix not in FIGURES:
        raise InputError(f"{figure}: the suffix is '{figure.suffix}'; expected {', '.join(FIGURES)}")
    if figure == output:
        raise InputError(f"{figure}: given as --output and as --figure; expected two files")
    tests = [read_sweep(path) for path in sweeps]
    with tqdm(desc="fits", unit="", disable=None, leave=False) as bar:
        result = fit_plant(tests, modes, seed, bar.update)
    report = bound_residuals(result.plant, tests)
    model = IdentifiedModel(result.plant, report.bound, result.standard_errors, _facts(sweeps, tests, result, report))
    text = model.to_json()
    writers: dict[Path, Callable[[Path], object]] = {output: lambda path: path.write_text(text, encoding="utf-8")}
    with matplotlib.style.context(["default", {"svg.hashsalt": "identification", "font.size": 9}]):
        if figure is not None:
            drawing = draw_fit(tests, result.plant, report.bound)
            dateless = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": {}}[figure.suffix]
            writers[figure] = lambda path: drawing.savefig(path, dpi=300, metadata=dateless)
        write_whole(writers, inputs=sweeps)
    click.echo(_table(result, report))


def _facts(
    sweeps: tuple[Path, ...], tests: list[FrequencyResponse], result: FitResult, report: BoundReport
) -> dict[str, object]:
    facts = fit_to_dict(result)
    for entry, path, test in zip(facts["tests"], sweeps, tests, strict=True):
        entry["sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
        entry["synthetic"] = test.synthetic
    return {
        "source": "identification fit",
        "synthetic": any(test.synthetic for test in tests),
        **facts,
        "bound": {
            "largest_excess": report.largest_excess,
            "mean_excess": report.mean_excess,
            "touches_omega": report.touches_omega,
            "touches_test": report.touches_test,
        },
    }


def _table(result: FitResult, report: BoundReport) -> str:
    """Parameter, estimate, standard error and, for several tests, the scatter of one test."""
    plant, errors = result.plant, result.standard_errors
    rows = [("gain", plant.gain, errors["gain"])]
    for key, modes in (("zero_modes", plant.zero_modes), ("pole_modes", plant.pole_modes)):
        for i, mode in enumerate(modes):
            label = f"{key.removesuffix('_modes')} mode {i + 1}"
            rows.append((f"{label}, omega [rad/s]", mode.omega, errors[key][i]["omega"]))
            rows.append((f"{label}, zeta", mode.zeta, errors[key][i]["zeta"]))
    rows.append(("delay [s]", plant.delay_s, errors["delay_s"]))
    count = len(result.tests)
    head = f"{'parameter':<28}{'estimate':>13}{'std. error':>13}" + (f"{'scatter':>13}" if count > 1 else "")
    lines = [head]
    for k, (label, value, error) in enumerate(rows):
        line = f"{label:<28}{value:>13.6g}{error:>13.3g}"
        if result.scatter is not None:
            unit = 1.0 if label.startswith("delay") else abs(value)
            line += f"{result.scatter[k] * count**0.5 * unit:>13.3g}"
        lines.append(line)
    bound, peak = report.bound, report.bound.resonance
    lines.append(
        f"W_a = {bound.gain:.4g} (1 + s/{bound.corner:.4g}) / (1 + 2 {peak.zeta:.4g} s/{peak.omega:.4g} + "
        f"(s/{peak.omega:.4g})^2), {report.mean_excess:.2f} times the residuals' envelope on average, "
        f"{report.largest_excess:.2f} at most"
    )
    lines.append(f"{count} test{'s' if count > 1 else ''}, {result.modes} mode pairs")
    return "\n".join(lines)


if __name__ == "__main__":
    main(prog_name="python -m identification")
