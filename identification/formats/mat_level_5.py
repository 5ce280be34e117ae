"""A MAT file of level 5, MATLAB's -v6 and -v7 -> its variables.

They are read here and not by scipy, which follows the tags of a damaged file unchecked until the process ends, and
gives no list of the variables where one is an object.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from functools import cache, partial
from itertools import islice

import numpy as np

from identification.base.arrays import Array
from identification.formats.mat_variable import Variable, nothing, unreadable
from identification.formats.sizes import MOST_BYTES

HEADER = 128
HEAD = 4096  # bytes of an array in which its name ends
LARGEST = 16  # bytes of a number, a complex one
MOST_CELLS = 2**25  # bytes; each of some millions of cells becomes an object
MOST_FIELDS = 10_000
MATRIX, COMPRESSED = 14, 15
FLAGS_TAG = 6, 8  # type and size of an array's first element
TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
ENCODINGS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
CELL, STRUCT, OBJECT, CHAR, OPAQUE = 1, 2, 3, 4, 17
CLASSES = {
    **{CELL: "cell", STRUCT: "struct", CHAR: "char", 5: "sparse", 6: "double", 7: "single", 16: "function_handle"},
    **{8 + 2 * k + unsigned: f"{'u' * unsigned}int{8 << k}" for k in range(4) for unsigned in (0, 1)},
}
NUMBERS = range(6, 16)
IS_COMPLEX, IS_LOGICAL = 0x0800, 0x0200


def is_level_5(content: bytes) -> bool:
    """Whether a file's first bytes say that it is of level 5."""
    version = content[125:126] if content[126:127] == b"I" else content[124:125]
    return 0 not in content[:4] and version == b"\x01"


def read_variables(content: bytes) -> Iterator[tuple[str, Variable]]:
    """The names and variables of a file of level 5.

    Raises
    ------
    One of DAMAGED
        Types, sizes and numbers of elements do not go together, or what is compressed is larger than its numbers are;
        so does what reads a variable.

    References
    ----------
    MathWorks, "MAT-File Format", level 5.
    """
    order = "<" if content[126:128] == b"IM" else ">"
    for kind, body in _elements(memoryview(content)[HEADER:], order):
        if kind == COMPRESSED:
            head = memoryview(zlib.decompressobj().decompress(body, HEAD))[8:]
            name, variable = _variable(head, order, packed=body)
        elif kind == MATRIX:
            name, variable = _variable(body, order)
        else:
            continue
        if name:  # what has none belongs to the objects
            yield name, variable


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Type and content of each element; raises struct.error where the data end too early."""
    start = 0
    while start < len(data):
        kind, size = struct.unpack_from(f"{order}II", data, start)
        start += 8
        if kind >> 16:  # a small element: size, type and content in eight bytes
            yield kind & 0xFFFF, data[start - 4 : start - 4 + (kind >> 16)]
            continue
        if start + size > len(data):
            raise struct.error
        yield kind, data[start : start + size]
        start += size + (0 if kind in (MATRIX, COMPRESSED) else -size % 8)


def _variable(body: memoryview, order: str, packed: memoryview | None = None) -> tuple[str, Variable]:
    """The name of an array and what it is, of its content, or of the beginning if it is ``packed``."""
    if not body:  # how an empty field is written
        return "", Variable("double", (0, 0), False, partial(np.zeros, (0, 0)), nothing)
    if body[:8] != struct.pack(f"{order}II", *FLAGS_TAG):
        raise ValueError
    elements = _elements(body, order)
    flags = struct.unpack_from(f"{order}I", next(elements)[1])[0]
    if flags & 0xFF == OPAQUE:
        name, _, kind = (_text(text) for _, text in islice(elements, 3))
        return name, Variable(kind, (), False, unreadable, nothing)
    (_, sizes), (_, name_bytes) = islice(elements, 2)
    shape = struct.unpack(f"{order}{len(sizes) // 4}i", sizes)
    if len(shape) < 2 or min(shape) < 0:
        raise ValueError
    kind = CLASSES.get(flags & 0xFF, "unknown")
    if flags & 0xFF == OBJECT:
        kind = _text(next(elements)[1])
    is_complex = bool(flags & IS_COMPLEX)
    whole = partial(_whole, body, order, packed, flags & 0xFF, math.prod(shape))
    return _text(name_bytes), Variable(
        "logical" if flags & IS_LOGICAL and flags & 0xFF in NUMBERS else kind,
        shape,
        is_complex,
        lambda: _values(whole(), order, flags & 0xFF, shape, is_complex),
        cache(lambda: _fields(whole(), order)) if flags & 0xFF == STRUCT and math.prod(shape) == 1 else nothing,
    )


def _whole(body: memoryview, order: str, packed: memoryview | None, kind: int, count: int) -> memoryview:
    """All of an array; raises ValueError where it is too large.

    A checksum says nothing of a size: a thousandth of what an array expands to may be all there is in the file.
    """
    largest = {CELL: MOST_CELLS, STRUCT: MOST_BYTES}.get(kind, min(HEAD + LARGEST * count, MOST_BYTES))
    if packed is not None:
        stream = zlib.decompressobj()
        content = stream.decompress(packed, largest)
        tag, size = struct.unpack_from(f"{order}II", content)
        if not stream.eof or tag != MATRIX or size > len(content) - 8:
            raise ValueError
        body = memoryview(content)[8 : 8 + size]
    if len(body) > largest:
        raise ValueError
    return body


def _values(body: memoryview, order: str, kind: int, shape: tuple[int, ...], is_complex: bool) -> Array:
    elements = islice(_elements(body, order), 3, None)
    if kind == CELL:
        cells = np.fromiter((_variable(part, order)[1].read() for _, part in elements), dtype=object)
        return cells.reshape(shape, order="F")
    parts = list(islice(elements, 3))
    if kind == CHAR:
        ((tag, part),) = parts
        order_name = {"<": "-le", ">": "-be"}[order] if tag in (4, 17, 18) else ""
        letters = bytes(part).decode(ENCODINGS[tag] + order_name)
        return np.array(list(letters), dtype="U1").reshape(shape, order="F")
    if kind not in NUMBERS or len(parts) != 1 + is_complex:
        raise ValueError
    real, *imag = (np.frombuffer(part, order + TYPES[tag]).reshape(shape, order="F") for tag, part in parts)
    if not imag:
        return real
    values = np.empty(shape, dtype=complex)
    values.real, values.imag = real, imag[0]
    return values


def _fields(body: memoryview, order: str) -> dict[str, Variable]:
    elements = _elements(body, order)
    (_, width_bytes), (_, names) = islice(elements, 3, 5)
    (width,) = struct.unpack(f"{order}i", width_bytes)
    if width < 1 or len(names) // width > MOST_FIELDS:
        raise ValueError
    called = [_text(names[k : k + width]) for k in range(0, len(names), width)]
    return {name: _variable(part, order)[1] for name, (_, part) in zip(called, elements, strict=True)}


def _text(content: memoryview) -> str:
    return bytes(content).split(b"\0")[0].decode("latin-1")
