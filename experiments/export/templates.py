"""The templates of this package, as every export renders them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined


def templates(**filters: Callable[..., str]) -> Environment:
    """The templates ``*.j2`` with filters of their own; what is missing raises, and only XML is escaped."""
    found = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=lambda name: str(name).endswith(".xml.j2"),
    )
    found.filters.update(filters)
    return found
