"""Ways to damage a file: its bytes, its lines and cells, the members of its JSON, and values that are odd."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from typing import Any

NUMBERS = (
    *("0", "-0.0", "1", "-1", "2", "5e-324", "-5e-324", "1e-308", "1e-160", "1e-20", "0.5", "1e20", "1e154", "1e160"),
    *(
        "1e300",
        "-1e300",
        "1.7e308",
        "1e308",
        "-1e308",
        "1e999",
        "nan",
        "inf",
        "-inf",
        "1e400",
        "9" * 30,
        "3",
        "8",
        "100",
    ),
)
"""Numbers as text."""

WORDS = (
    *("", " ", "a", "none", "true", "NaN", "\x1b[31m", "\x07", "\x00", "a\nb", "a\rb", '"', "'", ",", ";", "\t", "#"),
    *(
        "é",
        "﻿",
        "\u2028",
        "$\\frac$",
        "$x$",
        "<b>&amp;",
        "x" * 300,
        "1e",
        "0x10",
        "1_000",
        "1,5",
        "\u22121",
        "%s{}",
        "=1+1",
    ),
)
"""Words."""

VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 2, 10**40, 0.0, -0.0, 5e-324, 1e-160, 1e160, 1e300, -1e308, float("inf"), float("nan")),
    *("", "a", "\ud800", "\x1b", "x" * 300, [], {}, [[]], [1.0, 2.0], [[1.0, 2.0]], [0.0] * 50, [None], {"a": 1}),
)
"""Values of JSON, and what JSON has not."""


def bytes_changed(content: bytes, rng: random.Random) -> bytes:
    """A bit flipped, a byte changed, a piece left out, doubled or moved, or the end cut off."""
    if not content:
        return rng.randbytes(8)
    at, to = sorted((rng.randrange(len(content)), rng.randrange(len(content) + 1)))
    piece = content[at : min(to, at + rng.choice((1, 2, 8, 64, 4096)))]
    return rng.choice(
        (
            lambda: content[:at] + bytes([content[at] ^ 1 << rng.randrange(8)]) + content[at + 1 :],
            lambda: content[:at] + rng.randbytes(1) + content[at + 1 :],
            lambda: content[:at] + rng.choice((b"\xff", b"\x00", b"\x1b[2J", b"\xef\xbb\xbf", b"\r")) + content[at:],
            lambda: content[:at] + content[at + len(piece) :],
            lambda: content[:at] + piece + content[at:],
            lambda: content[:at],
            lambda: content[at:],
        )
    )()


def cell_changed(content: bytes, rng: random.Random) -> bytes:
    """A cell, a row or a column of a CSV changed, left out, doubled or moved."""
    lines = content.decode("utf-8", "replace").split("\n")
    rows = [line.split(",") for line in lines]
    row = rows[0 if rng.random() < 0.2 else rng.randrange(len(rows))]
    column = rng.randrange(len(row))

    def every(change: Callable[[list[str]], None]) -> None:
        for each in rows:
            if column < len(each):
                change(each)

    def put(value: str) -> Callable[[list[str]], None]:
        return lambda each: each.__setitem__(column, value)

    odd = rng.choice(NUMBERS if rng.random() < 0.7 else WORDS)
    rng.choice(
        (
            lambda: put(odd)(row),
            lambda: put(odd)(row),
            lambda: put(odd)(row),
            lambda: rows[1:] and [put(odd)(each) for each in rows[1:] if column < len(each)],
            lambda: row.pop(column),
            lambda: row.insert(column, odd),
            lambda: every(lambda each: each.pop(column) and None),
            lambda: every(lambda each: each.insert(column, each[column])),
            lambda: rows.remove(row),
            lambda: rows.insert(rows.index(row), list(row)),
            lambda: rows.__delitem__(slice(rng.randrange(len(rows)), None)),
            lambda: rows.__delitem__(slice(1, rng.randrange(1, len(rows) + 1))),
            lambda: rng.shuffle(rows),
        )
    )()
    return "\n".join(map(",".join, rows)).encode("utf-8", "surrogatepass")


def member_changed(content: bytes, rng: random.Random) -> bytes:
    """A member of a JSON text, wherever it lies, changed, left out, named otherwise or given twice."""
    tree = json.loads(content)
    places = list(_places(tree))
    holder, key = rng.choice(places)
    how = rng.random()
    if how < 0.6:
        holder[key] = rng.choice(VALUES)
    elif how < 0.7 and isinstance(holder[key], float):
        holder[key] *= rng.choice((-1.0, 1e-9, 1e9, 1e100, 1e-100))
    elif how < 0.8:
        del holder[key]
    elif how < 0.9 and isinstance(holder, dict):
        holder[rng.choice(WORDS)] = holder.pop(key)
    elif isinstance(holder, list):
        holder.insert(key, holder[key])
    else:
        text = json.dumps(holder[key])
        holder[key] = "@@@"
        return json.dumps(tree).replace('"@@@"', f"{text}, {json.dumps(key)}: {text}").encode()
    return json.dumps(tree).encode()


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Each object or list with each of its keys, those within it too."""
    keys = list(tree) if isinstance(tree, dict) else list(range(len(tree))) if isinstance(tree, list) else []
    return [(tree, key) for key in keys] + [place for key in keys for place in _places(tree[key])]


def changed(content: bytes, suffix: str, rng: random.Random) -> bytes:
    """A file of this suffix, damaged once to three times."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        finer = {".json": member_changed, ".csv": cell_changed}.get(suffix)
        if finer is None or rng.random() < 0.2:
            content = bytes_changed(content, rng)
        else:
            try:
                content = finer(content, rng)
            except (ValueError, IndexError):  # damaged too much for it
                content = bytes_changed(content, rng)
    return content
