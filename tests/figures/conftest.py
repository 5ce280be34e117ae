"""What the tests of all figures share: where their texts stand, and what a figure is saved as."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from paper_figures.look import style

Extents = Callable[[Figure, Callable[[Figure], Iterable[Text]]], list[tuple[str, Bbox]]]
Saved = Callable[[Figure, str, str], dict[str, bytes]]


@pytest.fixture
def extents() -> Extents:
    """Each text that a function finds in a drawn figure, with its bounding box [in]; empty ones are left out."""

    def extents(figure: Figure, texts: Callable[[Figure], Iterable[Text]]) -> list[tuple[str, Bbox]]:
        canvas = FigureCanvasAgg(figure)
        with style.styled():
            canvas.draw()
            to_inches = figure.dpi_scale_trans.inverted()
            return [
                (text.get_text(), text.get_window_extent(canvas.get_renderer()).transformed(to_inches))
                for text in texts(figure)
                if text.get_text()
            ]

    return extents


@pytest.fixture
def saved(tmp_path: Path) -> Saved:
    """The bytes of each file that a figure is saved as, by the name of the file."""

    def saved(figure: Figure, name: str, caption: str) -> dict[str, bytes]:
        style.save(figure, tmp_path, name, caption)
        return {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    return saved
