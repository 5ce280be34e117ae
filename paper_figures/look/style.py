"""The look of every figure: sizes, the meaning of each line, and files of the same bytes on every run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from itertools import count
from pathlib import Path
from typing import Any

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from identification.base.errors import printable_lines
from identification.base.files import write_whole

COLUMN_WIDTH = 3.4
"""Width of a figure that fills one column [in]."""

FULL_WIDTH = 6.5
"""Width of a figure that fills the page [in]."""

STYLE_FILE = Path(__file__).with_name("figures.mplstyle")

LINES: dict[str, dict[str, Any]] = {
    "reference": {"color": "#000000", "linestyle": (0, (4, 2)), "linewidth": 0.7},
    "measured": {"color": "#56B4E9", "linestyle": "none", "marker": "o", "markersize": 2.5},
    "model": {"color": "#000000", "linestyle": "-", "linewidth": 1.2},
    "without anti-windup": {"color": "#D55E00", "linestyle": (0, (5, 1.5)), "linewidth": 1.2},
    "thesis anti-windup": {"color": "#0072B2", "linestyle": "-", "linewidth": 1.0},
    "best of the thesis's form": {"color": "#0072B2", "linestyle": (0, (2.5, 1.2)), "linewidth": 1.0},
    "corrected anti-windup": {"color": "#009E73", "linestyle": "-", "linewidth": 1.9},
    "back-calculation": {"color": "#E69F00", "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.2},
    "conditioning": {"color": "#CC79A7", "linestyle": "-", "linewidth": 1.0},
    "observer": {"color": "#56B4E9", "linestyle": (0, (3, 1)), "linewidth": 1.2},
    "internal model": {"color": "#7F7F7F", "linestyle": "-", "linewidth": 1.0},
    "Weston and Postlethwaite": {"color": "#000000", "linestyle": "-", "linewidth": 1.2},
    "static": {"color": "#4D4D4D", "linestyle": (0, (1, 1.2)), "linewidth": 1.4},
    "saturation limits": {"color": "#000000", "linestyle": (0, (1, 2)), "linewidth": 0.7},
    "bound": {"color": "#CC79A7", "linestyle": (0, (7, 2, 1.5, 2)), "linewidth": 1.6},
    "second-order Pade": {"color": "#E69F00", "linestyle": "-", "linewidth": 0.8},
    "family 1": {"color": "#4D4D4D", "linestyle": "-", "linewidth": 2.0},
    "family 2": {"color": "#4D4D4D", "linestyle": (0, (6, 2)), "linewidth": 1.0},
    "family 3": {"color": "#4D4D4D", "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.0},
    "family 4": {"color": "#7F7F7F", "linestyle": "-", "linewidth": 0.8},
    "family 5": {"color": "#7F7F7F", "linestyle": (0, (3, 1.5)), "linewidth": 1.0},
    "family 6": {"color": "#7F7F7F", "linestyle": (0, (1, 1.2)), "linewidth": 1.2},
}
"""The style of each kind of line, as keywords of ``Axes.plot``.

The family is one function at several values of a parameter, the first of them the chosen value.
"""

FAMILY = [name for name in LINES if name.startswith("family")]
"""The entries of the family, in the order of its values."""

_METADATA: dict[str, dict[str, None]] = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "ModDate": None},
    "svg": {"Date": None},
}


@contextmanager
def styled() -> Iterator[None]:
    """Put the style in force for a ``with`` block, or for a function as the decorator ``@styled()``.

    The user's own settings are set aside: the style starts from Matplotlib's defaults.
    """
    with matplotlib.style.context(["default", STYLE_FILE]):
        yield


@styled()
def figure(width: float, height: float) -> Figure:
    """Return an empty figure of print size that no window or global state knows of.

    Parameters
    ----------
    width, height
        Size on the page [in].

    Notes
    -----
    Axes take their fonts from the style in force when they are added, so a drawing function as a whole
    is decorated with :func:`styled`.
    """
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)  # which measures a text once, for the layout and for PNG
    return figure


def panel_letters(axes: Iterable[Axes]) -> None:
    """Write (a), (b), ... above the top left corner of each of the axes, in their order."""
    for number, panel in zip(count(ord("a")), axes, strict=False):
        panel.annotate(
            f"({chr(number)})",
            xy=(0, 1),
            xycoords="axes fraction",
            xytext=(0, 3),
            textcoords="offset points",
            fontsize=9,
            ha="left",
            va="bottom",
        )


def rendered(figure: Figure, folder: Path, name: str, caption: str) -> dict[Path, bytes]:
    """The figure as PDF, SVG and PNG and its caption as text, by the paths of the files that shall hold them.

    Control characters, which no SVG may have, are written as Python escapes them.

    Parameters
    ----------
    figure
        The figure, which is laid out once, so that the three files show it alike; rendered again it gives the same
        bytes.
    folder, name
        Where the files shall lie, and their name without suffix.
    caption
        The caption, paragraphs of printable text.
    """
    files = {folder / f"{name}.txt": f"{printable_lines(caption)}\n".encode()}
    _lay_out(figure)
    return files | {folder / f"{name}.{kind}": _rendered_as(figure, kind) for kind in _METADATA}


def figure_writer(figure: Figure) -> Callable[[Path], object]:
    """What writes a figure, as PDF, SVG or PNG by the suffix of the path, the same bytes from run to run."""
    _lay_out(figure)
    return lambda path: path.write_bytes(_rendered_as(figure, path.suffix[1:].lower()))


def _lay_out(figure: Figure) -> None:
    """Escape what does not print, and place the panels; Matplotlib itself would draw all that it saves once more."""
    for text in figure.findobj(Text):
        if (escaped := printable_lines(text.get_text())) != text.get_text():
            text.set_text(escaped)
    with styled():
        if (engine := figure.get_layout_engine()) is not None:
            engine.execute(figure)
        figure.set_layout_engine()  # none any more


def _rendered_as(figure: Figure, kind: str) -> bytes:
    with styled():
        figure.savefig(written := BytesIO(), format=kind, metadata=_METADATA[kind])
    return written.getvalue()


def write(files: Mapping[Path, bytes]) -> None:
    """Write what :func:`rendered` gave: all files, or none.

    Raises
    ------
    InputError
        A folder does not exist or may not be written to.
    """
    write_whole(files)
