"""A MAT file of version 7.3, which is an HDF5 file -> its variables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache, partial
from typing import Any

import h5py
import numpy as np

from identification.base.arrays import Array
from identification.formats.mat_variable import Variable, nothing, unreadable
from identification.formats.sizes import MOST_BYTES

SIGNATURE = b"\x89HDF\r\n\x1a\n"
USER_BLOCK = 512  # bytes, in which MATLAB writes a head as of level 5
MOST_CELLS = 100_000


def is_hdf5(content: bytes) -> bool:
    """Whether a file's first bytes say that it is an HDF5 file, of MATLAB or of another program."""
    return content.startswith((SIGNATURE, b"MATLAB 7.3")) or content.startswith(SIGNATURE, USER_BLOCK)


def read_variables(file: h5py.File) -> Iterator[tuple[str, Variable]]:
    """The names and variables of an open file of version 7.3; what belongs to its objects and cells is left out.

    Raises
    ------
    One of DAMAGED
        The file is not built as HDF5 has it; so does what reads a variable, if that is larger than MOST_BYTES or lies
        in another file too.
    """
    return ((name, variable) for name, variable in _members(file) if not name.startswith("#"))


def _members(group: h5py.Group) -> Iterator[tuple[str, Variable]]:
    for name in group:
        if isinstance(group.get(name, getlink=True), h5py.HardLink):  # a soft one leads anywhere, to other files too
            yield name, _variable(group[name])


def _variable(item: h5py.Group | h5py.Dataset) -> Variable:
    """What a data set, or a group of fields, is to MATLAB, which has the axes in the other order."""
    is_group = isinstance(item, h5py.Group)
    kind = item.attrs.get("MATLAB_class", "struct" if is_group else _usual_class(item.dtype))
    kind = kind.decode("latin-1") if isinstance(kind, bytes) else str(kind)
    if "MATLAB_object_decode" in item.attrs:
        return Variable(kind, (), False, unreadable, nothing)
    if is_group:
        is_struct = kind == "struct"
        fields = cache(lambda: dict(_members(item))) if is_struct else nothing
        return Variable(kind if is_struct else "sparse", (1, 1), False, unreadable, fields)
    shape = (0, 0) if "MATLAB_empty" in item.attrs else item.shape[::-1]
    is_complex = item.dtype.kind == "c" or item.dtype.names == ("real", "imag")
    return Variable(kind, shape, is_complex, partial(_values, item, kind), nothing)


def _usual_class(dtype: np.dtype[Any]) -> str:
    """The class of a data set that another program than MATLAB wrote."""
    if dtype.kind == "O":
        return "cell"
    return "double" if dtype.kind in "biufc" or dtype.names == ("real", "imag") else "unknown"


def _values(item: h5py.Dataset, kind: str) -> Array:
    lengths = [math.prod(map(int, shape)) for shape in (item.shape, item.chunks or ())]
    if item.is_virtual or item.external or max(lengths) * item.dtype.itemsize > MOST_BYTES:
        raise ValueError
    if "MATLAB_empty" in item.attrs:
        return np.zeros((0, 0))
    if kind == "cell":
        if lengths[0] > MOST_CELLS:
            raise ValueError
        held = [item.file[each] for each in item[()].ravel()]
        if any(isinstance(each, h5py.Group) or each.dtype.kind == "O" for each in held):  # no labels
            raise ValueError
        return np.fromiter((_variable(each).read() for each in held), dtype=object).reshape(item.shape).T
    if item.dtype.kind not in "biufc" and item.dtype.names != ("real", "imag"):
        raise ValueError
    values: Array = item[()].T
    if kind == "char":
        return np.array([chr(each) for each in values.ravel()], dtype="U1").reshape(values.shape)
    if not item.dtype.names:
        return values
    pairs = np.empty(values.shape, dtype=complex)
    pairs.real, pairs.imag = values["real"], values["imag"]
    return pairs
