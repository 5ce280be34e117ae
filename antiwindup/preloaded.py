"""What the steps of a build have loaded as they begin: imported once, by the process that they are forked from.

So that they have the fonts too, it draws a first figure.
"""

from __future__ import annotations

import gc
from importlib import import_module
from pathlib import Path

from paper_figures.look import style

PACKAGES = ("flint", "jinja2", "matplotlib.backends.backend_agg", "scipy.optimize", "scipy.signal", "scipy.stats")
MODULES = (
    *("identification.__main__", "identification.fit_model", "design.__main__", "design.chapters_3_4.design_extended"),
    *("experiments.__main__", "experiments.runs.batch", "experiments.tables"),
    *("paper_figures.__main__", "paper_figures.look.captions", "paper_figures.result_tables"),
)
"""Modules of ours that most steps import, with what they import themselves."""


@style.styled()
def _draw() -> None:
    figure = style.figure(1.0, 1.0)
    figure.add_subplot(title="$x^2$", xscale="log", yscale="log").plot([1.0, 10.0], [1.0, 10.0])
    style.rendered(figure, Path(), "first", "")


for name in (*PACKAGES, *MODULES):
    import_module(name)
_draw()
gc.freeze()  # what is here already the forked processes need not look at, and so not copy
