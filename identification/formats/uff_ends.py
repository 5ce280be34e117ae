"""Functions between many points of a structure -> those of one plant, from one of the points to one other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from identification.base.errors import InputError
from identification.formats.columns import MOST_NAMES
from identification.formats.reading import Reading
from identification.formats.uff_function import End

Test = TypeVar("Test")
ENDS = "response", "reference"


def of_one_plant(path: Path, tests: Sequence[Test], ends: Sequence[tuple[End, End]], reading: Reading) -> list[Test]:
    """Those of the N ``tests``, from N ``ends``, that have the node and the direction that ``reading`` asks for.

    They are the response's, or the reference's where all tests have one response and several references, as with a
    hammer that moves.

    Raises
    ------
    InputError
        None is left, or tests of several plants are.
    """
    side = int(len({response for response, _ in ends}) == 1 < len(set(ends)))
    chosen = [
        k
        for k, point in enumerate(ends)
        if reading.node in (None, point[side].node) and reading.direction in (None, point[side].direction)
    ]
    plants = Counter(ends[k] for k in chosen)
    if len(plants) == 1:
        return [tests[k] for k in chosen]
    left = sorted({point[side] for point in plants})
    if not left:
        asked = {"node": reading.node, "direction": reading.direction}
        found = ", ".join(f"{what} {value}" for what, value in asked.items() if value is not None)
        listed = _listed(Counter(ends))
        raise InputError(f"{path}: holds no function whose {ENDS[side]} has {found}; expected one of these: {listed}")
    expected = "functions of one reference (keep those of each in a file of their own)"
    if len(left) > 1:
        choice = f"--node {left[0].node} --direction {left[0].direction}"
        expected = f"those of one (choose its {ENDS[side]}, as in {choice})"
    raise InputError(f"{path}: holds functions of {len(plants)} plants, {_listed(plants)}; expected {expected}")


def _listed(plants: Counter[tuple[End, End]]) -> str:
    shown = [
        f"from the reference at {reference} to the response at {response} "
        f"({count} {'function' if count == 1 else 'functions'})"
        for (response, reference), count in sorted(plants.items())[:MOST_NAMES]
    ]
    return "; ".join(shown) + (f"; and {len(plants) - MOST_NAMES} more" if len(plants) > MOST_NAMES else "")
