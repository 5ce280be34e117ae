"""The axis of a control: linear between the limits, logarithmic beyond them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from paper_figures.look.frequency_axis import number

APART = 2.5  # times the limit the next number is


def beyond_logarithmic(panel: Axes, limit: float, most: float) -> None:
    """Make the vertical axis logarithmic beyond +-limit, so that the limits are seen however large the control is.

    Parameters
    ----------
    panel
        Whose axis it is.
    limit
        Greater than 0. Numbers stand at 0, at the limits, and beyond them at 1 and 3 times the powers of ten.
    most
        The largest control for which there is a number.
    """
    panel.set_yscale("symlog", linthresh=limit)
    decades = 10.0 ** np.arange(np.floor(np.log10(limit)), np.log10(most) + 1)
    beyond = np.outer(decades, (1, 3)).ravel()
    ticks = [limit, *beyond[beyond > APART * limit]]
    panel.yaxis.set_major_locator(FixedLocator([*(-tick for tick in reversed(ticks)), 0.0, *ticks]))
    panel.yaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))
