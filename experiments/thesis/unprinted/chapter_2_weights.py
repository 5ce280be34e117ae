"""The search for what chapter 2 does not print, its weights and its initial output, by its printed tracking error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from data.thesis import printed_numbers
from design.blocks.block import Block
from design.design_file import Design
from design.hinf.mixed_sensitivity import synthesise
from design.hinf.pick import Problem, SynthesisError
from experiments.engine.simulate import DivergenceError, simulate
from experiments.physical_limits.integrator_bound import least_peak_error
from experiments.runs.batch import Each, threaded
from experiments.runs.design_loop import design_loop
from experiments.runs.metrics import over_last
from experiments.runs.references import Reference
from experiments.thesis.printed_choices import chapter_2, thesis_reference
from experiments.thesis.studies.chapter_2 import PERIODS
from experiments.thesis.unprinted.chapter_4_conditions import Prepared, from_output
from experiments.thesis.unprinted.where_met import Found, all_met, compared
from identification.base.errors import InputError

SAMPLES_PER_PERIOD = 500
OFFSET_FREE = 2e-5  # of the amplitude: an offset next to none, five times less than what the printed error is
OUTCOME = "delay_free_error"
READINGS = ("peak_percent", "ripple_percent", "peak_share", "peak")
"""What "0.098 % tracking error" may mean, all ours, of the last period: see :meth:`Loop.errors`."""


class Weights(NamedTuple):
    """Factors on the choices of :mod:`design.delay_free` that change K.

    Parameters
    ----------
    decay
        On the decay rate asked of the closed loop.
    damping
        On the real parts of the poles of W1, its value at zero held.
    level
        On W2; on W1 it would do the inverse.
    corner
        On the zero of W2 that is W_a's, its value at zero held.
    """

    decay: float = 1.0
    damping: float = 1.0
    level: float = 1.0
    corner: float = 1.0

    def __str__(self) -> str:
        changed = [f"{name} x {factor:g}" for name, factor in self._asdict().items() if factor != 1.0]
        return ", ".join(changed) or "usual"


USUAL = Weights()


def usual_weights() -> tuple[Weights, ...]:
    """Each choice over more than a decade, the others as usual.

    No more are needed: the printed error is below the bound of any controller, so that no weights give it.
    """
    ends = {"decay": (0.03, 0.1, 1.9), "damping": (0.6, 10.0), "level": (0.01, 100.0), "corner": (0.1, 10.0)}
    return USUAL, *(Weights(**{name: factor}) for name, factors in ends.items() for factor in factors)


def usual_limits() -> np.ndarray:
    """Limits as multiples of the input that the reference takes, crowding towards it from below."""
    return np.concatenate([1 - np.geomspace(0.3, 1e-3, 26), np.linspace(1.0, 1.6, 9)])


def with_weights(design: Design, weights: Weights) -> Design:
    """The design with the stabiliser K for other weights.

    Raises
    ------
    InputError, SynthesisError
        See :func:`design.hinf.mixed_sensitivity.mixed_sensitivity`.
    """
    assert design.hinf is not None
    W1, W2, decay_rate = design.hinf.W1, design.hinf.W2, design.hinf.decay_rate
    damped = tuple(complex(weights.damping * pole.real, pole.imag) for pole in W1.poles)
    flat = float(np.prod(np.abs(damped)) / np.prod(np.abs(W1.poles)))
    corner = -design.additive_bound.corner
    moved = tuple(weights.corner * zero if abs(zero - corner) < 1e-9 * abs(corner) else zero for zero in W2.zeros)
    W1, W2 = Block(W1.gain * flat, (), damped), Block(W2.gain * weights.level / weights.corner, moved, W2.poles)
    K, _ = synthesise(Problem(design.blocks["G_A"], W1, W2, weights.decay * decay_rate))
    return replace(design, blocks={**design.blocks, "K": K})


@dataclass(frozen=True)
class Loop:
    """Chapter 2's loop with the thesis's anti-windup, from y(0) = 0.

    Parameters
    ----------
    design, reference
        What it is made of.
    prepared
        The loop from y(0) = 0, ready to start from another.
    """

    design: Design
    reference: Reference
    prepared: Prepared

    def errors(self, limit: float, output: float) -> dict[str, float]:
        """The error of the last of six periods under +-limit from y(0) = ``output``.

        Returns
        -------
        dict
            ``peak``, the largest |e| in the unit of the output; ``peak_percent`` and ``peak_share``, the same in
            percent of the reference's amplitude and as a share of it; ``ripple_percent``, half the distance of the
            extremes, in percent; ``offset``, their middle. NaN when the loop diverges.
        """
        period, amplitude = self.reference.period_s, self.reference.amplitude
        time_s = np.linspace((PERIODS - 1) * period, PERIODS * period, SAMPLES_PER_PERIOD + 1)
        try:
            error = simulate(self.prepared.starting_at(initial_output=output), (-limit, limit), time_s).outputs["error"]
        except DivergenceError:
            error = np.full(len(time_s), np.nan)
        offset, ripple = over_last(time_s, error, period)
        peak = abs(offset) + ripple
        shares = {"peak_percent": 100 * peak / amplitude, "peak_share": peak / amplitude}
        return {"peak": peak, **shares, "ripple_percent": 100 * ripple / amplitude, "offset": offset}


def loop_of(design: Design) -> Loop:
    """The loop of a design."""
    reference = thesis_reference(design.kind, design.reference_omegas)
    loop = design_loop(design, reference, design.compensator("thesis"))
    return Loop(design, reference, from_output(loop, design, "exact"))


def with_and_without_offset(of: Loop, limit: float) -> dict[float, dict[str, float]]:
    """The errors from y(0) = r(0), and from the y(0) next to it from which the error keeps next to no offset.

    Parameters
    ----------
    of, limit
        As for :meth:`Loop.errors`.

    Returns
    -------
    dict
        y(0) -> :meth:`Loop.errors`. The second is left out where none is nearer to r(0) than half the amplitude, or the
        loop diverges.
    """
    start, reach = float(of.reference(np.array(0.0))), of.reference.amplitude / 2
    known: dict[float, dict[str, float]] = {}

    def offset(output: float) -> float:
        if output not in known:
            known[output] = of.errors(limit, output)
        found = known[output]["offset"]
        return 0.0 if abs(found) < OFFSET_FREE * of.reference.amplitude else found

    for end in (start + share * reach for share in (-0.2, 0.2, -1.0, 1.0)):
        if offset(start) * offset(end) <= 0:
            best = float(brentq(offset, start, end, xtol=1e-3))
            offset(best)
            return {output: known[output] for output in (start, best)}
    return {start: known[start]}


def delay_free_scan(
    sets: Sequence[str],
    limits: np.ndarray | None = None,
    weights: Sequence[Weights] | None = None,
    each: Each = threaded,
) -> pd.DataFrame:
    """The error over the limit, and over the weights at the printed limit.

    Parameters
    ----------
    sets
        Parameter sets.
    limits, weights
        :func:`usual_limits` and :func:`usual_weights` unless given.

    Returns
    -------
    DataFrame
        set, delay ("none": the chapter leaves it out), required, initial_output, limit, weights, and the columns of
        :meth:`Loop.errors`. With the usual weights over the limits, from y(0) = 0, which is r(0), and from the mean of
        r; then, at the printed limit, for each choice of weights, from the initial outputs of
        :func:`with_and_without_offset`. What the synthesis refuses is left out.
    """
    limits = usual_limits() if limits is None else limits
    weights = usual_weights() if weights is None else weights
    usual = {name: loop_of(chapter_2(name)) for name in sets}
    jobs = [
        (name, of, float(share * of.reference.required(of.design.loop_plant).value), output)
        for name, of in usual.items()
        for output in (0.0, of.reference.offset)
        for share in limits
    ]
    rows = each(_scan_row, jobs)
    varied: list[tuple[str, Loop, Weights]] = []
    for name, choice in product(sets, weights):  # one by one: the synthesis turns warnings into errors, for all threads
        with suppress(InputError, SynthesisError):
            varied.append((name, loop_of(with_weights(usual[name].design, choice)), choice))

    for several in each(_varied_rows, varied):
        rows += several
    return pd.DataFrame(rows)


def _scan_row(job: tuple[str, Loop, float, float]) -> dict[str, object]:
    name, of, limit, output = job
    return _row(name, of, USUAL, limit, output, of.errors(limit, output))


def _varied_rows(job: tuple[str, Loop, Weights]) -> list[dict[str, object]]:
    name, of, weights = job
    limit = printed_numbers()["delay_free"]["limit"]
    found = with_and_without_offset(of, limit)
    return [_row(name, of, weights, limit, output, errors) for output, errors in found.items()]


def _row(
    name: str, of: Loop, weights: Weights, limit: float, output: float, errors: dict[str, float]
) -> dict[str, object]:
    head = {"set": name, "delay": "none", "required": of.reference.required(of.design.loop_plant).value}
    return head | {"initial_output": output, "limit": limit, "weights": str(weights)} | errors


def delay_free_rows(sets: Sequence[str], scan: pd.DataFrame) -> pd.DataFrame:
    """What the printed tracking error of chapter 2 needs.

    Parameters
    ----------
    sets
        Parameter sets.
    scan
        Of :func:`delay_free_scan`.

    Returns
    -------
    DataFrame
        The columns of :func:`experiments.thesis.unprinted.search.alone`, ``search`` and ``weights``. Rows "alone": the
        limits that give the number in each reading, with the usual weights, from both initial outputs. Rows
        "weights", reading "peak_percent": the least error at the printed limit. Rows "any controller": the lower
        bound of :func:`experiments.physical_limits.integrator_bound.least_peak_error` there.
    """
    limit, rows = printed_numbers()["delay_free"]["limit"], []
    head = {"outcome": OUTCOME, "delay": "none"}
    for name in sets:
        of, own = loop_of(chapter_2(name)), scan[scan["set"] == name]
        over_limits = own[own["weights"] == str(USUAL)].drop_duplicates(["initial_output", "limit"])
        over_limits = over_limits.groupby("initial_output").filter(lambda group: len(group) > 2).sort_values("limit")
        for output, group in over_limits.groupby("initial_output"):
            start = float(str(output))
            known: Any = group.set_index("limit")[list(READINGS)].to_dict("index")
            readings = [(OUTCOME, reading) for reading in READINGS]
            for _, reading, found in all_met(partial(of.errors, output=start), known, readings):
                said = {"search": "alone", "reading": reading, "set": name, "initial_output": start}
                rows += [head | said | {"weights": str(USUAL)} | compared(OUTCOME, one) for one in found]
        best = own[own["limit"] == limit].nsmallest(1, "peak_percent").iloc[0]
        least = Found(math.nan, math.nan, limit, float(best["peak_percent"]))
        said = {"search": "weights", "reading": "peak_percent", "set": name, "initial_output": best["initial_output"]}
        rows.append(head | said | {"weights": best["weights"]} | compared(OUTCOME, least))
        plant, (omega,) = of.design.loop_plant, of.reference.omegas
        bound = 100 * least_peak_error(plant, limit, of.reference.amplitude, omega) / of.reference.amplitude
        said = {"search": "any controller", "reading": "peak_percent", "set": name, "initial_output": math.nan}
        rows.append(head | said | {"weights": "any"} | compared(OUTCOME, Found(math.nan, math.nan, limit, bound)))
    return pd.DataFrame(rows)
