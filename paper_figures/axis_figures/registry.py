"""The figures of a refit by their names."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Protocol, cast

import pandas as pd
from matplotlib.figure import Figure

from design.design_file import Design
from identification.base.errors import InputError

NAMES = ("nyquist", "sensitivity", "run", "anti_windups", "rates", "limits", "campaign")


class AxisFigure(Protocol):
    """What the module of a figure offers."""

    TABLES: tuple[str, ...]
    """Names of the tables it draws, files ``<name>.csv`` among the results."""

    def draw(self, design: Design, tables: Mapping[str, pd.DataFrame]) -> Figure:
        """Return the figure."""

    def caption(self, design: Design, tables: Mapping[str, pd.DataFrame]) -> str:
        """Return the caption."""


def axis_figure(name: str) -> AxisFigure:
    """Return the module that draws the named figure; raises InputError where there is none."""
    if name not in NAMES:
        raise InputError(f"{name}: no such figure; the figures are {', '.join(NAMES)}")
    return cast(AxisFigure, import_module(f"paper_figures.axis_figures.{name}"))
