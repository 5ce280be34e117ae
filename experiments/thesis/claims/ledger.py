"""The ledger of what the thesis prints: recompute each claim, and say whether it agrees."""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from data.thesis import THESIS
from experiments.tables import read_cells
from experiments.thesis.claims.inputs import Inputs, rounded_inputs
from experiments.thesis.claims.printed_number import PrintedNumber, read_number
from identification.base.errors import InputError

LEDGER = THESIS / "claims.csv"
COLUMNS = ("id", "where", "quote", "printed", "unit", "kind", "compute", "status", "touches", "reason", "evidence")
SLACK = 1e-9  # relative; the square of a printed frequency may lie half-way between two printed roundings of it

FUNCTION = r"experiments(\.\w+)+:[a-zA-Z]\w*"

Compute = Callable[[Inputs], Mapping[str, float]]


def read_ledger(path: Path = LEDGER) -> pd.DataFrame:
    """Read claims.csv; every cell is text as it stands there.

    Raises
    ------
    InputError
        The file is no such table, see :func:`experiments.tables.read_cells`, an id stands twice, or ``compute`` does
        not name a function of this room.
    """
    ledger = read_cells(path, COLUMNS)
    twice = ledger["id"][ledger["id"].duplicated()]
    if len(twice):
        raise InputError(f"{path}: the id {twice.iloc[0]} occurs twice; expected every id once")
    for name, compute in ledger[["id", "compute"]].itertuples(index=False):
        if compute and not re.fullmatch(FUNCTION, compute):
            raise InputError(
                f"{path}: compute of {name} is '{compute}'; expected experiments.module:function or nothing"
            )
    return ledger


def recompute(ledger: pd.DataFrame) -> pd.DataFrame:
    """Compute every claim of a ledger again.

    Parameters
    ----------
    ledger
        As :func:`read_ledger` returns it. ``compute`` names a function MODULE:FUNCTION that takes the rounded
        inputs and returns id -> value. An id ``NAME#2`` is NAME printed a second time. A statement is printed as
        ``true``, which is 1; its function returns 1 or 0.

    Returns
    -------
    DataFrame
        The ledger with ``computed``, ``half_unit`` (of the last printed digit), ``tolerance`` and ``verdict``:
        ``agrees`` when computed - printed is within the tolerance, ``input`` if the kind is input: then the number
        was transcribed, not reproduced; ``differs`` otherwise; ``not_reproducible`` when the function returns NaN,
        because the thesis does not print what the number depends on; ``unchecked`` without ``compute``.

    Notes
    -----
    tolerance = half_unit + SLACK |printed|, and, only where computed - printed exceeds that, the propagated rounding
    of the inputs. This is linear: each rounded input that the function reads is moved by plus and minus half a
    unit of its own last digit, and the larger changes are summed. A statement, which has no digits, gets no tolerance;
    nor do runs and designs move with the inputs, which take the set ``implied`` as it stands.

    Raises
    ------
    InputError
        A function does not exist or does not give a row's id.
    """
    inputs = rounded_inputs(ledger)
    rows = ledger.assign(computed=np.nan, half_unit=0.0, tolerance=np.nan, verdict="unchecked")
    for compute, claims in ledger.groupby("compute", sort=False):
        numbers = {name: read_number(text) for name, text in claims[["id", "printed"]].itertuples(index=False)}
        rows.loc[claims.index, "half_unit"] = [number.half_unit for number in numbers.values()]
        if compute:
            rows.loc[claims.index, ["computed", "tolerance"]] = _compare(str(compute), numbers, inputs)
    compared = rows["compute"] != ""
    error = (rows["computed"] - [read_number(text).value for text in rows["printed"]]).abs()
    within = np.where(rows["kind"] == "input", "input", "agrees")
    verdict = np.where(error <= rows["tolerance"], within, "differs")
    rows.loc[compared, "verdict"] = np.where(rows["computed"].isna(), "not_reproducible", verdict)[compared]
    return rows


def _compare(name: str, numbers: Mapping[str, PrintedNumber], inputs: Mapping[str, PrintedNumber]) -> np.ndarray:
    """Computed values and tolerances of the printed numbers, shape (numbers, 2)."""
    compute = _function(name)
    recorder = _Recorder({key: number.value for key, number in inputs.items()})
    values = compute(recorder)
    keys = [row.partition("#")[0] for row in numbers]
    for key in keys:
        if key not in values:
            raise InputError(f"{name} gives {', '.join(values)}; expected '{key}' among them")
    printed = np.array([number.value for number in numbers.values()])
    computed = np.array([values[key] for key in keys], dtype=float)
    tolerance = np.array([number.half_unit for number in numbers.values()]) + SLACK * np.abs(printed)
    digits = np.array([number.half_unit > 0 for number in numbers.values()])
    outside = (np.abs(computed - printed) > tolerance) & digits
    if outside.any():
        spread = np.zeros(len(keys))
        for moved_key in sorted(recorder.read):
            number = inputs[moved_key]
            moved = [compute(dict(recorder) | {moved_key: number.value + s * number.half_unit}) for s in (1, -1)]
            spread += np.max([[abs(other[key] - values[key]) for key in keys] for other in moved], axis=0)
        tolerance[outside] += spread[outside]
    return np.column_stack([computed, tolerance])


class _Recorder(dict[str, float]):
    """A dictionary that remembers which of its keys were asked for."""

    def __init__(self, content: Mapping[str, float]) -> None:
        super().__init__(content)
        self.read: set[str] = set()

    def __getitem__(self, key: str) -> float:
        self.read.add(key)
        return super().__getitem__(key)


def _function(name: str) -> Compute:
    module, _, function = name.partition(":")
    try:
        found: Compute = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise InputError(f"the ledger names '{name}', which cannot be imported ({error})") from None
    return found
