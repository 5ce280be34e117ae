"""Which line of a text names the columns of a test, what separates them, and which of them are read."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

from identification.base.errors import InputError
from identification.formats.columns import COMPLEX, FIRST, KINDS, KNOWN, choose_columns, quoted
from identification.formats.spellings import Spelling, factor_of, size_of, spelt
from identification.formats.text_file import COMMENTS, declared_separator

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
BLANKS = " "  # any number of them
WIDE_BLANKS = "  "  # two or more, since the names themselves hold single ones
MOST_LINES = 1000  # before the header

Columns = Mapping[str, tuple[int, float]]  # for a name of ours, which column it is and how many of our unit one is
Choose = Callable[[str, list[str]], Columns]


@dataclass(frozen=True)
class Header:
    """The line with the columns' names.

    Parameters
    ----------
    line
        Its number; the numbers begin after it.
    separator
        One of SEPARATORS, BLANKS or WIDE_BLANKS.
    names
        What it calls the columns.
    columns
        Those to read.
    """

    line: int
    separator: str
    names: list[str]
    columns: Columns


def find_header(path: object, lines: Iterable[tuple[int, str]], choose: Choose) -> Header:
    """The first line that names the columns of a test, which a line of units may follow.

    Instruments write their settings before it, and some begin it with a comment sign; such a line counts where no
    other does. ``choose`` gives the columns to read among a line's names, or raises InputError.

    Raises
    ------
    InputError
        There is no such line; the sentence is about the line that comes nearest to one.
    """
    refused: list[tuple[int, InputError]] = []
    in_comment: Header | None = None
    declared = None
    above: dict[str, list[str]] = {}
    lines = iter(lines)
    for number, line in islice(lines, MOST_LINES):
        if declared is None and (declared := declared_separator(line)):
            continue
        if _is_numbers(line):
            continue
        place, is_comment = f"{path}, line {number}", line.startswith(COMMENTS)
        tries = _separated(place, line.lstrip("".join(COMMENTS)), declared)
        for separator, names in tries.items():
            for each in (names, _with_units(above.get(separator, []), names)):
                try:
                    header = Header(number, separator, each, choose(place, each))
                except InputError as error:
                    if not is_comment and each is names:
                        refused.append((_likeness(names), error))
                    continue
                if not is_comment:
                    return _with_units_below(path, header, next(lines, None))
                in_comment = in_comment or header
        separators = [SEPARATORS[separator] for separator in tries if separator in SEPARATORS]
        if len(separators) > 1 and not is_comment and (score := max(each for each, _ in refused[-len(tries) :])) > 0:
            sentence = f"the header holds {' and '.join(separators)}; expected one of them between the columns"
            refused.append((score, InputError(f"{place}: {sentence}")))
        above = tries
    if in_comment and all(score < 2 for score, _ in refused):
        return in_comment
    if not refused:
        raise InputError(f"{path}: holds no header and no numbers; expected a CSV with a header line")
    raise max(reversed(refused), key=lambda each: each[0])[1]


def name_columns(place: str, names: Sequence[str], meant: Mapping[str, str]) -> Columns:
    """The columns of a test among a line's ``names``: by our names, by ``meant``, or as other tools spell them.

    Raises
    ------
    InputError
        A column is missing, comes twice or lacks its unit, or the line names several responses.
    """
    ours = [meant.get(name, name) for name in names]
    own = {name: (index, factor_of(names[index], name)) for index, name in enumerate(ours) if name in KNOWN}
    spellings = [(index, said) for index, name in enumerate(ours) if name not in KNOWN and (said := spelt(name))]
    if any(kind <= set(own) for kind in KINDS):
        choose_columns(place, [name for name in ours if name in KNOWN], "columns")
        coherence = [(index, 1.0) for index, said in spellings if said == Spelling("", "coherence")]
        return own if "coherence" in own or not coherence else own | {"coherence": coherence[0]}
    by_label: dict[str, dict[str, tuple[int, float]]] = {"": {}}
    for index, said in spellings:
        group = by_label.setdefault(said.label, {})
        if said.ours and said.ours not in own:
            group.setdefault(said.ours, (index, said.factor))
    shared = own | by_label.pop("")
    complete = {label: test for label, group in {"": {}, **by_label}.items() if (test := _test(shared | group))}
    for name, (first, _) in (item for test in complete.values() for item in test.items()):
        same = [index for index, said in spellings if index > first and said == spelt(names[first])]
        if same and not names[first].lower().startswith("trace "):
            both = f"{quoted(names[first])} and {quoted(names[same[0]])}"
            raise InputError(f'{place}: both {both} mean {name}; expected one, or --columns "NAME={name}"')
    if "" in complete:
        return complete[""]
    if len(complete) > 1:
        chosen = [f"{names[index]}={name}" for name, (index, _) in next(iter(complete.values())).items()]
        raise InputError(
            f"{place}: the columns hold {len(complete)} responses ({', '.join(complete)}); expected one, or for "
            f'example --columns "{",".join(chosen)}"'
        )
    if complete:
        return next(iter(complete.values()))
    counts = Counter(name for group in by_label.values() for name in group)
    everything = {name: at for group in by_label.values() for name, at in group.items()} | shared
    if max(counts.values(), default=0) == 1 and (test := _test(everything)):
        return test
    _require_units(place, names, everything, [each for each in spellings if each[1].ours is None])
    choose_columns(place, ours, "columns")
    raise InputError(f"{place}: the columns belong to several responses; expected one, or --columns NAME=OURS")


def _require_units(place: str, names: Sequence[str], found: Columns, unsaid: Sequence[tuple[int, Spelling]]) -> None:
    """Refuse a line that would name a test if its columns said their units."""
    possible = {*found, *(name for _, said in unsaid for name in said.may_be)}
    which = [(names[index], said.may_be) for index, said in unsaid if not set(said.may_be) & set(found)]
    if which and any(kind <= possible for kind in KINDS):
        doubts = [f"{quoted(name)} is {' or '.join((*ours, 'another unit')[:2])}" for name, ours in which]
        chosen = ",".join(f"{name}={ours[0]}" for name, ours in which)
        raise InputError(
            f"{place}: the header does not say whether {', '.join(doubts)}; expected a unit in brackets, or for "
            f'example --columns "{chosen}"'
        )


def _likeness(names: Sequence[str]) -> int:
    """How many names of a line a test may have; a line of units is less than one of none."""
    if any(size_of(names[0], first) for first in FIRST):
        return -1
    return sum(name in KNOWN or spelt(name) is not None for name in names)


def _with_units(names: list[str], units: list[str]) -> list[str]:
    """The names of one line with the units that the next one gives, if it gives as many."""
    return [f"{name} ({unit})" if unit else name for name, unit in zip(names, units, strict=False)]


def _with_units_below(path: object, header: Header, below: tuple[int, str] | None) -> Header:
    """The header with the units of the next line, if that begins with a unit of its first column."""
    if below is None or _is_numbers(below[1]):
        return header
    number, line = below
    fields = dict(enumerate(split_fields(f"{path}, line {number}", line, header.separator)))
    sizes = {name: size_of(fields.get(index, ""), name) for name, (index, _) in header.columns.items()}
    if not any(sizes.get(name) for name in FIRST):
        return header
    columns = {name: (index, sizes[name] or factor) for name, (index, factor) in header.columns.items()}
    return replace(header, line=number, columns=columns)


def _separated(place: str, line: str, declared: str | None) -> dict[str, list[str]]:
    """For each separator that a line may have, the names between."""
    found = [declared] if declared else [separator for separator in SEPARATORS if separator in line]
    tries = {separator: split_fields(place, line, separator) for separator in found or [WIDE_BLANKS, BLANKS]}
    for names in tries.values():
        while names and not names[-1]:
            names.pop()
    return {separator: names for separator, names in tries.items() if names}


def _is_numbers(line: str) -> bool:
    """Whether a line begins as the lines after a header do."""
    first = re.split(r"[,;\s]", line.strip(), maxsplit=1)[0]
    try:
        float(first)
    except ValueError:
        return False
    return len(first) < len(line.strip())


def split_fields(place: str, line: str, separator: str) -> list[str]:
    """The fields of one line, their blanks made single.

    Raises
    ------
    InputError
        The line is none of a CSV.
    """
    if separator in (BLANKS, WIDE_BLANKS):
        return re.split(r"\s+" if separator == BLANKS else r"\s{2,}", line.strip())
    try:
        row = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(f"{place}: cannot be read ({error}); expected fields of a CSV") from None
    return [" ".join(field.split()) for field in row]


def _test(found: Columns) -> Columns | None:
    """The columns of one test among those found, the parts of a complex number before its size and angle."""
    for kind in sorted(KINDS, key=lambda kind: not kind & {"real", COMPLEX}):
        if kind <= set(found):
            return _only(found, kind | {"coherence", "test"})
    return None


def _only(found: Columns, names: set[str]) -> dict[str, tuple[int, float]]:
    return {name: at for name, at in found.items() if name in names}
