"""numba's ``njit`` for the project's own functions; what it compiles is kept in the user's cache folder.

numba would keep it beside the module, where an uninstallation leaves it behind, or where NUMBA_CACHE_DIR says, which
holds for every function of the process. Here each function has a cache of its own, and all others stay as they are.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator

from identification.base.cache_folders import cache_folders


def _folders() -> Iterator[Path]:
    """Where compiled code may be kept, best first: where NUMBA_CACHE_DIR says, if it is set, or with other caches."""
    if own := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(own)
    yield from cache_folders()


@cache
def code_cache(package: str) -> Path | None:
    """The folder for what is compiled of a top-level package, made if need be; None where none can be written.

    Its name holds a digest of all modules with compiled functions: numba looks only at the module of a function for
    changes, not at those that it calls into.
    """
    modules = sorted(Path(str(sys.modules[package].__file__)).parent.rglob("*.py"))
    texts = [text for text in (module.read_bytes() for module in modules) if b"njit" in text]
    digest = sha256(b"".join([numba.__version__.encode(), package.encode(), *texts])).hexdigest()[:16]
    candidates = _folders()
    while True:
        try:
            folder = next(candidates) / f"numba-{digest}"
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except StopIteration:
            return None
        except OSError:
            continue
        return folder


class _Locator(_CacheLocator):
    """Where numba finds the files of one function, in its own words."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._py_file, self._function = file, function

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _Locator:
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        return str(code_cache(self._function.__module__.partition(".")[0]))

    def get_source_stamp(self) -> str:
        return self.get_cache_path()

    def get_disambiguator(self) -> str:
        return f"{self._function.__module__}-{self._function.__code__.co_firstlineno}"


class _CacheImpl(CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012


class _FunctionCache(FunctionCache):
    _impl_class = _CacheImpl

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        if (kept := super().load_overload(sig, target_context)) is None:  # type: ignore[no-untyped-call]
            _say_that_it_compiles()
        return kept


@cache
def _say_that_it_compiles() -> None:
    """On a terminal, once a process."""
    if sys.stderr is not None and sys.stderr.isatty():
        from tqdm import tqdm

        tqdm.write("Compiling, once for this machine: some 20 s.", file=sys.stderr)


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: numba's ``njit`` with these options, and a cache if a folder for it can be written.

    Parameters
    ----------
    options
        Of numba's ``njit``, but for ``cache``.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher: Any = numba.njit(**options)(function)
        if code_cache(function.__module__.partition(".")[0]) is not None:
            dispatcher._cache = _FunctionCache(function)  # type: ignore[no-untyped-call]
        return dispatcher

    return compiled
