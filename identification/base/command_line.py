"""How every command line answers bad input: one sentence, exit status 2, no traceback."""

from __future__ import annotations

import atexit
import gc
from typing import Any

import click
import numpy as np

from identification.base.errors import InputError

EXTRAS = {"dask": "campaign", "distributed": "campaign", "pyarrow": "campaign"}  # of pyproject.toml, by their modules


class Refusal(click.ClickException):
    """How a command line shows an :class:`InputError`."""

    exit_code = 2


class CommandGroup(click.Group):
    """A click group whose commands answer an :class:`InputError` with its sentence and exit status 2.

    So they do when finite numbers lead out of what floating point can hold: an overflow, a singular matrix, an
    array larger than the memory; and where a module of an extra is not installed.
    """

    def invoke(self, ctx: click.Context) -> Any:
        atexit.register(gc.freeze)  # without it the interpreter sweeps all modules as it ends: a third of a second
        try:
            with np.errstate(over="raise"):
                return super().invoke(ctx)
        except InputError as error:
            raise Refusal(str(error)) from None
        except (ArithmeticError, np.linalg.LinAlgError, MemoryError) as error:
            raise Refusal(f"the numbers given are too extreme to compute with ({error})") from None
        except ModuleNotFoundError as error:
            if error.name not in EXTRAS:
                raise
            extra = f'pip install "antiwindup-thesis[{EXTRAS[error.name]}]"'
            raise Refusal(f"{error.name} is not installed, which this command needs; give {extra}") from None
