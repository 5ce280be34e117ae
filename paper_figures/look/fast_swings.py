"""Where a line swings faster than a page can show, and between which values it does."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from identification.base.arrays import Real

TURNS, WITHIN = 6, 5.0  # so many turns in so many points of the page are a smear
SEEN = 0.03  # of the height of the panel: a smaller swing only makes the line look broader
MOST_CORNERS = 600  # of the edges of a range


def turns_of(y: Real, least: float) -> NDArray[np.intp]:
    """Return where a line turns, and swings by more than ``least`` before and after; of a plateau its first point."""
    with np.errstate(invalid="ignore"):
        way = np.sign(np.diff(y))
    moving = np.flatnonzero(np.isfinite(way) & (way != 0))
    turns = moving[np.flatnonzero(np.diff(way[moving]))] + 1
    swing = np.abs(np.diff(y[turns], prepend=y[:1], append=y[moving[-1:] + 1]))
    return np.asarray(turns[np.minimum(swing[:-1], swing[1:]) > least]) if len(turns) else turns


def fast_stretches(panel: Axes, x: Real, y: Real) -> Real:
    """The stretches of the horizontal axis in which a line cannot be drawn cycle by cycle.

    Parameters
    ----------
    panel
        With its view and its scale.
    x, y
        The points that are shown, x ascending.

    Returns
    -------
    ndarray, shape (n, 2)
        Beginnings and ends.
    """
    figure = panel.get_figure(root=True)
    assert figure is not None
    window = WITHIN / (72 * panel.bbox.width / figure.dpi) * (x[-1] - x[0])
    scale = panel.yaxis.get_transform()
    height = float(np.ptp(scale.transform(np.array(panel.get_ylim()))))
    at = x[turns_of(scale.transform(y), SEEN * height)]
    first, last = at[: 1 - TURNS], at[TURNS - 1 :]
    return merged(np.column_stack([first, last])[last - first < window], window)


def swing_range(x: Real, y: Real) -> tuple[Real, Real, Real]:
    """Return the places at which a fast line turns, and the least and the largest of the turns around each."""
    turns = turns_of(y, 0.0)
    around = sliding_window_view(np.pad(y[turns], TURNS // 2 - 1, mode="edge"), TURNS - 1)
    lower, upper = around.min(axis=1), around.max(axis=1)
    starts = np.arange(0, len(turns), -(-len(turns) // MOST_CORNERS))
    return x[turns][starts], np.minimum.reduceat(lower, starts), np.maximum.reduceat(upper, starts)


def merged(stretches: Real, gap_s: float) -> Real:
    """The stretches (n, 2) as they are seen: those less than a gap apart are one."""
    if not len(stretches):
        return stretches
    new = np.append(True, stretches[1:, 0] - stretches[:-1, 1] > gap_s)
    last = np.append(new[1:], True)
    return np.column_stack([stretches[new, 0], stretches[last, 1]])
