"""Command line of this room: ``python -m design delay-free`` and ``python -m design extended``."""

from __future__ import annotations

from pathlib import Path

import click

from design.contract import Design
from design.delay_free import design_delay_free
from design.extended import METHODS, design_extended
from identification.files import CommandGroup, write_whole
from identification.model import read_model
from identification.thesis import printed


@click.group(cls=CommandGroup)
def main() -> None:
    """Design the controllers of the thesis for MODEL: a model.json, or the words table or implied."""


@main.command("delay-free")
@click.argument("model")
@click.option("--period", type=float, required=True, help="Period of the sinusoidal reference in seconds.")
@click.option(
    "--epsilon",
    type=float,
    default=printed()["delay_free"]["epsilon"],
    show_default=True,
    help="Of the factor s^2 + epsilon of Lambda, rad^2/s^2.",
)
@click.option("--output", type=click.Path(path_type=Path, dir_okay=False), required=True, help="design.json to write.")
def delay_free(model: str, period: float, epsilon: float, output: Path) -> None:
    """Chapter 2: internal model, H-infinity stabiliser, anti-windup; the plant's dead time is ignored."""
    design = design_delay_free(read_model(model), period, epsilon)
    hinf = design.hinf or {}
    unstable = "" if design.blocks["K"].is_stable else "; K itself is UNSTABLE and diverges when the actuator saturates"
    _finish(
        design,
        model,
        output,
        f"H-infinity stabiliser: ||[W1 S; W2 T]|| = {hinf['gamma']:.4g}, no stabilising controller below "
        f"{hinf['gamma_lower']:.4g}; every closed-loop pole left of -{hinf['decay_rate']:.4g} 1/s{unstable}",
    )


@main.command("extended")
@click.argument("model")
@click.option("--reference-omega", type=float, required=True, help="Angular frequency of the reference, rad/s.")
@click.option("--a", type=float, required=True, help="Closed-loop pole of the free part, rad/s.")
@click.option("--e", type=float, required=True, help="Q has the denominator s^2 + e s + f.")
@click.option("--f", type=float, required=True, help="Q has the denominator s^2 + e s + f.")
@click.option("--method", type=click.Choice(METHODS), default="zeros", show_default=True, help="How Q is designed.")
@click.option("--output", type=click.Path(path_type=Path, dir_okay=False), required=True, help="design.json to write.")
def extended(model: str, reference_omega: float, a: float, e: float, f: float, method: str, output: Path) -> None:
    """Chapters 3 and 4: Smith predictor based controller and anti-windup with the exact dead time."""
    design = design_extended(read_model(model), reference_omega, a, e, f, method)
    poles = ", ".join(f"{pole:.4g}" for pole in design.blocks["T_so"].poles)
    _finish(design, model, output, f"Q designed by its {method}; closed loop with 1/s has the poles {poles}")


def _finish(design: Design, model: str, output: Path, summary: str) -> None:
    text = design.to_json()
    write_whole({output: lambda path: path.write_text(text, encoding="utf-8")}, inputs=[Path(model)])
    click.echo(f"{design.kind} design -> {output}")
    click.echo(f"  {summary}")
    for name, facts in design.anti_windup.items():
        sector = "any" if facts["popov_sector"] is None else f"{facts['popov_sector']:.4g}"
        stable = "stable" if facts["theta2_stable"] else "NOT stable: a lasting offset after saturation"
        click.echo(f"  anti-windup {name:9s} f = {facts['f']:.4g}, Popov sector {sector}, theta2 {stable}")


if __name__ == "__main__":
    main(prog_name="python -m design")
