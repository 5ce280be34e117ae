"""Draw the one page on a plant: tables and sentences around the panels of tests, model and bound."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.textpath import text_to_path

from identification.model.model_file import IdentifiedModel
from identification.sweeps.response import FrequencyResponse
from paper_figures.look import panels, style
from paper_figures.look.bode import draw_distance, draw_magnitude, draw_phase, draw_relative_distance
from paper_figures.look.frequency_axis import HERTZ
from paper_figures.summary.of_fit import Paragraph, Table, fitted
from paper_figures.summary.words import Summary

WIDTH, HEIGHT = 8.27, 11.69  # A4 [in]
MARGIN = 0.7  # [in]
HEADS = 0.95  # width of the column of the paragraphs' heads [in]
SIZES = (8.5, 8.0, 7.5, 7.0, 6.5, 6.0)  # of the letters [pt]; the first that leaves room for the panels is taken
LEAST, MOST = 3.4, 5.8  # height of the panels with what stands around them [in]
LINE = 1.3 / 72  # height of a line for each pt of its letters [in]
HINTED = 1.05  # width of letters fitted to the pixels of a PNG, to that of the same letters in the PDF: up to this
BOLD = 1.1  # width of bold letters to that of others
SPACE = 0.25  # width of a space, of the letters' size
GAP = 0.3  # widest between the columns of a table [in]
SYNTHETIC = "#D55E00"
SMALL = 7.0  # of the panels' keys [pt]

SYMBOLS = {
    "omega": r"$\omega$",
    "zeta": r"$\zeta$",
    "alpha": r"$\alpha$",
    "beta": r"$\beta$",
    "gamma": r"$\gamma$",
    "theta1~": r"$\tilde{\theta}_1$",
    "theta2": r"$\theta_2$",
    "W_a": "$W_a$",
    "T_so": "$T_{so}$",
}
SYMBOL = re.compile(rf"(?<![\w.-])({'|'.join(map(re.escape, SYMBOLS))})(?!\w|[.-]\w)")


@dataclass(frozen=True)
class Piece:
    """Text that begins, or ends, so many inches right of the margin."""

    x: float
    text: str
    align: str = "left"
    weight: str = "normal"
    color: str = "black"


@dataclass(frozen=True)
class Block:
    """Lines of letters of one size [pt], and the lines above which there is a rule."""

    size: float
    lines: tuple[tuple[Piece, ...], ...]
    rules: tuple[int, ...] = ()

    @property
    def height(self) -> float:
        """Height in inches, with half a line below."""
        return (len(self.lines) + 0.5) * LINE * self.size if self.lines else 0.0


@style.styled()
def draw(summary: Summary, model: IdentifiedModel, tests: Sequence[FrequencyResponse]) -> Figure:
    """Return the page, A4.

    Parameters
    ----------
    summary
        Its words and numbers.
    model, tests
        The plant with its bound, and the responses that it was fitted to.
    """
    for size in SIZES:
        above = [_heading(summary, size), _paragraphs(summary.advice, size), _table(summary.parameters, size)]
        above.append(_paragraphs(summary.basis, size))
        below = [_table(summary.runs, size)] if summary.runs else []
        below.append(_paragraphs((*summary.designs, *summary.refused), size))
        room = HEIGHT - 2 * MARGIN - sum(block.height for block in (*above, *below))
        if room >= LEAST:
            break
    figure = style.figure(WIDTH, HEIGHT)
    figure.set_layout_engine("none")
    y = HEIGHT - MARGIN
    for block in above:
        y = _print(figure, block, y)
    room = min(room, MOST)
    _panels(figure, model, tests, y, y - room)
    y -= room
    for block in below:
        y = _print(figure, block, y)
    return figure


def _panels(
    figure: Figure, model: IdentifiedModel, tests: Sequence[FrequencyResponse], top: float, bottom: float
) -> None:
    grid = figure.add_gridspec(
        2,
        2,
        left=(MARGIN + 0.45) / WIDTH,
        right=1 - MARGIN / WIDTH,
        top=(top - 0.2) / HEIGHT,
        bottom=(bottom + 0.5) / HEIGHT,
        wspace=0.2,
        hspace=0.2,
    )
    places = [grid[row, column] for row in range(2) for column in range(2)]
    magnitude, distance, phase, relative = map(figure.add_subplot, places)
    draw_magnitude(magnitude, model, tests)
    draw_phase(phase, model, tests)
    touches_omega = [touch.omega for touch in fitted(model).bound.touches]
    draw_distance(distance, model, tests, touches_omega)
    draw_relative_distance(relative, model, tests)
    for panel in (magnitude, distance):
        panel.tick_params(labelbottom=False, which="both")
    for panel in figure.axes:
        panel.yaxis.label.set_fontsize(SMALL)
    for panel in (phase, relative):
        panel.set_xlabel(HERTZ)
    for panel in (magnitude, distance, relative):  # the phase has the lines of the magnitude
        for line in panel.legend(ncols=4, fontsize=SMALL, **panels.ABOVE).get_lines():
            line.set_markersize(4)
    figure.align_ylabels()
    style.panel_letters((magnitude, phase, distance, relative))


def _heading(summary: Summary, size: float) -> Block:
    broken = _broken(summary.title, (WIDTH - 2 * MARGIN) / BOLD, size + 1)
    lines = [(Piece(0, line, weight="bold"),) for line in broken]
    if summary.synthetic:
        lines.append((Piece(0, summary.synthetic, weight="bold", color=SYNTHETIC),))
    return Block(size + 1, tuple(lines))


def _table(table: Table, size: float) -> Block:
    """The table, its letters smaller where it would be wider than the page."""
    columns = list(zip(table.head, *table.rows, strict=True))
    widths = [max(_width(cell, size) for cell in column) for column in columns]
    share = min(1.0, (WIDTH - 2 * MARGIN) / (sum(widths) + (len(widths) - 1) * size / 72))
    widths = [share * width for width in widths]
    gap = min(GAP, (WIDTH - 2 * MARGIN - sum(widths)) / max(len(widths) - 1, 1))
    ends = [sum(widths[: i + 1]) + i * gap for i in range(len(widths))]
    lines = [
        tuple(
            Piece(end if i else 0.0, cell, "right" if i else "left")
            for i, (end, cell) in enumerate(zip(ends, row, strict=True))
        )
        for row in (table.head, *table.rows)
    ]
    return Block(share * size, tuple(lines), (0, 1, len(lines)))


def _paragraphs(paragraphs: Sequence[Paragraph], size: float) -> Block:
    """Heads at the left, and beside each its sentences, broken into lines."""
    lines: list[tuple[Piece, ...]] = []
    for head, sentences in paragraphs:
        broken = _broken(sentences, WIDTH - 2 * MARGIN - HEADS, size)
        lines.append((Piece(0, head, weight="bold"), Piece(HEADS, broken[0])))
        lines += [(Piece(HEADS, line),) for line in broken[1:]]
    return Block(size, tuple(lines))


def _broken(text: str, width: float, size: float) -> list[str]:
    """Break a text into lines no wider than so many inches, but for words that are wider themselves."""
    lines: list[str] = []
    used = width
    for word in text.split():
        step = SPACE * size / 72 + _width(word, size)
        if used + step > width:
            lines.append(word)
            used = step - SPACE * size / 72
        else:
            lines[-1] += f" {word}"
            used += step
    return lines


@cache
def _width(text: str, size: float) -> float:
    """Width in inches of a text as it is printed."""
    printed = _typeset(text)
    font = FontProperties(size=size)
    width = text_to_path.get_text_width_height_descent(printed, font, ismath="$" in printed)[0]
    return HINTED * float(width) / 72


def _typeset(text: str) -> str:
    """Symbols for the words that name them."""
    plain = text.replace("$", r"\$").replace("+-", r"$\pm$").replace(")^2", ")$^2$")
    return SYMBOL.sub(lambda found: SYMBOLS[found[0]], plain)


def _print(figure: Figure, block: Block, top: float) -> float:
    """Print a block below a height in inches and return the height below it."""
    step = LINE * block.size
    for number, line in enumerate(block.lines):
        for piece in line:
            figure.text(
                (MARGIN + piece.x) / WIDTH,
                (top - (number + 0.75) * step) / HEIGHT,
                _typeset(piece.text),
                ha=piece.align,
                weight=piece.weight,
                color=piece.color,
                fontsize=block.size,
            )
    for number in block.rules:
        height = (top - number * step) / HEIGHT
        figure.add_artist(Line2D([MARGIN / WIDTH, 1 - MARGIN / WIDTH], [height, height], color="black", linewidth=0.5))
    return top - block.height
