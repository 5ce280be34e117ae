"""The frequency axis of every Bode-like panel, in Hz, and the units of what stands beside it."""

from __future__ import annotations

from math import tau

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from identification.base.arrays import Real

HERTZ = "Frequency [Hz]"
FEW = 100  # ratio of frequencies between which there are too few powers of ten


def over_hertz(panel: Axes, low: float, high: float) -> None:
    """Make a panel's axis logarithmic, from ``low`` to ``high`` in rad/s, and label it in Hz."""
    over_decades(panel, low / tau, high / tau)


def over_decades(panel: Axes, low: float, high: float) -> None:
    """Make a panel's axis logarithmic, from ``low`` to ``high``; below two decades powers of ten are too few ticks."""
    if low == high:  # of a single line
        low, high = low / 2, high * 2
    panel.set_xscale("log")
    panel.set_xlim(low, high)
    panel.xaxis.set_minor_formatter(NullFormatter())
    if high < FEW * low:
        panel.xaxis.set_major_locator(
            LogLocator(subs=(1, 2, 5)) if high > 5 * low else MaxNLocator(5, steps=[1, 2, 5, 10])
        )
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def hertz(omega: Real) -> Real:
    """Frequencies in Hz of those in rad/s."""
    return omega / tau


def decibel_of(quantity: str, unit: str) -> str:
    """The label of a quantity in dB, with the unit that 0 dB is one of where it is known."""
    return f"{quantity} [dB re {plain(unit)}]" if unit else f"{quantity} [dB]"


def number(value: float) -> str:
    """A number of three digits, without an exponent up to a million."""
    return f"{float(f'{value:.3g}'):g}"


def plain(text: str) -> str:
    """A name or a unit that somebody gave, as it is to be printed: no part of it is a formula."""
    return text.replace("$", r"\$")
