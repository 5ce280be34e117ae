"""A MATLAB file of sweeps -> one table for each test in it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import loadmat, whosmat

from identification.base.arrays import Array
from identification.base.errors import InputError
from identification.base.files import read_bytes
from identification.formats import mat_hdf5, mat_level_5
from identification.formats.columns import COMPLEX, Table, quoted, split_tests
from identification.formats.first_bytes import first_bytes
from identification.formats.mat_choice import choose_variables
from identification.formats.mat_variable import DAMAGED, Variable, nothing
from identification.formats.reading import Reading
from identification.formats.sizes import require_bytes, require_size

NUMBER = 8  # bytes


def read_mat(path: Path, reading: Reading) -> list[Table]:
    """Read the tests of a MAT file: variables with the names of a CSV's columns, or ``response``.

    Frequency or time is a vector of N. The other columns are vectors of N, with ``test`` a vector of N labels for
    several tests; or they are all N x T for T tests, with ``test`` a vector of T labels or left out for 1 to T.
    Vectors lie along any axis. Labels are numbers, the rows of a char array, or a cell array of either. Which other
    variables and fields are taken for these, :func:`identification.formats.mat_choice.choose_variables` says. The
    rest is left out; a variable SYNTHETIC says what it says.

    Raises
    ------
    InputError
        The file cannot be read, lacks a variable, or holds one of a wrong type or size.
    """
    require_size(path)
    with _variables(path) as variables:
        chosen = choose_variables(path, variables, reading.columns)
        for name, (variable, _) in chosen.items():
            size = NUMBER * math.prod(map(int, variable.shape))
            require_bytes(f"{path}: {name} is {_size(variable.shape)},", size)
        found = {name: _read(path, name, variable, factor) for name, (variable, factor) in chosen.items()}
        is_synthetic = "SYNTHETIC" in variables
    labels = found.pop("test", None)
    columns = {name: _numbers(path, name, value) for name, value in found.items()}
    first, *others = columns
    points = columns[first].size
    if columns[first].ndim > 1:
        raise InputError(f"{path}: {first} is {_size(columns[first].shape)}; expected a vector")
    for name in others:
        if columns[name].shape != columns[others[0]].shape or len(columns[name]) != points:
            raise InputError(
                f"{path}: {name} is {_size(columns[name].shape)}, {first} holds {points} numbers; expected vectors of "
                f"{points}, or {points} rows and a column for each test, in all of {', '.join(others)}"
            )
    table = Table(path, columns, np.arange(1, points + 1), in_lines=False, synthetic=is_synthetic)
    if columns[others[0]].ndim == 1:
        return [table] if labels is None else split_tests(table, _labels(path, labels, points))
    count = columns[others[0]].shape[1]
    names = [str(k) for k in range(1, count + 1)] if labels is None else _labels(path, labels, count)
    if len(set(names)) < count:
        raise InputError(
            f"{path}: test holds {', '.join(names)}; expected one for each column of {others[0]}, all different"
        )
    return [
        replace(table, columns={first: columns[first]} | {name: columns[name][:, k] for name in others}, test=label)
        for k, label in enumerate(names)
    ]


@contextmanager
def _variables(path: Path) -> Iterator[dict[str, Variable]]:
    """The variables of a file of any version."""
    head = first_bytes(path)
    with ExitStack() as stack:
        try:
            if mat_hdf5.is_hdf5(head):
                file = stack.enter_context(h5py.File(path, "r", locking=False))
                listed = mat_hdf5.read_variables(file)
            elif mat_level_5.is_level_5(head):
                listed = mat_level_5.read_variables(read_bytes(path))
            else:
                listed = _of_level_4(path)
            variables: dict[str, Variable] = {}
            for name, variable in listed:
                if name in variables:
                    raise ValueError(f"it holds two variables {quoted(name)}")
                variables[name] = variable
        except DAMAGED as error:
            reason = " ".join(str(error).split()) or "it is damaged"
            raise InputError(f"{path}: cannot be read ({reason}); expected a whole MAT file") from None
        yield variables


def _of_level_4(path: Path) -> Iterator[tuple[str, Variable]]:
    """The names and variables of a file of level 4, MATLAB's -v4, which holds no structures."""
    for name, shape, kind in _scipy(lambda: whosmat(str(path), appendmat=False)):
        yield name, Variable(kind, shape, False, partial(_level_4_values, path, name), nothing)


def _level_4_values(path: Path, name: str) -> Array:
    read = _scipy(lambda: loadmat(str(path), appendmat=False, variable_names=[name], chars_as_strings=False))
    return np.asarray(read[name])


def _scipy(read: Callable[[], Any]) -> Any:
    """What scipy reads, which warns of sizes and numbers that no file has."""
    with warnings.catch_warnings():
        for each in (UserWarning, RuntimeWarning):
            warnings.simplefilter("error", each)
        return read()


def _read(path: Path, name: str, variable: Variable, factor: float) -> Array:
    try:
        value = np.atleast_1d(variable.read())
    except DAMAGED:
        raise InputError(f"{path}: {name} is damaged; expected a whole {variable.kind} array") from None
    return value if factor == 1 else value * factor


def _numbers(path: Path, name: str, value: Array) -> Array:
    """The variable as a vector or a matrix of real numbers, or complex ones where it is the response."""
    if np.iscomplexobj(value) != (name == COMPLEX):
        found, expected = ("complex", "real") if np.iscomplexobj(value) else ("real", "complex")
        instead = " (or a magnitude with a phase, or real and imag)" if name == COMPLEX else ""
        raise InputError(f"{path}: {name} is {found}; expected {expected} numbers{instead}")
    if value.size and value.size == max(value.shape):
        value = value.ravel()
    if value.ndim > 2:
        raise InputError(f"{path}: {name} is {_size(value.shape)}; expected a vector or a matrix")
    return value.astype(complex if name == COMPLEX else float, copy=False)


def _labels(path: Path, value: Array, count: int) -> list[str]:
    if value.dtype.kind == "U":
        value = np.array(["".join(row).strip() for row in np.atleast_2d(value)])
    labels = []
    for k, item in enumerate(value.ravel(), 1):
        content = np.asarray(item)  # of a cell, or a number or text itself
        if content.dtype.kind == "U":
            content = np.array("".join(content.ravel()))
        label = " ".join(str(content.item()).split()) if content.size == 1 else ""
        if not label or content.dtype.kind not in "biufU":
            raise InputError(f"{path}: test({k}) is {quoted(str(item))}; expected a number or a name")
        labels.append(label.removesuffix(".0"))
    if len(labels) != count:
        raise InputError(f"{path}: test holds {len(labels)} labels; expected {count}")
    return labels


def _size(shape: Sequence[int]) -> str:
    return " x ".join(str(length) for length in (*shape, *([1] if len(shape) == 1 else [])))
