"""Whether a MAT file is built as its tags say: scipy follows them unchecked, and a damaged one ends the process."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Collection, Iterator
from itertools import islice

from identification.formats.sizes import MOST_BYTES

HEADER = 128
HEAD = 4096  # bytes of an array in which its name ends
LARGEST = 16  # bytes of a number, a complex one
MOST_CELLS = 2**25  # bytes; each of some millions of cells becomes an object
MATRIX, COMPRESSED = 14, 15
FLAGS_TAG = 6, 8  # type and size of an array's first element
NUMBERS = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13}
TEXT = NUMBERS | {16, 17, 18}
CELL_CLASS, CHAR_CLASS, NUMBER_CLASSES = 1, 4, range(6, 16)
IS_COMPLEX = 0x0800


def is_sound(content: bytes, names: Collection[str]) -> bool:
    """Whether the variables of these names have types, sizes and numbers of elements that go together.

    They are arrays of numbers or text, or cell arrays of such; what is compressed must be no larger than its
    numbers are, or MOST_CELLS. Files older or newer than level 5, the format of MATLAB's -v6
    and -v7, need no such care.

    References
    ----------
    MathWorks, "MAT-File Format", level 5.
    """
    order = "<" if content[126:128] == b"IM" else ">"
    if len(content) < HEADER or 0 in content[:4] or content[125 if content[126:127] == b"I" else 124] != 1:
        return True
    try:
        return all(
            _is_sound_matrix(body if kind == MATRIX else _expanded(body, order, names), order, names)
            for kind, body in _elements(memoryview(content)[HEADER:], order)
            if kind in (MATRIX, COMPRESSED)
        )
    except (struct.error, ValueError, RecursionError, zlib.error):
        return False


def _expanded(packed: memoryview, order: str, names: Collection[str]) -> memoryview:
    """What a compressed element holds, or nothing if it has none of ``names``; raises ValueError where it is too large.

    Its checksum says nothing of a size: a thousandth of what it expands to may be all there is in the file.
    """
    head = memoryview(zlib.decompressobj().decompress(packed, HEAD))[8:]
    (_, flags), (_, sizes), (_, name) = islice(_elements(head, order), 3)
    if bytes(name).decode("latin-1") not in names:
        return head[:0]
    is_cell = struct.unpack_from(f"{order}I", flags)[0] & 0xFF == CELL_CLASS
    count = math.prod(struct.unpack(f"{order}{len(sizes) // 4}i", sizes))
    stream = zlib.decompressobj()
    content = stream.decompress(packed, MOST_CELLS if is_cell else min(HEAD + LARGEST * max(count, 0), MOST_BYTES))
    if not stream.eof:
        raise ValueError
    kind, size = struct.unpack_from(f"{order}II", content)
    if kind != MATRIX or size > len(content) - 8:
        raise ValueError
    return memoryview(content)[8 : 8 + size]


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


def _is_sound_matrix(body: memoryview, order: str, names: Collection[str] | None = None) -> bool:
    """Whether one array is sound, which it is too if ``names`` are given and it has none of them."""
    if not body:
        return True
    if body[:8] != struct.pack(f"{order}II", *FLAGS_TAG):
        return False
    (_, flags), (_, sizes), (_, name), *parts = _elements(body, order)
    if names is not None and bytes(name).decode("latin-1") not in names:
        return True
    content = struct.unpack_from(f"{order}I", flags)[0]
    dimensions = struct.unpack(f"{order}{len(sizes) // 4}i", sizes)
    kinds = {kind for kind, _ in parts}
    if len(dimensions) < 2:
        return False
    if content & 0xFF == CELL_CLASS:
        whole = len(parts) == math.prod(dimensions) and kinds <= {MATRIX}
        return whole and all(_is_sound_matrix(part, order) for _, part in parts)
    if content & 0xFF == CHAR_CLASS:
        return len(parts) == 1 and kinds <= TEXT
    return content & 0xFF in NUMBER_CLASSES and len(parts) == (2 if content & IS_COMPLEX else 1) and kinds <= NUMBERS
