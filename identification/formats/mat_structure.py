"""Whether a MAT file is built as its tags say: scipy follows them unchecked, and a damaged one ends the process."""

from __future__ import annotations

import math
import struct
from collections.abc import Collection, Iterator

HEADER = 128
MATRIX, COMPRESSED = 14, 15
FLAGS_TAG = 6, 8  # type and size of an array's first element
NUMBERS = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13}
TEXT = NUMBERS | {16, 17, 18}
CELL_CLASS, CHAR_CLASS, NUMBER_CLASSES = 1, 4, range(6, 16)
IS_COMPLEX = 0x0800


def is_sound(content: bytes, names: Collection[str]) -> bool:
    """Whether the variables of these names have types, sizes and numbers of elements that go together.

    They are arrays of numbers or text, or cell arrays of such. What is compressed has a checksum and needs no
    such care; nor do files older or newer than level 5, the format of MATLAB's -v6 and -v7.

    References
    ----------
    MathWorks, "MAT-File Format", level 5.
    """
    order = "<" if content[126:128] == b"IM" else ">"
    if len(content) < HEADER or 0 in content[:4] or content[125 if content[126:127] == b"I" else 124] != 1:
        return True
    try:
        elements = _elements(memoryview(content)[HEADER:], order)
        return all(_is_sound_matrix(body, order, names) for kind, body in elements if kind == MATRIX)
    except (struct.error, ValueError, RecursionError):
        return False


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
