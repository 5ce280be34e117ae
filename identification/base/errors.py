"""The error that every bad input ends in, and how its sentence quotes what was found."""

from __future__ import annotations

from reprlib import Repr

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
    """A text in which control characters, and bytes of file names that are no UTF-8, are escaped as Python does."""
    return "".join(each if each.isprintable() else ascii(each)[1:-1] for each in text)


class InputError(ValueError):
    """Something the user gave cannot be used; the message is one printable sentence: what, where and what else."""

    def __init__(self, sentence: str) -> None:
        super().__init__(printable(sentence))


class MissingFile(InputError):
    """A file to read is not there."""
