"""A variable of a MAT file, whatever the file's version."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scipy.io.matlab import MatReadError

from identification.base.arrays import Array

NUMERIC = {"double", "single", "logical"} | {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)}
PLAIN = NUMERIC | {"char", "cell", "struct", "sparse", "function_handle"}
DEEPEST = 8  # structures within structures
DAMAGED = (
    *(ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError, RuntimeError),
    *(OSError, NotImplementedError, struct.error, zlib.error, MatReadError, UserWarning, RuntimeWarning),
)
"""What reading a damaged file raises."""


@dataclass(frozen=True)
class Variable:
    """A variable or a field of a structure; nothing of what it holds is read before it is asked for.

    Parameters
    ----------
    kind
        MATLAB's class.
    shape
        As MATLAB says it; () of an object.
    is_complex
        Whether it holds complex numbers.
    read
        Its numbers or letters, or an array of what each cell holds.
    fields
        Of a single structure, by their names.
    """

    kind: str
    shape: tuple[int, ...]
    is_complex: bool
    read: Callable[[], Array]
    fields: Callable[[], Mapping[str, Variable]]


def nothing() -> dict[str, Variable]:
    """The fields of what is no single structure."""
    return {}


def unreadable() -> Array:
    """What reads a variable that holds no numbers or letters; raises one of DAMAGED."""
    raise ValueError
