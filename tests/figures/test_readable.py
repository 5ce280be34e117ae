"""Every figure of the thesis can be read: measured on what it draws of the stored tables.

No line is a smear or a polygon, no text lies on another one, the data fill their axes, each axis has its unit, and the
lines of a panel can be told apart, also by who sees no difference between red and green.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from functools import cache
from itertools import combinations
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from paper_figures.look import panels as looks
from paper_figures.look import style
from paper_figures.thesis.figure_registry import figure_module, figure_names

sys.path.append(str(Path(__file__).parents[1] / "snapshots"))
from test_figure_data import draw_stored, tables_stored

MOST_POINTS = 5000
FULL = 0.9
"""Of the points of a table, or of the pixel columns if they are fewer, so many are drawn in what is seen."""
STRAIGHT, TURN = 0.12, 10.0
"""Two pieces of a line longer than this share of the panel that turn by more degrees make a polygon."""
PASSES, BESIDE, SWING = 6.0, 5.0, 0.06
"""A line that goes so many times up or down its range in so many points of the page is a smear; a range of a smaller
share of the panel only makes it look broader."""
NARROW = 5.0
"""Pixels: a narrower peak is one."""
TOUCHING = 1.0
"""Pixels by which boxes of texts may overlap."""
USED = {"x": 0.6, "y": 0.4}
"""Share of an axis that the data in it span at least."""
APART = 10.0
"""Distance in CIELAB of two colours that are told apart."""
BROADER = 1.7
"""Times the width of one line is that of another that is told apart by it."""
WORDS = 90
UNIT = re.compile(r"\[[^\[\]]+\]")

DEUTERANOPE = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
"""Linear RGB as it is seen without green cones: Machado, Oliveira and Fernandes (2009), severity 1."""

each_figure = pytest.mark.parametrize("name", figure_names())


@cache
def figure(name: str) -> Figure:
    """The figure, laid out."""
    drawing = draw_stored(name)
    with style.styled():
        drawing.draw_without_rendering()
    return drawing


def panels(name: str) -> list[Axes]:
    """Its panels with axes; block diagrams have none."""
    return [panel for panel in figure(name).axes if panel.axison]


def curves(panel: Axes) -> Iterator[tuple[Line2D, np.ndarray]]:
    """The lines of data with their points in pixels; NaN where there is none."""
    for line in panel.lines:
        if line.get_transform() == panel.transData and line.get_visible() and len(line.get_xdata(orig=False)):
            with np.errstate(all="ignore"):
                yield line, panel.transData.transform(np.ma.filled(np.ma.asarray(line.get_xydata(), float), np.nan))


def within(panel: Axes, points: np.ndarray) -> np.ndarray:
    """Which points lie in the panel."""
    box = panel.bbox.padded(0.5)
    return np.asarray(
        (points[:, 0] >= box.x0) & (points[:, 0] <= box.x1) & (points[:, 1] >= box.y0) & (points[:, 1] <= box.y1)
    )


def is_joined(line: Line2D) -> bool:
    """Whether a line joins its points, and does not show them."""
    return line.get_linestyle() != "None" and line.get_marker() in ("None", "", None)


@each_figure
def test_a_line_has_a_point_in_every_pixel_column_for_which_there_is_one(name: str) -> None:
    columns = [
        table[column].to_numpy(float)
        for table in tables_stored(name).values()
        for column in table
        if pd.api.types.is_numeric_dtype(table[column])
        and table[column].is_monotonic_increasing
        and table[column].is_unique
    ]
    for panel in panels(name):
        low, high = sorted(panel.get_xlim())
        for line, points in curves(panel):
            x = np.asarray(line.get_xdata(), float)
            assert len(x) <= MOST_POINTS, f"{line} has {len(x)} points"
            for column in columns:
                if is_joined(line) and np.isin(x, column).all():
                    shown = column[(column >= max(low, x.min())) & (column <= min(high, x.max()))]
                    drawn = x[(x >= low) & (x <= high)]
                    pixels = float(
                        np.nanmax(points[:, 0].clip(*panel.bbox.intervalx))
                        - np.nanmin(points[:, 0].clip(*panel.bbox.intervalx))
                    )
                    assert len(drawn) >= FULL * min(len(shown), pixels), (
                        f"{line} shows {len(drawn)} of {len(shown)} points in {pixels:.0f} columns"
                    )


def passes(panel: Axes, points: np.ndarray) -> float:
    """How often a line goes up or down its range within a strip of the panel, at most; a small range does not count."""
    (x, y), (low, high) = points[np.isfinite(points).all(axis=1)].T, panel.bbox.intervaly
    y = np.clip(y, low, high)
    strip = np.floor(x / (BESIDE * panel.figure.dpi / 72)).astype(int)
    starts = np.flatnonzero(np.diff(strip, prepend=strip[:1] - 1))
    swing = np.maximum.reduceat(y, starts) - np.minimum.reduceat(y, starts)
    travel = np.add.reduceat(np.abs(np.diff(y, append=y[-1])) * (np.diff(strip, append=strip[-1]) == 0), starts)
    large = swing > SWING * (high - low)
    return float(np.max(travel[large] / swing[large], initial=0.0))


@each_figure
def test_no_line_is_a_smear(name: str) -> None:
    for panel in panels(name):
        for line, points in curves(panel):
            if is_joined(line):
                assert passes(panel, points) < PASSES, f"{line} goes up and down {passes(panel, points):.0f} times"


def test_a_line_that_swings_fast_is_a_smear_unless_its_range_is_drawn() -> None:
    """Twenty swings fill a strip; of a sinusoid of few cycles a strip holds part of one."""
    time = pd.Series(np.linspace(0, 1, 20001))
    with style.styled():
        _, (raw, drawn, slow) = plt.subplots(3)
        fast = np.sin(2000 * np.pi * time)
        raw.plot(time, fast)
        looks.draw(drawn, time, [looks.Trace(fast, style.LINES["model"], "y")], 1.0)
        slow.plot(time, np.sin(20 * np.pi * time))
        found = [
            max((passes(panel, points) for _, points in curves(panel)), default=0.0) for panel in (raw, drawn, slow)
        ]
        plt.close()
    assert found[0] > PASSES
    assert max(found[1:]) < PASSES / 2


@each_figure
def test_no_line_is_a_polygon(name: str) -> None:
    for panel in panels(name):
        for line, points in curves(panel):
            if not is_joined(line) or line.get_drawstyle() != "default":
                continue
            step = np.diff(points, axis=0)
            long = np.hypot(*(step / [panel.bbox.width, panel.bbox.height]).T) > STRAIGHT
            heading = np.degrees(np.arctan2(step[:, 1], step[:, 0]))
            turn = np.abs((np.diff(heading) + 180) % 360 - 180)
            corner = long[:-1] & long[1:] & (turn > TURN) & within(panel, points[1:-1])
            corner &= points[2:, 0] - points[:-2, 0] > NARROW
            upright = np.isin(np.round(np.abs(heading)), (0, 90))  # steps of a distribution
            corner &= ~(upright[:-1] & upright[1:])
            assert not corner.any(), f"{line} turns by {turn[corner].max():.0f} degrees between long straight pieces"


def boxes(drawing: Figure) -> list[tuple[str, Bbox]]:
    """What is written, with its box in pixels: letters, names and numbers of axes, texts, whole keys."""
    found = []
    for panel in drawing.axes:
        keys = [panel.get_legend()] if panel.get_legend() else []
        texts = [panel.title, *panel.texts]
        if panel.axison:
            texts += [panel.xaxis.label, panel.yaxis.label]
            for axis, (low, high) in ((panel.xaxis, sorted(panel.get_xlim())), (panel.yaxis, sorted(panel.get_ylim()))):
                ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
                texts += [tick.label1 for tick in ticks if tick.label1.get_visible() and low <= tick.get_loc() <= high]
        found += [(text.get_text(), text.get_window_extent()) for text in texts if text.get_text()]
        found += [(str([text.get_text() for text in key.get_texts()]), key.get_window_extent()) for key in keys]
    return found


@each_figure
def test_no_text_lies_on_another_and_all_are_on_the_page(name: str) -> None:
    drawing = figure(name)
    for (first, one), (second, other) in combinations(boxes(drawing), 2):
        common = Bbox.intersection(one, other)
        assert common is None or min(common.width, common.height) <= TOUCHING, f"{first!r} lies on {second!r}"
    for said, box in boxes(drawing):
        page = drawing.bbox.padded(TOUCHING)
        is_whole = page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1
        assert is_whole, f"{said!r} is cut"


@each_figure
def test_the_data_use_their_axes(name: str) -> None:
    for panel in panels(name):
        points = [points[within(panel, points)] for _, points in curves(panel)]
        points += [
            panel.transData.transform(path.vertices)
            for artist in (*panel.collections, *panel.patches)
            for path in (artist.get_paths() if hasattr(artist, "get_paths") else [artist.get_path()])
        ]
        seen = np.concatenate(points)
        seen = np.clip(seen[np.isfinite(seen).all(axis=1)], panel.bbox.min, panel.bbox.max)
        for k, (which, size) in enumerate((("x", panel.bbox.width), ("y", panel.bbox.height))):
            assert np.ptp(seen[:, k]) >= USED[which] * size, f"{which} of {panel}: {np.ptp(seen[:, k]) / size:.2f}"


def is_named(panel: Axes, axis: Axis) -> bool:
    """Whether an axis that has numbers says their unit, by its name or by that of its neighbour with the same view."""
    names = all(re.search("[a-z]", label.get_text().replace("mathdefault", "")) for label in axis.get_majorticklabels())
    numbers = axis.get_tick_params()["labelbottom" if axis.axis_name == "x" else "labelleft"] and len(
        axis.get_majorticklocs()
    )
    if names or not numbers or UNIT.search(axis.label.get_text()):
        return True
    beside = [other for other in panel.figure.axes if other is not panel and other.get_ylim() == panel.get_ylim()]
    same_row = [other for other in beside if np.isclose(other.bbox.y0, panel.bbox.y0) and other.bbox.x0 < panel.bbox.x0]
    return (
        axis.axis_name == "y"
        and not axis.label.get_text()
        and any(UNIT.search(other.get_ylabel()) for other in same_row)
    )


@each_figure
def test_every_axis_has_its_unit(name: str) -> None:
    for panel in panels(name):
        for axis in (panel.xaxis, panel.yaxis):
            assert is_named(panel, axis), f"no unit in {axis.label.get_text()!r}"


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIELAB of linear sRGB, D65."""
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ rgb
    t = xyz / [0.9505, 1.0, 1.089]
    x, y, z = np.where(t > (6 / 29) ** 3, np.cbrt(t), t * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@cache
def distance(one: str, other: str) -> float:
    """The lesser of the distances of two colours in CIELAB, as most people and as deuteranopes see them."""
    found = []
    for seen in (np.eye(3), DEUTERANOPE):
        labs = []
        for color in (one, other):
            coded = np.array(to_rgb(color))
            linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
            labs.append(lab(np.clip(seen @ linear, 0, 1)))
        found.append(float(np.linalg.norm(labs[0] - labs[1])))
    return min(found)


def test_the_distance_of_colours_is_the_published_one() -> None:
    """White and black are 100 apart; sRGB red is (53.24, 80.09, 67.20); a deuteranope confuses red with olive green."""
    assert distance("white", "black") == pytest.approx(100, abs=0.1)
    np.testing.assert_allclose(lab(np.array([1.0, 0, 0])), [53.24, 80.09, 67.20], atol=0.05)
    red, green = (DEUTERANOPE @ lin for lin in (np.array([1.0, 0, 0]), np.array([0.0, 0.43, 0])))
    assert np.linalg.norm(lab(np.clip(red, 0, 1)) - lab(np.clip(green, 0, 1))) < 15


def are_apart(one: Line2D, other: Line2D) -> bool:
    """Whether two lines differ by dash, marker, filling, width or colour."""
    looks = [
        (line._unscaled_dash_pattern[1], line.get_linestyle(), line.get_marker(), line.get_fillstyle())  # type: ignore[attr-defined]
        for line in (one, other)
    ]
    looks = [(str(dash), style == "None", marker, fill) for dash, style, marker, fill in looks]
    widths = sorted(line.get_linewidth() for line in (one, other))
    faces = {line.get_markerfacecolor() == "#FFFFFF" for line in (one, other)}
    return (
        looks[0] != looks[1]
        or len(faces) == 2
        or (not looks[0][1] and widths[1] > BROADER * widths[0])
        or distance(str(one.get_color()), str(other.get_color())) >= APART
    )


@each_figure
def test_lines_of_a_panel_are_told_apart(name: str) -> None:
    for panel in panels(name):
        seen = [line for line, points in curves(panel) if within(panel, points).any()]
        for one, other in combinations(seen, 2):
            same = one.get_color() == other.get_color() and {one.get_label()[0], other.get_label()[0]} & {"_"}
            assert same or are_apart(one, other), f"{one} and {other} look alike"


@each_figure
def test_no_line_can_hide_another(name: str) -> None:
    """Two lines over the same points may coincide; then the broader one must not lie upon the thinner one."""
    for panel in panels(name):
        lines = [line for line, _ in curves(panel) if is_joined(line)]
        for one, other in combinations(lines, 2):
            below, above = sorted((one, other), key=Line2D.get_zorder)  # of the same order the later is above
            if np.array_equal(below.get_xdata(), above.get_xdata()) and below.get_color() != above.get_color():
                is_over = above.get_linestyle() == "-" and above.get_linewidth() > below.get_linewidth()
                assert not is_over, f"{above} would hide {below}"


@each_figure
def test_the_keys_name_every_colour(name: str) -> None:
    """A colour, or its paler shade for a broad line beneath; thin black lines are the limits and the references."""
    keys = [panel.get_legend() for panel in panels(name) if panel.get_legend()]
    handles = [handle for key in keys for handle in key.legend_handles]
    named = {to_hex(handle.get_color() if isinstance(handle, Line2D) else handle.get_facecolor()) for handle in handles}
    named |= {looks.paler(color, 0.6) for color in named} | {"#000000"}
    for panel in panels(name):
        for line, _ in curves(panel):
            assert not keys or to_hex(line.get_color()) in named, f"{line} is in no key"


@each_figure
def test_a_caption_is_short(name: str) -> None:
    words = len(figure_module(name).caption(tables_stored(name)).split())
    assert words <= WORDS, f"{words} words"
