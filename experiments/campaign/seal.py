"""A hash of a campaign's rows and of what its file says of them, the same however the rows are cut into pieces."""

from __future__ import annotations

from hashlib import sha256
from typing import Any

SEAL = "sha256"  # its name among the file's metadata


class Seal:
    """The hash of rows that come a piece at a time.

    Parameters
    ----------
    schema
        The Arrow schema of every piece; its metadata, but for the seal itself, are hashed too.
    """

    def __init__(self, schema: Any) -> None:
        self._facts = sorted(item for item in (schema.metadata or {}).items() if item[0] != SEAL.encode())
        self._names = list(schema.names)
        self._columns = [sha256() for _ in self._names]

    def update(self, batch: Any) -> None:
        """Add the rows of an Arrow record batch."""
        for digest, column in zip(self._columns, batch.columns, strict=True):
            digest.update(_content(column))

    def __str__(self) -> str:
        columns = [(name, digest.hexdigest()) for name, digest in zip(self._names, self._columns, strict=True)]
        return sha256(repr((self._facts, columns)).encode()).hexdigest()


def _content(column: Any) -> bytes:
    """The cells of an Arrow array: numbers as floats, an empty cell as NaN; texts as Python writes them."""
    from pyarrow import types

    if types.is_string(column.type) or types.is_large_string(column.type):
        return "".join(map(repr, column.to_pylist())).encode()
    return bytes(column.cast("float64").to_numpy(zero_copy_only=False).tobytes())
