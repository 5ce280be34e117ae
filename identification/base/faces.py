"""The face of a room: what its ``__init__.pyi`` imports, imported when it is asked for.

Every command imports this before it can answer a signal, and with it nothing else.
"""

from __future__ import annotations

TYPE_CHECKING = False  # of typing, which takes a while to import
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


def face(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """What a package needs to import on request what the stub beside it imports.

    Parameters
    ----------
    package, file
        Its ``__name__`` and ``__file__``. In the ``.pyi`` beside the file stand lines such as
        ``from design.auditing.audit_design import Audit, audit``.

    Returns
    -------
    tuple
        ``__getattr__`` and ``__dir__`` of the package (PEP 562); the former knows ``__all__`` too.
    """
    homes: dict[str, tuple[str, str]] = {}

    def names() -> list[str]:
        import ast
        from pathlib import Path

        if not homes:
            stub = ast.parse(Path(file).with_suffix(".pyi").read_text(encoding="utf-8"))
            for node in stub.body:
                if isinstance(node, ast.ImportFrom):
                    homes.update({alias.asname or alias.name: (str(node.module), alias.name) for alias in node.names})
        return sorted(homes)

    def get(name: str) -> Any:
        from importlib import import_module

        if name == "__all__":
            return names()
        if name not in names():
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, own_name = homes[name]
        return getattr(import_module(module), own_name)

    return get, names
