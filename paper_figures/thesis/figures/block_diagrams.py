"""What the block diagrams share: blocks, junctions and signals, laid out in inches of the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from matplotlib.figure import Figure
from schemdraw import Drawing
from schemdraw.elements import Element
from schemdraw.segments import Segment, SegmentCircle, SegmentText
from schemdraw.types import Halign, Linestyle, Valign

from paper_figures.look import style

Point = tuple[float, float]

BLOCK_HEIGHT = 0.36
SYMBOL_WIDTH = 0.44
JUNCTION_RADIUS = 0.075

_TEXT_SIZE = 9
_SIGN_SIZE = 8
_LINE = 0.8
_THIN = 0.5
_LABEL_OFFSET = 0.065
_SIGN_OFFSETS = {"W": (-0.15, 0.12), "E": (0.15, 0.12), "N": (0.12, 0.15), "S": (0.12, -0.15)}


@dataclass(frozen=True)
class Node:
    """A block or junction on the page: its centre and half its width and height [in]."""

    x: float
    y: float
    half_width: float
    half_height: float

    @property
    def west(self) -> Point:
        """Middle of the left side."""
        return self.x - self.half_width, self.y

    @property
    def east(self) -> Point:
        """Middle of the right side."""
        return self.x + self.half_width, self.y

    @property
    def north(self) -> Point:
        """Middle of the upper side."""
        return self.x, self.y + self.half_height

    @property
    def south(self) -> Point:
        """Middle of the lower side."""
        return self.x, self.y - self.half_height


class Diagram:
    """A block diagram under construction; coordinates are inches from the lower left corner of the figure.

    Parameters
    ----------
    width, height
        Size on the page [in].
    """

    def __init__(self, width: float, height: float) -> None:
        self._size = (width, height)
        self._drawing = Drawing(show=False)

    def block(self, x: float, y: float, label: str, width: float, height: float = BLOCK_HEIGHT) -> Node:
        """Add a rectangle centred on (x, y) with its transfer function inside."""
        self._add(_rectangle(x, y, width, height), _text(x, y, label, ("center", "center")))
        return Node(x, y, width / 2, height / 2)

    def saturation(self, x: float, y: float) -> Node:
        """Add a block with the graph of the saturation."""
        return self._symbol(x, y, [(-1, -0.75), (-0.45, -0.75), (0.45, 0.75), (1, 0.75)])

    def dead_zone(self, x: float, y: float) -> Node:
        """Add a block with the graph of the dead zone."""
        return self._symbol(x, y, [(-1, -0.8), (-0.4, 0), (0.4, 0), (1, 0.8)])

    def junction(self, x: float, y: float, signs: Mapping[str, str]) -> Node:
        """Add a summing junction.

        Parameters
        ----------
        x, y
            Centre [in].
        signs
            For each side a signal enters by ("N", "E", "S" or "W"), "+" or "-".
        """
        marks = [
            _text(x + dx, y + dy, f"${signs[side]}$", ("center", "center"), _SIGN_SIZE)
            for side, (dx, dy) in _SIGN_OFFSETS.items()
            if side in signs
        ]
        self._add(SegmentCircle((x, y), JUNCTION_RADIUS, lw=_LINE), *marks)
        return Node(x, y, JUNCTION_RADIUS, JUNCTION_RADIUS)

    def branch(self, x: float, y: float) -> Point:
        """Add the dot where a signal divides, and return it."""
        self._add(SegmentCircle((x, y), 0.024, fill="black", lw=_THIN))
        return x, y

    def connect(self, *points: Point) -> None:
        """Lead a signal through the points, with an arrowhead at the last one."""
        self._add(Segment(points, lw=_LINE, arrow="->", arrowwidth=0.075, arrowlength=0.1, joinstyle="miter"))

    def signal(self, x: float, y: float, label: str) -> None:
        """Name the horizontal signal that runs through (x, y); the name stands above it."""
        self._add(_text(x, y + _LABEL_OFFSET, label, ("center", "base")))

    def signal_beside(self, x: float, y: float, label: str) -> None:
        """Name the vertical signal that runs through (x, y); the name stands to its right."""
        self._add(_text(x + _LABEL_OFFSET, y, label, ("left", "center")))

    def outline(self, lower_left: Point, upper_right: Point, label: str) -> None:
        """Put a dashed frame around part of the diagram, its name inside the upper left corner."""
        (left, bottom), (right, top) = lower_left, upper_right
        frame = _rectangle((left + right) / 2, (bottom + top) / 2, right - left, top - bottom, _THIN, "--")
        self._add(frame, _text(left + 0.06, top - 0.05, label, ("left", "top")))

    @style.styled()
    def figure(self) -> Figure:
        """Return the finished diagram as a figure."""
        width, height = self._size
        figure = style.figure(width, height)
        figure.set_layout_engine("none")
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        self._drawing.draw(show=False, canvas=axes)
        axes.set_xlim(0, width)
        axes.set_ylim(0, height)
        return figure

    def _symbol(self, x: float, y: float, graph: list[Point]) -> Node:
        """Add a block holding thin axes and a graph given in units of the axes' half lengths."""
        half_x, half_y = 0.38 * SYMBOL_WIDTH, 0.38 * BLOCK_HEIGHT
        self._add(
            _rectangle(x, y, SYMBOL_WIDTH, BLOCK_HEIGHT),
            Segment([(x - half_x, y), (x + half_x, y)], lw=_THIN, color="0.5"),
            Segment([(x, y - half_y), (x, y + half_y)], lw=_THIN, color="0.5"),
            Segment([(x + half_x * across, y + half_y * up) for across, up in graph], lw=1.2),
        )
        return Node(x, y, SYMBOL_WIDTH / 2, BLOCK_HEIGHT / 2)

    def _add(self, *segments: Segment | SegmentCircle | SegmentText) -> None:
        element = Element()
        element.segments.extend(segments)
        self._drawing.add(element.at((0, 0)).theta(0))


def _rectangle(
    x: float, y: float, width: float, height: float, line: float = _LINE, dashes: Linestyle = "-"
) -> Segment:
    left, right, bottom, top = x - width / 2, x + width / 2, y - height / 2, y + height / 2
    outline = [(x, bottom), (right, bottom), (right, top), (left, top), (left, bottom), (x, bottom)]
    return Segment(outline, lw=line, ls=dashes, joinstyle="miter", capstyle="butt")


def _text(x: float, y: float, label: str, align: tuple[Halign, Valign], size: float = _TEXT_SIZE) -> SegmentText:
    return SegmentText((x, y), label, align=align, fontsize=size, font="STIXGeneral", mathfont="stix")
