"""What the audit of a design says, drawn on one sheet."""

from __future__ import annotations

from matplotlib.figure import Figure

from design.design_file import Design
from design.stability.characteristic_roots import roots_right_of, unstable_roots
from design.stability.margins import delay_loop
from identification.base.errors import InputError
from paper_figures.look.nyquist import draw_nyquist
from paper_figures.look.sensitivity import draw_sensitivity
from paper_figures.look.style import FULL_WIDTH, panel_letters, styled


@styled()
def plot_audit(design: Design) -> Figure:
    """Draw the Nyquist curve of a design and its sensitivities, :func:`draw_nyquist` and :func:`draw_sensitivity`.

    The title says which design it is, and whether its loop is unstable.
    """
    figure = Figure(figsize=(FULL_WIDTH, 8.0), layout="constrained")
    curve, magnitudes = figure.subplots(2, 1, height_ratios=(1.75, 1))
    draw_nyquist(curve, design)
    draw_sensitivity(magnitudes, design)
    panel_letters((curve, magnitudes))
    without = ", for the plant without its dead time" if design.loop_plant != design.plant else ""
    figure.suptitle(f"{design.kind} design{without}{_instability(design)}")
    return figure


def _instability(design: Design) -> str:
    try:
        count = roots_right_of(delay_loop(design, design.loop_plant), 0.0)
    except InputError:
        return ": a root of the loop is on the imaginary axis, within rounding errors"
    return f": UNSTABLE, {unstable_roots(count)}" if count else ""
