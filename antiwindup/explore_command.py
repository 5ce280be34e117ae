"""``antiwindup explore``: a design on a local page, to play with."""

from __future__ import annotations

from itertools import chain, count
from pathlib import Path

import click

from experiments.options import DESIGN, asked_limits, sinusoid_options
from experiments.pair_options import NumberPair, PairCommand
from identification.base.axis_option import AXIS
from identification.base.files import is_there, require_writable
from identification.base.path_types import OUTPUT_FILE


@click.command("explore", cls=PairCommand)
@AXIS
@DESIGN
@click.option(
    "--limit",
    type=NumberPair(),
    metavar="[LOW] HIGH",
    help="Saturation limits when the page opens. Default: 1.2 times the control that the reference needs.",
)
@sinusoid_options
@click.option("--port", type=click.IntRange(1024, 65535), help="Port on 127.0.0.1. Default: a free one.")
@click.option("--no-browser", is_flag=True, help="Do not open a browser. The address is always printed.")
@click.option(
    "--output",
    type=OUTPUT_FILE,
    help="File that the button 'save' writes. Default: a new name beside DESIGN. DESIGN itself is never replaced.",
)
def explore(
    design: Path,
    limit: tuple[float, ...] | None,
    amplitude: tuple[float, ...],
    phase: tuple[float, ...],
    offset: float | None,
    port: int | None,
    no_browser: bool,
    output: Path | None,
) -> None:
    """Open a local page with sliders for DESIGN.

    The page shows a run, the Nyquist plot, the step response and the audit. It redraws the curves while you drag a
    slider, and the audit once the slider rests. Only this machine can open it, and Ctrl-C ends it. Its address holds
    the positions of the sliders: a copy of the address opens the same page as long as the command runs. "save" writes
    the design that is shown as design.json. Without an amplitude the page begins with sinusoids of amplitude 1 at
    their crests.
    """
    import webbrowser

    from tqdm import tqdm

    from design.design_file import read_design
    from experiments.asked_reference import sinusoids
    from paper_figures.explore.server import bound, serve
    from paper_figures.explore.state import start_of

    if output is not None:
        require_writable(output, inputs=[design])
    content = read_design(design)
    reference = sinusoids(content, amplitude, phase, offset) if amplitude or phase or offset else None
    start = start_of(content, None if limit is None else asked_limits(limit), reference)

    def tell(address: str) -> None:
        click.echo(address, err=True)  # at once: what a command prints appears when it is done
        if not no_browser:
            webbrowser.open(address)

    with tqdm(bar_format="Ctrl-C ends it", disable=None, leave=False):
        serve(content, start, design, output or _new_name(design), bound(port or 0), tell)


def _new_name(design: Path) -> Path:
    numbers = chain([""], (f"_{number}" for number in count(2)))
    return next(
        path
        for number in numbers
        if not is_there(path := design.with_name(f"{design.stem}_explored{number}{design.suffix}"))
    )
