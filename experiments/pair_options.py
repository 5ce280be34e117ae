"""Options of one number or two, as ``--limit 12`` and ``--limit -3 12``."""

from __future__ import annotations

import click


class NumberPair(click.ParamType[tuple[float, ...]]):
    """One or two numbers, also as one word, ``"-3 12"`` or ``-3,12``; converted to a tuple of them."""

    name = "number [number]"

    def convert(
        self, value: str | tuple[float, ...], param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, ...]:
        if isinstance(value, tuple):
            return value
        words = value.replace(",", " ").split()
        if not (1 <= len(words) <= 2 and all(map(_is_number, words))):
            self.fail(f"'{value}' is neither a number nor two", param, ctx)
        return tuple(map(float, words))


class PairCommand(click.Command):
    """A command that reads the two numbers of a :class:`NumberPair` from two words."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        names = {name for param in self.params if isinstance(param.type, NumberPair) for name in param.opts}
        for at in range(len(args) - 3, -1, -1):
            if args[at] in names and all(map(_is_number, args[at + 1 : at + 3])):
                args = [*args[: at + 1], " ".join(args[at + 1 : at + 3]), *args[at + 3 :]]
        return super().parse_args(ctx, args)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
