"""The figures of the thesis by their names."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from importlib import import_module
from typing import Protocol, cast

import pandas as pd
from matplotlib.figure import Figure

from identification.base.errors import InputError
from paper_figures.thesis import figures


class FigureModule(Protocol):
    """What a module ``fig_x_yy`` offers."""

    TABLES: tuple[str, ...]
    """Names of the tables it draws, files ``<name>.csv`` among the results."""

    def draw(self, tables: Mapping[str, pd.DataFrame]) -> Figure:
        """Return the figure."""

    def caption(self, tables: Mapping[str, pd.DataFrame]) -> str:
        """Return the caption."""


def figure_names() -> list[str]:
    """Return the names of all figures, in the order of the thesis."""
    return sorted(module.name for module in pkgutil.iter_modules(figures.__path__) if module.name.startswith("fig_"))


def figure_module(name: str) -> FigureModule:
    """Return the module that draws the named figure.

    Raises
    ------
    InputError
        There is no such figure.
    """
    if name not in figure_names():
        raise InputError(f"{name}: no such figure; the figures are {', '.join(figure_names())}")
    return cast(FigureModule, import_module(f"{figures.__name__}.{name}"))
