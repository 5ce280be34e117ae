"""The MODEL that a command is given: a file, or else the name of one of the thesis's sets."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from identification.base.errors import InputError
from identification.base.files import is_folder, is_there
from identification.model.model_file import IdentifiedModel, read_model


def asked_model(name: str) -> IdentifiedModel:
    """Read a model.json; where there is no such file and the name is one word, give the thesis's set of that name.

    Raises
    ------
    InputError
        As :func:`identification.model.model_file.read_model` and :func:`data.thesis.model_named`; or something else
        is named data here and hides the sets.
    """
    if is_there(Path(name)) or not name.isidentifier():
        return read_model(Path(name))
    data = find_spec("data")
    if data is not None and data.origin is not None and not is_folder(Path(data.origin).with_name("thesis")):
        raise InputError(f"{name}: no such file, and another package 'data' ({data.origin}) hides the thesis's sets")
    from data.thesis import model_named

    return model_named(name)
