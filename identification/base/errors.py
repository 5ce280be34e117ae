"""The error that every bad input ends in, and how its sentence quotes what was found."""

from __future__ import annotations

from reprlib import Repr
from unicodedata import category

LONGEST = 80
"""Characters of a value that a sentence quotes."""

_BRIEF = Repr()
_BRIEF.maxlevel, _BRIEF.maxstring, _BRIEF.maxother, _BRIEF.maxlong = 4, LONGEST, LONGEST, LONGEST
_BRIEF.maxlist = _BRIEF.maxtuple = _BRIEF.maxdict = LONGEST


def shown(value: object) -> str:
    """A value as a sentence quotes it: as Python writes it, on one line, the middle of a long one left out."""
    text = _BRIEF.repr(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2 - 2]}...{text[1 - LONGEST // 2 :]}"


def printable(text: str) -> str:
    """A text on one line: its control characters, and bytes of file names that are no UTF-8, escaped as Python does."""
    return "".join(each if each.isprintable() or category(each) == "Zs" else ascii(each)[1:-1] for each in text)


def printable_lines(text: str) -> str:
    """The same of each line of a text."""
    return "\n".join(map(printable, text.split("\n")))


class InputError(ValueError):
    """Something the user gave cannot be used; the message is one printable sentence: what, where and what else."""

    def __init__(self, sentence: str) -> None:
        super().__init__(printable(sentence))


class MissingFile(InputError):
    """A file to read is not there."""
