"""The option --axis of a command: the keys of an axis.toml become the defaults of the options of the same names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from identification.base.axis_file import KEYS, SINUSOIDS, SUPERSEDES, read_axis
from identification.base.errors import InputError
from identification.base.path_types import INPUT_FILE


class AxisOption(click.Option):
    """Reads the file before the other options are, and leaves out what those that are given take the place of."""

    def handle_parse_result(
        self, ctx: click.Context, opts: Mapping[str, Any], args: list[str]
    ) -> tuple[Any, list[str]]:
        path, rest = super().handle_parse_result(ctx, opts, args)
        if isinstance(path, Path):
            values = read_axis(path)
            options = {name[2:]: param for param in ctx.command.params for name in param.opts if name[:2] == "--"}
            for name, param in options.items():
                for other in SUPERSEDES.get(name, ()) if param.name in opts else ():
                    values.pop(other, None)
            for name in (*SINUSOIDS, "reference"):
                if name in values and name not in options and "amplitude" in options:
                    follows = {"reference": "a file", "slope": "a ramp"}.get(name, f"a reference with a {name}")
                    raise InputError(f"{path}: the axis follows {follows}; expected sinusoids for {ctx.info_name}")
            ctx.default_map = {str(options[name].name): value for name, value in values.items() if name in options}
            for name in {"limit"} & values.keys() & options.keys():
                if options[name].multiple:
                    ctx.default_map[str(options[name].name)] = [values[name]]
        return path, rest


AXIS = click.option(
    "--axis",
    cls=AxisOption,
    type=INPUT_FILE,
    is_eager=True,
    expose_value=False,
    help=(
        "axis.toml of your axis. Its keys are the defaults of the options with the same names; "
        "`antiwindup new` writes one."
    ),
)


def words_of(values: Mapping[str, Any]) -> list[str]:
    """Values of an axis, see :meth:`identification.base.axis_file.Key.read`, as a command line has them."""
    return [word for name in KEYS if name in values for word in _option(name, values[name])]


def _option(name: str, value: object) -> list[str]:
    option = f"--{name}"
    if name == "limit":
        return [option, *map(repr, value)]  # type: ignore[call-overload]
    if isinstance(value, tuple):
        return [word for each in value for word in (option, repr(each))]
    return [f"{option}={value}"]
