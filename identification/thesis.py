"""The numbers that the thesis prints, read from data/thesis/thesis.toml."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

DATA = Path(__file__).resolve().parent.parent / "data"


@cache
def printed() -> dict[str, Any]:
    """Return data/thesis/thesis.toml as nested dictionaries; its comments give the units and the places in print.

    Table 4.1 and what else the thesis chose, as printed.
    """
    return tomllib.loads((DATA / "thesis" / "thesis.toml").read_text(encoding="utf-8"))
