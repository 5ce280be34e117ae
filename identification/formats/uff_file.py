"""A universal file (UFF, data sets 58 and 58b) of sweeps -> one table for each test in it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyuff

from identification.base.arrays import Array, Whole
from identification.base.errors import InputError
from identification.base.files import read_bytes
from identification.formats.columns import INPUTS, Table, quoted
from identification.formats.reading import Reading
from identification.formats.sizes import require_size

FUNCTION = 58
TIME_RESPONSE, FREQUENCY_RESPONSE, COHERENCE = 1, 4, 6  # function types
UNITS = {"time": ("s", "sec", "second", "seconds"), "frequency": ("Hz", "hertz")}
UNDECLARED = ("", "none", "unknown", "null")
POINT = ("rsp_node", "rsp_dir", "ref_node", "ref_dir")

Function = Mapping[str, Any]  # what pyuff makes of a data set, with "number", its place in the file from 1


def read_uff(path: Path, reading: Reading) -> list[Table]:
    """Read the frequency responses (function type 4) or the records (type 1) of a universal file, each a test.

    A coherence (type 6) belongs to the frequency response of the same nodes and directions, the second one to the
    second. The record of a test is a time response whose first identification line is ``input`` or ``input_held``
    and one where it is ``output``, the second input with the second output. A line at 0 Hz is left out. So are
    other functions and other data sets.

    Raises
    ------
    InputError
        The file cannot be read, holds none of these, or holds one that is not complete.
    """
    functions = _functions(path)
    synthetic = any("SYNTHETIC" in str(function[f"id{k}"]) for function in functions for k in range(1, 6))
    responses = [function for function in functions if function["func_type"] == FREQUENCY_RESPONSE]
    signals = [function for function in functions if function["func_type"] == TIME_RESPONSE]
    inputs = [signal for signal in signals if signal["id1"] in INPUTS]
    outputs = [signal for signal in signals if signal["id1"] == "output"]
    if responses and (inputs or outputs):
        raise InputError(f"{path}: holds frequency responses and records of input and output; expected one of them")
    if responses:
        coherences = [function for function in functions if function["func_type"] == COHERENCE]
        tests = [_response(path, response, responses, coherences) for response in responses]
    elif inputs or outputs:
        if len(inputs) != len(outputs):
            raise InputError(f"{path}: holds {len(inputs)} inputs and {len(outputs)} outputs; expected as many")
        tests = [_record(path, one, other) for one, other in zip(inputs, outputs, strict=True)]
    else:
        found = f" but time responses {', '.join(quoted(s['id1']) for s in signals[:3])}" if signals else ""
        raise InputError(
            f"{path}: holds no frequency response{found}; expected data sets 58 of function type 4, "
            "or of type 1 with the first line input (or input_held) and output"
        )
    return [
        Table(path, columns, kept, in_lines=False, test=str(k) if len(tests) > 1 else None, synthetic=synthetic)
        for k, (columns, kept) in enumerate(tests, 1)
    ]


def _functions(path: Path) -> list[Function]:
    """The functions of the file's data sets 58, complete."""
    require_size(path)
    read_bytes(path)  # pyuff does not say why it cannot open a file
    number = 0
    functions: list[Function] = []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            file = pyuff.UFF(str(path))
            for number, kind in enumerate(file.get_set_types(), 1):
                if kind == FUNCTION:
                    function = {"number": number, **file.read_sets(number - 1)}
                    sizes = {function["x"].size, function["data"].size, function["num_pts"]}
                    if len(sizes) > 1:
                        raise EOFError(f"{min(sizes)} of {max(sizes)} values")
                    functions.append(function)
    except Exception as error:  # pyuff raises nothing narrower, and says what is wrong only here and there
        place = f"{path}, data set {number}" if number else f"{path}"
        raise InputError(f"{place}: cannot be read ({error}); expected a complete data set 58") from None
    return functions


def _response(
    path: Path, response: Function, responses: Sequence[Function], coherences: Sequence[Function]
) -> tuple[dict[str, Array], Whole]:
    _check(path, response, "frequency", is_complex=True)
    kept = np.flatnonzero(response["x"] != 0)
    columns = {"frequency_hz": response["x"][kept], "response": response["data"][kept]}
    siblings = [other["number"] for other in responses if _point(other) == _point(response)]
    own = [coherence for coherence in coherences if _point(coherence) == _point(response)]
    if own:
        if len(own) != len(siblings):
            raise InputError(
                f"{path}, data set {response['number']}: {len(siblings)} frequency responses and {len(own)} coherences "
                "have its nodes and directions; expected one coherence for each"
            )
        coherence = own[siblings.index(response["number"])]
        _check(path, coherence, "frequency", is_complex=False)
        _check_same(path, response, coherence)
        columns["coherence"] = coherence["data"][kept]
    return columns, kept + 1


def _record(path: Path, one: Function, other: Function) -> tuple[dict[str, Array], Whole]:
    for signal in (one, other):
        _check(path, signal, "time", is_complex=False)
        if signal["abscissa_spacing"] != 1:
            raise InputError(f"{path}, data set {signal['number']}: the abscissa is uneven; expected an even one")
    _check_same(path, one, other)
    columns = {"time_s": one["x"], one["id1"]: one["data"], "output": other["data"]}
    return columns, np.arange(1, one["x"].size + 1)


def _check(path: Path, function: Function, abscissa: str, *, is_complex: bool) -> None:
    unit = str(function["abscissa_axis_units_lab"])
    place = f"{path}, data set {function['number']}"
    if unit.lower() not in (*map(str.lower, UNITS[abscissa]), *UNDECLARED):
        raise InputError(f"{place}: the abscissa's unit is {quoted(unit)}; expected {UNITS[abscissa][0]}")
    if np.iscomplexobj(function["data"]) != is_complex:
        found, expected = ("real", "complex") if is_complex else ("complex", "real")
        raise InputError(f"{place}: the values are {found}; expected {expected} ones")


def _check_same(path: Path, one: Function, other: Function) -> None:
    if not np.array_equal(one["x"], other["x"]):
        raise InputError(
            f"{path}, data set {other['number']}: the abscissa is another than that of data set {one['number']}; "
            "expected the same"
        )


def _point(function: Function) -> tuple[Any, ...]:
    return tuple(function[key] for key in POINT)
