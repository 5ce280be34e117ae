"""What the tests of figures and pages share: where texts stand, that they are drawn the same twice, a browser."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from io import BytesIO

import pytest
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from playwright.sync_api import Browser, sync_playwright

from paper_figures.look import style

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")

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
    """The bytes of a figure's PDF, which takes finite numbers only; without its texts, which take most of the time."""

    def as_pdf(figure: Figure) -> bytes:
        written = BytesIO()
        figure.set_layout_engine("none")
        for axis in figure.findobj(Axis):
            axis.get_ticklabels(which="both")  # that they are found and named, whatever the view
        for artist in figure.findobj(lambda artist: isinstance(artist, Axis | Legend | Text)):
            artist.set_visible(False)
        with style.styled():
            figure.savefig(written, format="pdf", metadata={"CreationDate": None, "ModDate": None})
        return written.getvalue()

    return as_pdf


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        said = f"none of {', '.join(NAMES)} is on the PATH; install one of them, such as Debian's package chromium"
        pytest.fail(said) if os.environ.get("CI") else pytest.skip(said)
    with sync_playwright() as playwright:
        root = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
        browser = playwright.chromium.launch(executable_path=path, args=root)
        yield browser
        browser.close()
