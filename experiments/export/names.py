"""Names that every language of an export takes."""

from __future__ import annotations

import re
import unicodedata

from identification.base.errors import InputError, shown

LONGEST = 40  # characters


def require_name(name: str) -> None:
    """Let pass the name of a controller: letters, digits and underscores, a letter first.

    Raises
    ------
    InputError
        It is no such name, or longer than :data:`LONGEST` characters.
    """
    if not re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST - 1}}}", name):
        raise InputError(
            f"--name is {shown(name)}; expected at most {LONGEST} letters, digits and underscores, a letter first"
        )


def identifier(name: str, otherwise: str) -> str:
    """The letters and digits of a signal's name, joined by underscores; ``otherwise`` where it has none of ASCII.

    It may begin with a digit: whoever writes it puts a word before.
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return "_".join(re.findall(r"[A-Za-z0-9]+", plain)) or otherwise
