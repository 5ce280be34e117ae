"""A MATLAB file of sweeps -> one table for each test in it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat
from scipy.io.matlab import MatReadWarning

from identification.base.arrays import Array
from identification.base.errors import InputError
from identification.base.files import read_bytes
from identification.formats.columns import COMPLEX, Table, choose_columns, quoted, split_tests
from identification.formats.mat_structure import is_sound
from identification.formats.reading import Reading
from identification.formats.sizes import require_bytes, require_size

NUMERIC = {"double", "single", "logical"} | {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)}
LABELS = NUMERIC | {"char", "cell"}
NUMBER = 8  # bytes


def read_mat(path: Path, reading: Reading) -> list[Table]:
    """Read the tests of a MAT file of version 4 to 7: variables with the names of a CSV's columns, or ``response``.

    Frequency or time is a vector of N. The other columns are vectors of N, with ``test`` a vector of N labels for
    several tests; or they are all N x T for T tests, with ``test`` a vector of T labels or left out for 1 to T.
    Labels are numbers, the rows of a char array, or a cell array of either. Other variables are left out; one with
    the name SYNTHETIC says what it says.

    Raises
    ------
    InputError
        The file cannot be read, lacks a variable, or holds one of a wrong type or size.
    """
    require_size(path)
    headers = _scipy(path, lambda: whosmat(str(path), appendmat=False))
    classes = {name: kind for name, _, kind in headers}
    usable = {name for name, kind in classes.items() if kind in (LABELS if name == "test" else NUMERIC)}
    names = [name if name in usable else f"{name} ({kind})" for name, kind in classes.items()]
    wanted = choose_columns(str(path), names, "variables")
    with_labels = [*wanted, "test"] if "test" in usable else wanted
    for name, shape, _ in headers:
        if name in with_labels:
            require_bytes(f"{path}: {name} is {' x '.join(map(str, shape))},", NUMBER * math.prod(map(int, shape)))
    if not is_sound(read_bytes(path), with_labels):
        raise InputError(f"{path}: is damaged; expected {', '.join(with_labels)} of numbers (or of text, test)")
    variables = _scipy(path, lambda: loadmat(str(path), appendmat=False, variable_names=with_labels))
    columns = {name: _numbers(path, name, variables[name]) for name in wanted}
    first, *others = wanted
    points = columns[first].size
    if columns[first].ndim > 1:
        raise InputError(f"{path}: {first} is {_size(columns[first])}; expected a vector")
    for name in others:
        if columns[name].shape != columns[others[0]].shape or len(columns[name]) != points:
            raise InputError(
                f"{path}: {name} is {_size(columns[name])}, {first} holds {points} numbers; expected vectors of "
                f"{points}, or {points} rows and a column for each test, in all of {', '.join(others)}"
            )
    table = Table(path, columns, np.arange(1, points + 1), in_lines=False, synthetic="SYNTHETIC" in classes)
    if columns[others[0]].ndim == 1:
        return split_tests(table, _labels(path, variables["test"], points)) if "test" in usable else [table]
    count = columns[others[0]].shape[1]
    labels = _labels(path, variables["test"], count) if "test" in usable else [str(k) for k in range(1, count + 1)]
    if len(set(labels)) < count:
        raise InputError(
            f"{path}: test holds {', '.join(labels)}; expected one for each column of {others[0]}, all different"
        )
    return [
        replace(table, columns={first: columns[first]} | {name: columns[name][:, k] for name in others}, test=label)
        for k, label in enumerate(labels)
    ]


def _scipy(path: Path, read: Callable[[], Any]) -> Any:
    """What scipy reads; it raises whatever comes up while it follows a damaged file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", MatReadWarning)  # a variable twice
            return read()
    except NotImplementedError:
        raise InputError(
            f"{path}: is a MAT file of version 7.3; expected version 7 or older (in MATLAB, save with -v7)"
        ) from None
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: cannot be read ({reason}); expected a MAT file of version 4 to 7") from None


def _numbers(path: Path, name: str, value: Array) -> Array:
    """The variable as a vector or a matrix of real numbers, or complex ones where it is the response."""
    if np.iscomplexobj(value) != (name == COMPLEX):
        found, expected = ("complex", "real") if np.iscomplexobj(value) else ("real", "complex")
        raise InputError(f"{path}: {name} is {found}; expected {expected} numbers")
    if value.ndim > 2:
        raise InputError(f"{path}: {name} is {_size(value)}; expected a vector or a matrix")
    value = value.ravel() if 1 in value.shape else value
    return value.astype(complex if name == COMPLEX else float, copy=False)


def _labels(path: Path, value: Array, count: int) -> list[str]:
    labels = []
    for k, item in enumerate(value.ravel(), 1):
        content = np.asarray(item).ravel()  # of a cell, or a number or text itself
        label = " ".join(str(content[0]).split()) if content.size == 1 else ""
        if not label or content.dtype.kind not in "biufU":
            raise InputError(f"{path}: test({k}) is {quoted(str(item))}; expected a number or a name")
        labels.append(label.removesuffix(".0"))
    if len(labels) != count:
        raise InputError(f"{path}: test holds {len(labels)} labels; expected {count}")
    return labels


def _size(value: Array) -> str:
    return " x ".join(str(length) for length in (*value.shape, *([1] if value.ndim == 1 else [])))
