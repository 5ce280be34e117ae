"""A controller as C99: a header, a source, a test run, and a program that checks the one on the other."""

from __future__ import annotations

import math
from collections.abc import Iterable
from textwrap import wrap
from typing import Any

import numpy as np

from experiments.drive.difference_equations import SampledBlock
from experiments.export.check_run import CheckRun, commands
from experiments.export.controller import SampledController
from experiments.export.names import identifier
from experiments.export.templates import templates
from identification.base.digits import upper_end
from identification.base.errors import InputError
from identification.model.signals import Signals

PRECISIONS: dict[str, type[np.floating]] = {"double": np.float64, "float": np.float32}
WIDTH = 116
ANOTHER = 0.01  # of the largest: commands that differ by more are those of another controller


def files(controller: SampledController, run: CheckRun, precision: str = "double") -> dict[str, str]:
    """The files by their names: NAME.h, NAME.c, NAME_test.c and NAME_test.csv.

    Parameters
    ----------
    controller
        What is written.
    run
        Samples of a run of this controller, see :func:`experiments.export.check_run.check_run`.
    precision
        One of :data:`PRECISIONS`, of all numbers in C.

    Raises
    ------
    InputError
        A number of the controller or of the run is beyond a float, a limit is below what a float holds to all its
        digits, or the commands of the run differ by more than :data:`ANOTHER`.
    """
    name, kind = controller.name, PRECISIONS[precision]
    given, seen = names(controller.signals)

    def number(value: float) -> str:
        with np.errstate(over="ignore"):
            held = kind(value)
        if not np.isfinite(held):
            raise InputError(f"the controller has the number {value:g}, which no {precision} holds; expected another")
        return f"{held!s}" if precision == "double" else f"{held!s}F"

    def table(values: Iterable[float]) -> str:
        return "\n".join(f"    {line}" for line in wrap(", ".join(map(number, values)), WIDTH, break_on_hyphens=False))

    smallest = float(np.finfo(kind).tiny)
    for limit in controller.limits:
        if 0 < abs(limit) < smallest:
            raise InputError(f"the controller has the limit {limit:g}, which no {precision} holds; expected another")

    environment = templates(number=number, rows=table, comment=_comment)
    content = {
        "c": controller,
        "real": precision,
        "smallest": smallest,
        "samples": np.column_stack([run.reference, run.measurement, run.control, run.command]).tolist(),
        "input": given,
        "output": seen,
        "limits": [limit if math.isfinite(limit) else None for limit in controller.limits],
        **_memories(controller),
    }

    def text(template: str, **more: float) -> str:
        return environment.get_template(template).render(content, **more)

    source = text("controller.c.j2")  # first, since it refuses what no float holds
    tolerance = _difference(controller, run, kind)
    return {
        f"{name}.h": text("controller.h.j2", tolerance=tolerance),
        f"{name}.c": source,
        f"{name}_test.c": text("controller_test.c.j2", tolerance=tolerance),
        f"{name}_test.csv": run.csv(),
    }


def names(signals: Signals) -> tuple[str, str]:
    """What the names of variables say of the input and of the output, after a word of their own."""
    return identifier(signals.input_name, "input"), identifier(signals.output_name, "output")


def _difference(controller: SampledController, run: CheckRun, kind: type[np.floating]) -> float:
    """How far the commands of this precision are from those of the run, and from those rounded to it; rounded up."""
    if kind is np.float64:
        return 0.0
    with np.errstate(all="ignore"):
        found = commands(controller, run.reference, run.measurement, kind)
    if not np.isfinite(found).all():
        raise InputError("the run of its test takes the controller beyond what a float holds; expected doubles")
    pairs = list(zip(found, (run.control, run.command), strict=True))
    for own, exact in pairs:
        apart, largest = float(np.abs(own - exact).max()), float(np.abs(exact).max())
        if apart > ANOTHER * largest:
            raise InputError(
                f"in floats the controller is another: in its test a command differs by {apart:.3g} where the largest "
                f"is {largest:.3g}; expected doubles"
            )
    most = max(float(np.abs(own - each).max()) for own, exact in pairs for each in (exact, exact.astype(kind)))
    return float(upper_end(most * (1 + float(np.finfo(kind).eps)), 3))


def _comment(text: object) -> str:
    """A text in a comment of C, which it does not end."""
    return str(text).replace("*/", "* /").replace("/*", "/ *")


def _memories(controller: SampledController) -> dict[str, Any]:
    """What the templates say of the blocks: their numbers as tables, and the memory of each output that is not 0.

    Of an output ``value`` in C enters its memory, and d times the block's input is added last. ``ring`` is empty where
    the memory is this sample alone, which then counts ``tap`` times.
    """
    forward, feedback, theta = controller.forward, controller.feedback, controller.theta
    standing = controller.standing
    tables: list[tuple[str, list[float]]] = []

    def keep(name: str, values: np.ndarray) -> str:
        if values.size:
            tables.append((name, values.ravel().tolist()))
        return name

    def memory(block: SampledBlock, o: int, ring: str, value: str) -> dict[str, Any]:
        first, length = int(block.first[o]), int(block.length[o])
        kept = first + length > 1
        return {
            "ring": ring if kept else "",
            "value": value,
            "d": float(block.d[o]),
            "taps": keep(f"{ring}_taps".upper(), block.taps[o, :length]) if kept else "",
            "first": first,
            "length": length,
            "tap": float(block.taps[o, 0]),
        }

    for name, block in (("FORWARD", forward), ("FEEDBACK", feedback), ("WINDUP", theta)):
        keep(f"{name}_A", block.A)
        keep(f"{name}_B", block.b)
    keep("FORWARD_C", forward.C)
    keep("WINDUP_C_1", theta.C[0])
    keep("WINDUP_C_2", theta.C[1])
    feedbacks = []
    for o in range(len(feedback.d)):
        if not (np.any(feedback.C[o]) or feedback.d[o]):
            continue
        row, n = keep(f"FEEDBACK_C_{o + 1}", feedback.C[o]), len(feedback.b)
        value = f"product({row}, state->feedback, {n})" if n else "0"
        feedbacks.append(memory(feedback, o, f"feedback_{o + 1}", value) | {"standing": standing.memories[o]})
    n = len(theta.b)
    value = f"product(WINDUP_C_2, state->windup, {n})" if n else "0"
    windup = memory(theta, 1, "windup_output", value) if np.any(theta.C[1]) or theta.d[1] else None
    if len(feedback.b):
        keep("STANDING_FEEDBACK", standing.feedback)
    if standing.slowest is not None:
        keep("STANDING_FORWARD", standing.forward)
        keep("SLOWEST", standing.slowest)
    return {
        "tables": tables,
        "feedbacks": feedbacks,
        "windup": windup,
        "rings": [each["ring"] for each in (*feedbacks, *([windup] if windup else [])) if each["ring"]],
        "size": controller.remembered,
        "states": {"forward": len(forward.b), "feedback": len(feedback.b), "windup": len(theta.b)},
        "own": float(theta.d[0]) + controller.through,
        "bumpless": standing.slowest is not None,
    }
