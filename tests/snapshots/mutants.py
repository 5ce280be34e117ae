"""Wrong data made from stored data: what the strict fixture must catch, one change at a time.

Each change is one that has to be seen, or one below what the computation itself knows: :func:`is_below` says which.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from strict import RTOL, Stored, is_kept, read_snapshot

SMALL = 1e-6
SAMPLES = 60
CHOSEN_ROWS = 50
SEED = 1

Columns = dict[str, np.ndarray]


def snapshot_files() -> list[Path]:
    """All stored files of all snapshot tests."""
    return sorted(path for path in Path(__file__).parent.glob("test_*/*") if path.suffix in (".csv", ".npz", ".txt"))


def stored_snapshot(path: Path) -> Stored:
    """The columns of a file with their tolerances."""
    return Stored(read_snapshot(path), path.stem)


def next_to(values: np.ndarray) -> np.ndarray:
    """For each value the one below it, the last one for the last but one."""
    return np.append(values[1:], values[-2:-1]) if len(values) > 1 else values


NUMBER_CHANGES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "a number 1e-6 of itself larger": lambda x: x * (1 + SMALL),
    "a number 1e-6 of itself smaller": lambda x: x * (1 - SMALL),
    "a number's sign flipped": lambda x: -x,
    "a number set to 0": lambda x: np.zeros_like(x),
    "a number turned to NaN": lambda x: np.full_like(x, np.nan),
    "a number turned to inf": lambda x: np.full_like(x, np.inf),
    "two neighbours swapped": next_to,
}
INTEGER_CHANGES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "an integer one larger": lambda x: x + 1,
    "two neighbours swapped": next_to,
}
NAME_CHANGES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "a name of one letter more": lambda x: np.char.add(x, "x"),
    "a name of one letter less": lambda x: np.array([name[:-1] for name in x]),
    "a name emptied": lambda x: np.zeros_like(x),
    "two neighbours swapped": next_to,
}
OTHER_KIND = {"f": int, "i": float, "U": "S"}
CHANGES = {"f": NUMBER_CHANGES, "i": INTEGER_CHANGES, "U": NAME_CHANGES}


@dataclass
class Tally:
    """How many mutants of one kind there were, and what became of them."""

    mutants: int = 0
    caught: int = 0
    below: int = 0
    """Not caught, and below what the computation knows: no fixture may catch them."""

    def add(self, caught: np.ndarray, below: np.ndarray) -> None:
        """Count mutants by whether they were caught and whether they need not be."""
        self.mutants += len(caught)
        self.caught += int(caught.sum())
        self.below += int((~caught & below).sum())

    @property
    def missed(self) -> int:
        """How many should have been caught and were not."""
        return self.mutants - self.caught - self.below


def is_below(want: np.ndarray, changed: np.ndarray, floor: float) -> np.ndarray:
    """For each change whether it need not be seen.

    It is less than SMALL of the number, as that of neighbours nearly equal, or less than the column's floor with one
    hundredth more. A change to NaN or to infinity never is, nor one of an integer or a name.
    """
    if want.dtype.kind != "f":
        return np.zeros(len(want), dtype=bool)
    with np.errstate(invalid="ignore"):
        size = np.abs(changed - want)
        return np.asarray((size < 0.999 * SMALL * np.abs(want)) | (size <= 1.01 * (floor + RTOL * np.abs(want))))


def is_caught(stored: Stored, columns: Columns) -> bool:
    """Whether the fixture's check refuses the columns."""
    try:
        stored.check(columns)
    except AssertionError:
        return True
    return False


def tallied(path: Path) -> dict[str, Tally]:
    """All mutants of a stored file, by kind."""
    found: dict[str, Tally] = defaultdict(Tally)
    if path.suffix == ".txt":
        text = path.read_text(encoding="utf-8")
        for change, changed in texts_changed(text):
            found[change].add(np.array([changed != text]), np.array([False]))
        return found
    stored = stored_snapshot(path)
    for change, _, below, caught in every_value(stored):
        found[f"every value: {change}"].add(caught, below)
    for change, below_floor, columns in one_at_a_time(stored):
        found[change].add(np.array([is_caught(stored, columns)]), np.array([below_floor]))
    return found


def one_at_a_time(stored: Stored) -> Iterator[tuple[str, bool, Columns]]:
    """All other mutants with whether they need not be caught."""
    for change, name, row, columns in sampled_values(stored):
        want, changed = stored.columns[name][row : row + 1], columns[name][row : row + 1]
        yield f"sampled: {change}", bool(is_below(want, changed, stored.floors.get(name, 0.0))[0]), columns
    for change, columns in chain(columns_changed(stored), rows_changed(stored), all_changed(stored)):
        yield change, False, columns


def every_value(stored: Stored) -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """Every value of every column changed, each verdict that of this change alone.

    The fixture compares value by value, with tolerances of the stored column, so that one comparison of a column all
    of whose values are changed gives the verdicts of all changes one at a time.

    Yields
    ------
    The change, the column, and for each value that is changed at all whether it need not be caught and whether it is.
    """
    for name, want in stored.columns.items():
        for change, function in CHANGES[want.dtype.kind].items():
            changed = function(want)
            differs = changed != want
            caught = ~is_kept(changed, want, stored.tolerances.get(name))
            below = is_below(want, changed, stored.floors.get(name, 0.0))
            yield change, name, below[differs], caught[differs]


def sampled_values(stored: Stored) -> Iterator[tuple[str, str, int, Columns]]:
    """Single values changed: of each column the first, last, smallest and largest, and of all columns a sample."""
    random = np.random.default_rng(SEED)
    places = []
    for name, want in stored.columns.items():
        places += [(name, 0), (name, len(want) - 1)]
        if want.dtype.kind != "U":
            places += [(name, int(np.abs(want).argmin())), (name, int(np.abs(want).argmax()))]
    names = list(stored.columns)
    for name in random.choice(names, SAMPLES):
        places.append((str(name), int(random.integers(len(stored.columns[name])))))
    for name, row in dict.fromkeys(places):
        want = stored.columns[name]
        for change, function in CHANGES[want.dtype.kind].items():
            if "swapped" in change:
                if len(want) == 1:
                    continue
                other = row + 1 if row + 1 < len(want) else row - 1
                values = want.copy()
                values[[row, other]] = values[[other, row]]
            else:
                changed = function(want[row : row + 1])
                values = want.astype(np.promote_types(want.dtype, changed.dtype))
                values[row] = changed[0]
            if values[row] != want[row]:
                yield change, name, row, {**stored.columns, name: values}


def columns_changed(stored: Stored) -> Iterator[tuple[str, Columns]]:
    """Whole columns changed, one at a time; one whose values stay the same is no mutant."""
    columns, names = stored.columns, list(stored.columns)
    yield "a column added", {**columns, "another": columns[names[0]]}
    for place, (name, want) in enumerate(columns.items()):
        yield "a column dropped", {key: values for key, values in columns.items() if key != name}
        yield "a column renamed", {f"{key}x" if key == name else key: v for key, v in columns.items()}
        yield "a column of another kind", {**columns, name: want.astype(OTHER_KIND[want.dtype.kind])}
        yield "a column of objects", {**columns, name: want.astype(object)}
        yield "a column of two dimensions", {**columns, name: want[:, None]}
        yield "a column emptied", {**columns, name: want[:0]}
        values = {"a column rolled by a row": np.roll(want, 1), "a column reversed": want[::-1]}
        if want.dtype.kind == "f":
            yield "a column made complex", {**columns, name: want.astype(complex)}
            values["a column scaled by 1 + 1e-6"] = want * (1 + SMALL)
            values["a column shifted by 1e-6 of its largest"] = want + SMALL * np.abs(want).max()
        if place:
            before = names[place - 1]
            order = [*names[: place - 1], name, before, *names[place + 1 :]]
            yield "two columns in the other order", {key: columns[key] for key in order}
            if not np.array_equal(want, columns[before]):
                yield "two columns' values swapped", {**columns, name: columns[before], before: want}
        for change, changed in values.items():
            if is_large(want, changed, stored.floors.get(name)):
                yield change, {**columns, name: changed}


def is_large(want: np.ndarray, changed: np.ndarray, floor: float | None) -> bool:
    """Whether any value of a column changes by more than need not be seen."""
    return bool(np.any(changed != want)) if floor is None else not is_below(want, changed, floor).all()


def rows_changed(stored: Stored) -> Iterator[tuple[str, Columns]]:
    """Rows dropped, doubled and swapped with the one before; all rows, or an even choice of a long table's.

    Columns of unequal length are no table; there a row is that of the longest columns.
    """
    rows = max(len(values) for values in stored.columns.values())
    tall = {name: values for name, values in stored.columns.items() if len(values) == rows}
    for row in sorted({*range(0, rows, max(1, rows // CHOSEN_ROWS)), rows - 1}):
        yield "a row dropped", stored.columns | {n: np.delete(v, row) for n, v in tall.items()}
        yield "a row doubled", stored.columns | {n: np.insert(v, row, v[row]) for n, v in tall.items()}
        order = np.arange(rows)
        order[[row - 1, row]] = row, row - 1
        if any(is_large(v, v[order], stored.floors.get(n)) for n, v in tall.items()):
            yield "two rows swapped", stored.columns | {n: v[order] for n, v in tall.items()}


def all_changed(stored: Stored) -> Iterator[tuple[str, Columns]]:
    """The data as a whole changed."""
    floats = {name: values for name, values in stored.columns.items() if values.dtype.kind == "f"}
    if any(values.any() for values in floats.values()):
        yield "all data scaled by 1 + 1e-6", stored.columns | {n: v * (1 + SMALL) for n, v in floats.items()}
    yield "all rows dropped", {name: values[:0] for name, values in stored.columns.items()}
    yield "all columns dropped", {}


def texts_changed(text: str) -> Iterator[tuple[str, str]]:
    """A listing changed: each letter another one, each line dropped or doubled, each place moved by 0.002."""
    for place, letter in enumerate(text):
        yield "a letter changed", f"{text[:place]}{'y' if letter == 'x' else 'x'}{text[place + 1 :]}"
    lines = text.splitlines(keepends=True)
    for row, line in enumerate(lines):
        yield "a line dropped", "".join([*lines[:row], *lines[row + 1 :]])
        yield "a line doubled", "".join([*lines[:row], line, *lines[row:]])
        if " at " in line:
            before, _, after = line.rpartition(" at ")
            x, *others = after.split(" ")
            moved = " ".join([f"{float(x) + 0.002:.3f}", *others])
            yield "a text moved by 0.002", "".join([*lines[:row], f"{before} at {moved}", *lines[row + 1 :]])
