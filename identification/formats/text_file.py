"""A file of text in the encodings of instruments and spreadsheets -> its text."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from pathlib import Path

from identification.base.errors import InputError
from identification.base.files import read_bytes

MARKS = {codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
ENCODINGS = ("utf-8", "cp1252", "latin-1")  # tried in this order where no mark says which; the last takes any byte
COMMENTS = ("#", "!", "%")
MINUS = "\u2212"


def read_any_text(path: Path) -> str:
    """Return a file's text with line ends as in Unix and with ASCII minus signs.

    A byte order mark decides between UTF-8 and UTF-16. Without one the text is UTF-8 or, where it holds a byte that
    UTF-8 does not, Windows-1252 or Latin-1: the two differ in a few signs that no number has.

    Raises
    ------
    MissingFile
        There is no such file.
    InputError
        The file is no regular one, may not be read, or holds no text.
    """
    content = read_bytes(path)
    mark = next((mark for mark in MARKS if content.startswith(mark)), b"")
    for encoding in (MARKS[mark],) if mark else ENCODINGS:
        try:
            text = content[len(mark) :].decode(encoding)
            break
        except UnicodeDecodeError as error:
            place = error.start + len(mark)
    else:
        raise InputError(
            f"{path}: byte {place} is not {encoding.upper()}, as the file's first bytes say; expected text"
        )
    if (zero := text.find("\0")) >= 0:
        raise InputError(f"{path}: character {zero} is zero; expected a text file (UTF-16 with a byte order mark)")
    return text.replace("\r\n", "\n").replace("\r", "\n").replace(MINUS, "-")


def text_lines(text: str) -> Iterator[tuple[int, str]]:
    """The lines that are not blank, with their numbers from 1; a list of all would take more memory than the text."""
    start, number = 0, 0
    while start <= len(text):
        stop = text.find("\n", start)
        stop = len(text) if stop < 0 else stop
        number += 1
        line = text[start:stop]
        if line.strip():
            yield number, line
        start = stop + 1


def declared_separator(line: str) -> str | None:
    """What stands between the columns according to a line ``sep=;``, which Excel reads and writes first of all."""
    found = re.fullmatch(r'"?sep=(.)"?\s*', line, flags=re.IGNORECASE)
    return found[1] if found else None
