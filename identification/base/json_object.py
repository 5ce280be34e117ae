"""JSON files of a known schema: their objects, members and numbers, each refused with a sentence if it is not there."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import Field, fields
from pathlib import Path
from typing import Any, TypeVar

from identification.base.errors import InputError, shown
from identification.base.files import read_text

Record = TypeVar("Record")
Reader = Callable[[Mapping[str, Any], str], Any]
"""What a member of an object holds, given the object and the member's name."""


def read_json(path: Path, schema: int) -> dict[str, Any]:
    """Read a JSON object whose member ``schema`` must have the given value.

    Raises
    ------
    InputError
        Another schema, or see :func:`read_object`.
    """
    content = read_object(path)
    found = content.get("schema")
    if isinstance(found, bool) or found != schema:
        raise InputError(f"{path}: schema is {shown(found)}; expected {schema}")
    return content


def read_object(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises
    ------
    InputError
        No such file, not JSON, not an object, or one within it that names a member twice.
    """
    text = read_text(path)
    try:
        content = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_object)
    except json.JSONDecodeError as error:
        raise InputError(f"{path}, line {error.lineno}: not JSON ({error.msg})") from None
    except (RecursionError, ValueError) as error:  # an InputError among them
        raise InputError(f"{path}: {error}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: holds {shown(content)}; expected an object")
    return content


def record(kind: type[Record], content: Mapping[str, Any], readers: Mapping[str, Reader] | None = None) -> Record:
    """Read a dataclass from the members of an object that have the names of its fields.

    Parameters
    ----------
    kind
        The dataclass. A field is a number, a text, a truth value, one of these or None, or of a type in ``readers``.
    content
        The object; it may have other members.
    readers
        Type of a field, as it is annotated -> how such a member is read.

    Raises
    ------
    InputError
        A member is missing or not of its field's type.
    """
    known = READERS | dict(readers or {})
    all_fields: tuple[Field[Any], ...] = fields(kind)  # type: ignore[arg-type]
    return kind(**{field.name: known[str(field.type)](content, field.name) for field in all_fields})


def member(content: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """Return the JSON object at ``key``; raises InputError when there is none."""
    value = content.get(key)
    if not isinstance(value, Mapping):
        raise InputError(f"{shown(key)} is {shown(value)}; expected an object")
    return value


def objects(content: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    """Return the list of JSON objects at ``key``; raises InputError when there is none."""
    values = content.get(key)
    if not isinstance(values, list) or not all(isinstance(value, Mapping) for value in values):
        raise InputError(f"{shown(key)} is {shown(values)}; expected a list of objects")
    return values


def require_all_read(content: Any, read: Any, place: str = "") -> None:
    """Require that a reader took all of a JSON document: a misspelt member that may be left out would not be missed.

    Parameters
    ----------
    content
        The document.
    read
        What the program writes of it after it was read.
    place
        Where in a file it stands.

    Raises
    ------
    InputError
        A member is not known, a list has another length, or a value is of another type.
    """
    where = place or "the file"
    if isinstance(content, dict) and isinstance(read, Mapping):
        for key, value in content.items():
            if key not in read:
                raise InputError(f"{where} has the member {shown(key)}; expected one of {', '.join(read)}")
            require_all_read(value, read[key], shown(key))
    elif isinstance(content, list) and isinstance(read, list | tuple) and len(content) == len(read):
        for own, other in zip(content, read, strict=True):
            require_all_read(own, other, place)
    elif isinstance(content, list) or _kind(content) is not _kind(read):
        raise InputError(f"{where} is {shown(content)}; expected the form of {shown(read)}")


def number(content: Mapping[str, Any], key: str) -> float:
    """Return the number at ``key``; raises InputError when there is none."""
    value = content.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{shown(key)} is {shown(value)}; expected a number")
    if not abs(value) <= sys.float_info.max:  # 1e999 is read as inf
        raise InputError(f"{shown(key)} is {shown(value)}; expected a number of less than 1.8e308")
    return float(value)


def numbers(content: Mapping[str, Any], key: str) -> tuple[float, ...]:
    """Return the list of numbers at ``key``; raises InputError when there is none."""
    values = content.get(key)
    if not isinstance(values, list):
        raise InputError(f"{shown(key)} is {shown(values)}; expected a list of numbers")
    return tuple(number({key: value}, key) for value in values)


def whole(content: Mapping[str, Any], key: str) -> int:
    """Return the whole number at ``key``; raises InputError when there is none."""
    value = number(content, key)
    if not value.is_integer():
        raise InputError(f"{shown(key)} is {shown(value)}; expected a whole number")
    return int(value)


def words(content: Mapping[str, Any], key: str) -> str:
    """Return the text at ``key``; raises InputError when there is none."""
    value = content.get(key)
    if not isinstance(value, str):
        raise InputError(f"{shown(key)} is {shown(value)}; expected a text")
    return value


def texts(content: Mapping[str, Any], key: str) -> tuple[str, ...]:
    """Return the list of texts at ``key``; raises InputError when there is none."""
    values = content.get(key)
    if not isinstance(values, list):
        raise InputError(f"{shown(key)} is {shown(values)}; expected a list of texts")
    return tuple(words({key: value}, key) for value in values)


def truth(content: Mapping[str, Any], key: str) -> bool:
    """Return the truth value at ``key``; raises InputError when there is none."""
    value = content.get(key)
    if not isinstance(value, bool):
        raise InputError(f"{shown(key)} is {shown(value)}; expected true or false")
    return value


def or_none(reader: Reader) -> Reader:
    """The reader of a member that may be null; one that is missing is refused as ``reader`` refuses it."""
    return lambda content, key: None if key in content and content[key] is None else reader(content, key)


READERS: dict[str, Reader] = {"float": number, "int": whole, "str": words, "bool": truth}
READERS |= {f"{name} | None": or_none(reader) for name, reader in READERS.items()}


def _kind(value: object) -> type:
    return float if type(value) is int else type(value)


def _object(members: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(members)
    if len(found) < len(members):
        names = [name for name, _ in members]
        again = next(name for name in names if names.count(name) > 1)
        raise InputError(f"an object has several members {shown(again)}; expected each once")
    return found


def _refuse_constant(name: str) -> float:
    raise InputError(f"holds {name}; expected finite numbers only")
