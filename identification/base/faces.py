"""The face of a room: what its ``__init__.pyi`` imports, imported when it is asked for."""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def face(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """What a package needs to import on request what the stub beside it imports.

    Parameters
    ----------
    package, file
        Its ``__name__`` and ``__file__``. In the ``.pyi`` beside the file stand lines such as
        ``from design.auditing.audit_design import Audit, audit``.

    Returns
    -------
    tuple
        ``__getattr__`` and ``__dir__`` of the package (PEP 562), and ``__all__``.
    """
    stub = ast.parse(Path(file).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    homes = {alias.asname or alias.name: (str(node.module), alias.name) for node in imports for alias in node.names}

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, own_name = homes[name]
        return getattr(import_module(module), own_name)

    return get, lambda: sorted(homes), sorted(homes)
