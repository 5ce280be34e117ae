"""A universal file (UFF, data sets 58 and 58b) of sweeps -> one table for each test in it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identification.base.arrays import Array
from identification.base.errors import InputError
from identification.formats.columns import COMPLEX, INPUTS, Table, quoted
from identification.formats.reading import Reading
from identification.formats.uff_ends import of_one_plant
from identification.formats.uff_function import UNDECLARED, Function, read_functions

TIME_RESPONSE, COHERENCE = 1, 6
RESPONSES = 4, 5  # of frequency, and transmissibilities
KINDS = (
    *("general function", "time response", "auto spectrum", "cross spectrum", "frequency response"),
    *("transmissibility", "coherence", "auto correlation", "cross correlation", "power spectral density"),
    *("energy spectral density", "probability density", "spectrum"),
)
UNITS = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), "time_s"),
    **dict.fromkeys(("hz", "hertz"), "frequency_hz"),
    **dict.fromkeys(("rad/s", "rad/sec", "rad/second"), "omega"),
}
NAMES = {"time_s": "s", "frequency_hz": "Hz", "omega": "rad/s"}
EXPECTED = (
    "expected data sets 58 of function type 4, or of type 1 with the first line input (or input_held) and output, "
    "or --columns NAME=OURS for that line"
)


def read_uff(path: Path, reading: Reading) -> list[Table]:
    """Read the frequency responses (function type 4, or else 5) or the records (type 1) of a universal file.

    A coherence (type 6) belongs to the frequency response of the same nodes and directions, the second one to the
    second. The record of a test is a time response whose first identification line is ``input`` or ``input_held``,
    or stands for it in ``reading.columns``, and one where it is ``output``, the second input with the second output.
    Other functions and other data sets are left out.

    The tests are those of one plant: of one node and direction of the response and one of the reference. Of several
    responses, or where all have the same of several references (a hammer that moves), ``reading.node`` and
    ``reading.direction`` choose one.

    Raises
    ------
    InputError
        The file cannot be read, holds none of these, holds several plants, or holds one that is not complete.
    """
    functions = list(read_functions(path))
    synthetic = any("SYNTHETIC" in line for function in functions for line in function.text)
    responses = next((found for kind in RESPONSES if (found := _of_kind(functions, kind))), [])
    signals = _of_kind(functions, TIME_RESPONSE)
    called = [reading.columns.get(signal.text[0], signal.text[0]) for signal in signals]
    inputs = [(name, signal) for name, signal in zip(called, signals, strict=True) if name in INPUTS]
    outputs = [signal for name, signal in zip(called, signals, strict=True) if name == "output"]
    if responses and (inputs or outputs):
        raise InputError(f"{path}: holds frequency responses and records of input and output; expected one of them")
    if responses:
        coherences = _of_kind(functions, COHERENCE)
        chosen = of_one_plant(path, responses, [response.ends for response in responses], reading)
        tests = [_response(path, response, chosen, coherences) for response in chosen]
        remarks = [(f"the response is {each.ordinate}",) if each.ordinate else () for each in chosen]
    elif inputs or outputs:
        if len(inputs) != len(outputs):
            raise InputError(f"{path}: holds {len(inputs)} inputs and {len(outputs)} outputs; expected equal numbers")
        pairs = [(name, one, other) for (name, one), other in zip(inputs, outputs, strict=True)]
        ends = [(other.ends[0], one.ends[0]) for _, one, other in pairs]
        tests = [_record(path, *pair) for pair in of_one_plant(path, pairs, ends, reading)]
        remarks = [() for _ in tests]
    else:
        raise InputError(f"{path}: {_what_else(functions, signals)}; {EXPECTED}")
    return [
        Table(
            path,
            columns,
            np.arange(1, len(columns[COMPLEX if responses else "output"]) + 1),
            in_lines=False,
            test=str(k) if len(tests) > 1 else None,
            synthetic=synthetic,
            remarks=said,
        )
        for k, (columns, said) in enumerate(zip(tests, remarks, strict=True), 1)
    ]


def _of_kind(functions: Sequence[Function], kind: int) -> list[Function]:
    return [function for function in functions if function.kind == kind]


def _what_else(functions: Sequence[Function], signals: Sequence[Function]) -> str:
    if signals:
        return f"holds no frequency response but time responses {', '.join(quoted(s.text[0]) for s in signals[:3])}"
    kinds = dict.fromkeys(
        KINDS[f.kind] if f.kind in range(len(KINDS)) else f"function type {f.kind}" for f in functions
    )
    return f"holds no frequency response{' but ' if kinds else ''}{', '.join(kinds)}"


def _response(
    path: Path, response: Function, siblings: Sequence[Function], coherences: Sequence[Function]
) -> dict[str, Array]:
    """The columns of a frequency response, one of its ``siblings`` of the same nodes and directions."""
    unit = _unit(path, response, ("frequency_hz", "omega"))
    _check(path, response, is_complex=True)
    columns = {unit: response.x, COMPLEX: response.values}
    own = [coherence for coherence in coherences if coherence.ends == response.ends]
    if own:
        if len(own) != len(siblings):
            raise InputError(
                f"{path}, data set {response.number}: {len(siblings)} frequency responses and {len(own)} coherences "
                "have its nodes and directions; expected one coherence for each"
            )
        coherence = own[siblings.index(response)]
        _check(path, coherence, is_complex=False)
        _check_same(path, response, coherence)
        columns["coherence"] = coherence.values
    return columns


def _record(path: Path, driven: str, one: Function, other: Function) -> dict[str, Array]:
    for signal in (one, other):
        _unit(path, signal, ("time_s",))
        _check(path, signal, is_complex=False)
    _check_same(path, one, other)
    return {"time_s": one.x, driven: one.values, "output": other.values}


def _unit(path: Path, function: Function, columns: Sequence[str]) -> str:
    """The column that the abscissa's unit makes it, one of ``columns``, of which the first needs no unit."""
    unit = function.abscissa_unit.strip("[]() ").lower()
    column = columns[0] if unit in UNDECLARED else UNITS.get(unit)
    if column not in columns:
        expected = " or ".join(NAMES[name] for name in columns)
        raise InputError(
            f"{path}, data set {function.number}: the abscissa's unit is {quoted(function.abscissa_unit)}; "
            f"expected {expected}"
        )
    return str(column)


def _check(path: Path, function: Function, *, is_complex: bool) -> None:
    if np.iscomplexobj(function.values) != is_complex:
        found, expected = ("real", "complex") if is_complex else ("complex", "real")
        raise InputError(f"{path}, data set {function.number}: the values are {found}; expected {expected} ones")


def _check_same(path: Path, one: Function, other: Function) -> None:
    if not np.array_equal(one.x, other.x):
        raise InputError(
            f"{path}, data set {other.number}: the abscissa is another than that of data set {one.number}; "
            "expected the same"
        )
