"""The tables that the page holds: whole where they are short, thinned by envelope or rounded where they are long."""

from __future__ import annotations

import gzip
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from io import StringIO
from math import ceil

import numpy as np
import pandas as pd

from identification.base.arrays import Real

LONGEST = 300_000
"""Letters of a table that the page still holds whole; with all tables and pictures it stays under 3 MB."""

ROWS = 7000
"""Most rows of a table over time that is thinned."""

DIGITS = 5
"""Significant digits of the numbers of a table that the page does not hold whole."""

TIME = "time_s"


@dataclass(frozen=True)
class Embedded:
    """A table in the page.

    Parameters
    ----------
    text
        What the link saves.
    said
        What was left out, or nothing of a whole table.
    timed
        Whether it is a table over time.
    """

    text: str
    said: str
    timed: bool

    @property
    def packed(self) -> str:
        """The text compressed, in letters and digits: nothing in it is read as HTML."""
        return packed(self.text.encode("utf-8"))


def embedded(tables: Mapping[str, str]) -> dict[str, Embedded]:
    """Return what the page holds of the text of each table, by its name."""
    return {name: _embedded(name, text) for name, text in tables.items()}


def packed(content: bytes) -> str:
    """Bytes compressed, in letters and digits; the same bytes give the same letters."""
    return b64encode(gzip.compress(content, mtime=0)).decode()


def thinned(values: Real, size: int) -> Real:
    """The least and the greatest value of each column in every ``size`` rows, in the order in which they come.

    Parameters
    ----------
    values
        Shape (rows, columns); NaN where a column has no value.
    size
        Rows that become two.

    Returns
    -------
    ndarray
        Shape (2 ceil(rows/size), columns); NaN where a column has no value in any of the rows.
    """
    count, columns = ceil(len(values) / size), values.shape[1]
    padded = np.full((count * size, columns), np.nan)
    padded[: len(values)] = values
    blocks = padded.reshape(count, size, columns)
    least, greatest = np.fmin.reduce(blocks, axis=1), np.fmax.reduce(blocks, axis=1)
    first = (blocks == least[:, None]).argmax(axis=1) <= (blocks == greatest[:, None]).argmax(axis=1)
    kept = np.empty((count, 2, columns))
    kept[:, 0], kept[:, 1] = np.where(first, least, greatest), np.where(first, greatest, least)
    return kept.reshape(2 * count, columns)


def _embedded(name: str, text: str) -> Embedded:
    body = "".join(line for line in text.splitlines(keepends=True) if not line.startswith("#"))
    timed = body.startswith(f"{TIME},")
    if len(text) <= LONGEST:
        return Embedded(text, "", timed)
    table, said = pd.read_csv(StringIO(body)), f"rounded to {DIGITS} digits"
    size = ceil(2 * len(table) / ROWS)
    if timed and size > 2:
        time, columns = table[TIME].to_numpy(), table.columns.drop(TIME)
        begins = np.arange(0, len(time), size)
        times = np.stack([begins, np.minimum(begins + size // 2, len(time) - 1)], axis=1).ravel()
        table = pd.DataFrame(thinned(table[columns].to_numpy(), size), columns=columns)
        table.insert(0, TIME, time[times])
        said = f"the least and the greatest value of every {size} rows, {said}"
    shortened = table.to_csv(index=False, float_format=f"%.{DIGITS}g", lineterminator="\n")
    return Embedded(f"# results/{name}.csv: {said}\n{shortened}", said, timed)
