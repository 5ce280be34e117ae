"""How a run ends, and where it gives up."""

from __future__ import annotations

from typing import NamedTuple

DIVERGENT = 1e100  # times the limits, or without limits of a state: beyond it a loop diverges
ENORMOUS = 1e250  # a state with which no run goes on, whatever the limits

COMPLETE, DIVERGED, ENDLESS, CROWDED, EVENTFUL, STOPPED = 0, 1, 2, 3, 4, 5


class Bounds(NamedTuple):
    """Where to give up; ``room``, a power of two, is for the steps and mesh points that a dead time remembers."""

    steps: int
    events: int
    room: int
