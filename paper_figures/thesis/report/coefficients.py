"""The transfer functions of a design as a table of gains, zeros and poles that MATLAB and Python read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from design.blocks.block import Block
from design.design_file import Design
from paper_figures.summary.of_fit import Table

HEAD = ("block", "gain", "zeros [rad/s]", "poles [rad/s]", "dead time [s]")


def coefficient_table(design: Design) -> Table:
    """A row for each block of a design and for theta1~ of each of its anti-windups, all digits of design.json."""
    return Table(HEAD, tuple(_row(name, block) for name, block in _blocks(design)))


def _blocks(design: Design) -> Iterator[tuple[str, Block]]:
    yield from ((name, block) for name, block in design.blocks.items() if name != "theta1_tilde")
    for name, compensator in design.anti_windup.items():
        yield f"theta1_tilde, {name}", compensator.kind.theta1_tilde


def _row(name: str, block: Block) -> tuple[str, ...]:
    return name, repr(block.gain), _roots(block.zeros), _roots(block.poles), repr(block.delay_s)


def _roots(roots: Iterable[complex]) -> str:
    """``[-1.0, -2.0+3.0j, -2.0-3.0j]``."""
    each = (f"{root.real}{root.imag:+}j" if root.imag else f"{root.real}" for root in roots)
    return f"[{', '.join(each)}]"
