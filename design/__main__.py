"""Command line of this room: ``python -m design`` with delay-free, extended, anti-windup and audit.

Each command imports what it runs, so that a command line answers at once, and make knows what each command hangs on.
"""

from __future__ import annotations

if __name__ == "__main__":
    from identification.base.process import begin

    begin()

import re
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import click

from design.choices import METHODS, ROBUST_LEVEL
from design.options import DESIGN, OUTPUT, asked_frequencies, corrected_options, frequency_options
from identification.base.axis_option import AXIS
from identification.base.command_line import CommandGroup
from identification.base.digits import lower_end, upper_end
from identification.base.errors import InputError
from identification.base.files import require_writable, write_whole
from identification.base.path_types import FIGURE_FILE

if TYPE_CHECKING:
    from design.design_file import Design


@click.group(cls=CommandGroup)
def main() -> None:
    """Design the controllers of the thesis for MODEL: a model.json, or the words table or implied; audit a design."""


@main.command("delay-free")
@click.argument("model")
@AXIS
@frequency_options
@click.option(
    "--epsilon",
    type=float,
    help=(
        "epsilon of the factor s^2 + epsilon of Lambda, in rad^2/s^2. A constant reference is followed "
        "with a small error."
    ),
)
@click.option(
    "--integral-action",
    is_flag=True,
    help=(
        "Use integral action instead of --epsilon (not in the thesis). A constant reference and a "
        "constant disturbance at the plant's input then leave no error, and the controller hides no "
        "integrator of the plant."
    ),
)
@corrected_options
@OUTPUT
def delay_free(
    model: str,
    hertz: tuple[float, ...],
    omegas: tuple[float, ...],
    epsilon: float | None,
    integral_action: bool,
    recovery: float | None,
    guarantee: str | None,
    sector: float | None,
    bandwidth: float | None,
    output: Path,
) -> None:
    """Design by chapter 2, without the dead time.

    The design has an internal model, an H-infinity stabiliser and an anti-windup. It ignores the plant's dead time.
    """
    from design.asked_model import asked_model
    from design.chapter_2.design_delay_free import design_delay_free

    if (epsilon is None) != integral_action:
        found = "both --epsilon and {} are" if integral_action else "neither --epsilon nor {} is"
        raise InputError(f"{found.format('--integral-action')} given; expected one of them")
    frequencies = asked_frequencies(hertz, omegas)
    require_writable(output, inputs=[Path(model)])
    given = asked_model(model)
    design = design_delay_free(given, frequencies, epsilon, recovery, sector, bandwidth, guarantee)
    hinf = design.hinf
    assert hinf is not None
    hidden = 0 if integral_action else given.plant.integrators
    drift = (
        f"\n  C hides {'the integrator' if hidden == 1 else 'both integrators'} of the plant: y drifts under a "
        "constant disturbance at its input; --integral-action prevents that"
    )
    late = _on_the_plant_with_its_dead_time(design)
    unstable = "" if design.blocks["K"].is_stable else "; K itself is UNSTABLE and diverges when the actuator saturates"
    _finish(
        design,
        model,
        output,
        f"H-infinity stabiliser: ||[W1 S; W2 T]|| = {upper_end(hinf.gamma, 4)}, no stabilising controller below "
        f"{lower_end(hinf.gamma_lower, 4)}; every closed-loop pole left of -{lower_end(hinf.decay_rate, 4)} 1/s"
        f"{unstable}{drift if hidden else ''}{late}",
    )


@main.command("extended")
@click.argument("model")
@AXIS
@frequency_options
@click.option("--a", type=float, help="Closed-loop pole of the free part, in rad/s. Default: as fast as W_a allows.")
@click.option(
    "--e",
    type=float,
    multiple=True,
    help="Coefficient of the factor s^2 + e s + f of Q; give it once for each reference frequency above 0.",
)
@click.option(
    "--f",
    type=float,
    multiple=True,
    help="Coefficient of the factor s^2 + e s + f of Q; give it once for each reference frequency above 0.",
)
@click.option(
    "--interpolation",
    "method",
    type=click.Choice(METHODS),
    default="zeros",
    help="Method that makes Q meet the interpolation conditions.",
)
@click.option(
    "--inverse-epsilon", type=float, default=0.0, help="eps of R_eps^-1 = R_0^-1/(1 + eps s)^2, Eq. (3.2), in seconds."
)
@click.option(
    "--robust-level",
    type=float,
    metavar="LEVEL",
    help="Let T_so roll off, as late as |W_a C S| <= LEVEL < 1 allows. "
    f"Default: {ROBUST_LEVEL:g} if --a is not given or the plant is outside the thesis's class; else no roll-off.",
)
@corrected_options
@OUTPUT
def extended(
    model: str,
    hertz: tuple[float, ...],
    omegas: tuple[float, ...],
    a: float | None,
    e: tuple[float, ...],
    f: tuple[float, ...],
    method: str,
    inverse_epsilon: float,
    robust_level: float | None,
    recovery: float | None,
    guarantee: str | None,
    sector: float | None,
    bandwidth: float | None,
    output: Path,
) -> None:
    """Design by chapters 3 and 4, for every plant.

    The controller and its anti-windup take the exact dead time into account. --reference-hz 0.5 is enough: the
    command then chooses the rest from the reference, the dead time and W_a, and prints each choice with its reason.
    """
    from design.asked_model import asked_model
    from design.chapters_3_4.design_extended import design_extended

    if len(e) != len(f):
        raise InputError(f"--e is given {len(e)} times and --f {len(f)} times; expected equal numbers")
    frequencies = asked_frequencies(hertz, omegas)
    require_writable(output, inputs=[Path(model)])
    given = asked_model(model)
    design = design_extended(
        given,
        frequencies,
        a,
        list(zip(e, f, strict=True)) or None,
        method,
        inverse_epsilon,
        robust_level,
        recovery,
        sector,
        bandwidth,
        guarantee,
    )
    poles = ", ".join(f"{pole:.4g}" for pole in design.blocks["T_so"].poles)
    _finish(design, model, output, "\n  ".join((*design.free.reasons, f"T_so has the poles {poles}")))


@main.command("anti-windup")
@DESIGN
@click.option("--name", required=True, help="Name of the anti-windup in the design; --anti-windup NAME simulates it.")
@click.option(
    "--numerator", required=True, help="Coefficients of the numerator, highest power first, for example '1 2.5 3'."
)
@click.option("--denominator", required=True, help="Coefficients of the denominator, highest power first.")
@OUTPUT
def anti_windup_command(design: Path, name: str, numerator: str, denominator: str, output: Path) -> None:
    """Add your own anti-windup theta1~ to DESIGN.

    theta1~ must be strictly proper and stable.
    """
    from design.anti_windup.compensator import anti_windup
    from design.anti_windup.judge import Compensator, judge
    from design.blocks.block import from_polynomial
    from design.design_file import read_design

    content = read_design(design)
    if name in ("none", "thesis", "corrected") or not re.fullmatch(r"[\w-]+", name):
        raise InputError(f"--name is '{name}'; expected letters, digits, _ and -, and not none, thesis or corrected")
    above, below = (
        _coefficients(text, option) for text, option in ((numerator, "numerator"), (denominator, "denominator"))
    )
    kind = anti_windup(from_polynomial(above) * from_polynomial(below).inverse())
    judgement = judge(content.loop_plant, content.additive_bound, kind)
    _finish(
        replace(content, added={**content.added, name: Compensator(kind, judgement)}),
        str(design),
        output,
        f"with theta1~ = ({numerator})/({denominator}) as {name}",
    )


@main.command("audit")
@DESIGN
@click.option(
    "--windup",
    type=float,
    default=1.0,
    help="Integral of u - sat(u) for which the lasting offset is given, in the input's unit times second.",
)
@click.option(
    "--figure",
    type=FIGURE_FILE,
    help="Draw the Nyquist curve with the discs of W_a, |S|, |T| and |W_a C S| to this file: .pdf, .svg or .png.",
)
def audit_command(design: Path, windup: float, figure: Path | None) -> None:
    """Judge DESIGN with the exact dead time.

    The command prints the characteristic roots, the margins and |W_a C S| of the linear loop. Then it judges each
    anti-windup of DESIGN and compares it with no anti-windup.
    """
    from design.auditing.as_text import audit_text
    from design.auditing.audit_design import audit
    from design.design_file import read_design
    from experiments.runs.against_none import said_against_none

    if not abs(windup) < 1e100:
        raise InputError(f"--windup is {windup:g}; expected a number of less than 1e100")
    if figure is not None:
        require_writable(figure, inputs=[design])
    content = read_design(design)
    said = f"{audit_text(content, audit(content), windup)}\n\n{said_against_none(content)}"
    if figure is not None:
        from paper_figures.look.audit_sheet import plot_audit
        from paper_figures.look.style import figure_writer

        write_whole({figure: figure_writer(plot_audit(content))}, inputs=[design])
    click.echo(said)


def _coefficients(text: str, option: str) -> list[float]:
    try:
        found = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        found = []
    if not any(found) or not all(map(isfinite, found)):
        raise InputError(f"--{option} is '{text}'; expected coefficients such as '1 2.5 3', not all 0")
    return found


def _finish(design: Design, model: str, output: Path, summary: str) -> None:
    from experiments.runs.against_none import said_against_none

    compared = said_against_none(design)
    text = replace(design, compared=tuple(compared.splitlines())).to_json()
    write_whole({output: text}, inputs=[Path(model)])
    click.echo(compared)
    click.echo(f"{design.kind} design -> {output}")
    click.echo(f"  {summary}")
    for name, each in design.anti_windup.items():
        judged = each.judgement
        sector = "any" if judged.popov_sector is None else lower_end(judged.popov_sector, 4)
        stable = "stable" if judged.theta2_stable else "NOT stable: saturation leaves a lasting offset"
        click.echo(f"  anti-windup {name:9s} f = {judged.f:.4g}, Popov sector {sector}, theta2 {stable}")
    click.echo(f"  guarantee of the corrected one: {design.corrected.guarantee}, {design.corrected.guarantee_said}")


def _on_the_plant_with_its_dead_time(design: Design) -> str:
    from design.stability.characteristic_roots import roots_right_of, unstable_roots
    from design.stability.margins import delay_loop

    if not design.plant.delay_s:
        return ""
    count, late = roots_right_of(delay_loop(design, design.plant), 0.0), f"{design.plant.delay_s:g} s"
    found = f"UNSTABLE ({unstable_roots(count)}): use the command extended" if count else "stable too"
    return f"\n  with the plant's dead time of {late}, which this design ignores, the loop is {found}"


if __name__ == "__main__":
    main(prog_name="python -m design")
