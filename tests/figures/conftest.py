"""What the tests of all figures share: where their texts stand, and that they are drawn the same twice."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from io import BytesIO

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from paper_figures.look import style

AsPdf = Callable[[Figure], bytes]
Extents = Callable[[Figure, Callable[[Figure], Iterable[Text]]], list[tuple[str, Bbox]]]


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
def as_pdf() -> AsPdf:
    """The bytes of a figure's PDF, which takes finite numbers only."""

    def as_pdf(figure: Figure) -> bytes:
        written = BytesIO()
        with style.styled():
            figure.savefig(written, format="pdf", metadata={"CreationDate": None, "ModDate": None})
        return written.getvalue()

    return as_pdf
