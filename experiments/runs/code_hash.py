"""What a number hangs on besides its inputs: this package's code, and the packages that it computes with."""

from __future__ import annotations

import hashlib
import re
from functools import cache
from importlib.metadata import requires, version
from pathlib import Path

DISTRIBUTION = "antiwindup-thesis"


@cache
def code_sha256() -> str:
    """The sha256 of this package's rooms up to this one, of their modules' names and texts."""
    digest = hashlib.sha256()
    above = Path(__file__).parents[2]
    for room in ("identification", "design", "experiments"):
        for module in sorted((above / room).rglob("*.py")):
            digest.update(str(module.relative_to(above)).encode() + module.read_bytes())
    return digest.hexdigest()


@cache
def environment() -> dict[str, str]:
    """The sha256 of the code, as ``code``, and the version of every package that it cannot do without, by its name."""
    needed = (line for line in requires(DISTRIBUTION) or () if "extra ==" not in line)
    names = sorted(re.split(r"[^\w.-]", line)[0] for line in needed)
    return {"code": code_sha256()} | {name: version(name) for name in names}
