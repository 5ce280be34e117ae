"""The extended loop of chapter 4 under saturation, without and with anti-windup (Fig. 4.1 to 4.4)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from design.design_file import Design
from experiments.engine.pade import with_pade
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import simulate
from experiments.runs.compare_anti_windups import loops, run_all, span, tracking_summary, tracking_table, verdicts
from experiments.runs.design_loop import design_loop
from experiments.runs.metrics import last_saturation
from experiments.thesis.printed_choices import thesis_reference
from experiments.thesis.studies.chapter_2 import as_thesis
from experiments.thesis.studies.desaturation import PERIODS, desaturation
from identification.base.errors import InputError

SAMPLES_PER_PERIOD = 4000
PADE_ORDER = 2  # section 4.2


def extended_tables(design: Design, limit: float | None = None) -> dict[str, pd.DataFrame]:
    """Run an extended design from rest.

    Parameters
    ----------
    design
        Of kind "extended".
    limit
        Of the actuator, +-limit; unless given, the one at which the loop leaves saturation when the thesis says.

    Returns
    -------
    dict
        ``extended`` and ``extended_summary``, see :mod:`experiments.runs.compare_anti_windups`. Beside the runs none,
        thesis and corrected, with the exact dead time, stand none_pade and thesis_pade, with every dead time replaced
        by the second-order Pade approximation of section 4.2.

    Notes
    -----
    Chapter 4 prints no limits. It says of the loop without anti-windup that "until around 4 seconds, the
    system operates in the nonlinear region"; the limit is the one that comes nearest to this, or with a reference of
    another frequency to the same share of its period, see :func:`usual_limit`.
    """
    reference = thesis_reference("extended", design.reference_omegas)
    required = reference.required(design.loop_plant).value
    horizon = PERIODS * span(design, reference)
    exact = loops(design, reference)
    used = usual_limit(design) if limit is None else limit
    every = exact | {f"{name}_pade": with_pade(exact[name], PADE_ORDER) for name in ("none", "thesis")}
    runs = run_all(every, used, np.linspace(0.0, horizon, PERIODS * SAMPLES_PER_PERIOD + 1))
    promised = verdicts(design, exact, runs, used, reference)
    table = tracking_table(runs, reference)
    summary = tracking_summary(runs, promised, used, reference, required, horizon / PERIODS)
    return {"extended": table, "extended_summary": as_thesis(summary, table, limit is not None)}


def usual_limit(design: Design) -> float:
    """The limit +-L that an extended design is run with unless another is given.

    Without anti-windup the loop leaves saturation for good nearest to :func:`desaturation`.

    Raises
    ------
    InputError
        There is none, see :func:`limit_for_last_saturation`.
    """
    reference = thesis_reference("extended", design.reference_omegas)
    period = span(design, reference)
    target, horizon = desaturation(period), PERIODS * period
    loop = design_loop(design, reference, None)
    return limit_for_last_saturation(loop, target, reference.required(design.loop_plant).value, horizon)


def limit_for_last_saturation(loop: SaturatedLoop, target_s: float, required: float, horizon_s: float) -> float:
    """The limit +-L under which the loop leaves saturation for good nearest to ``target_s``.

    Parameters
    ----------
    loop
        A loop that starts from rest.
    target_s
        Wanted time of the last saturation in seconds.
    required
        The most that the control reaches in the steady state; below it the loop never leaves saturation.
    horizon_s
        How long a run is watched, longer than ``target_s``.

    Raises
    ------
    InputError
        The reference is constant, no limit between ``required`` and 64 times it brings the last saturation below
        ``target_s``, or every one does.

    Notes
    -----
    The time of the last saturation falls with L, but in jumps where a whole excursion disappears, so that
    ``target_s`` itself need not occur. Bisection ends at a crossing of ``target_s`` (should there be several, at
    one of them), and of the two ends, 1e-6 apart, the one nearer in time is returned.
    """

    if required == 0:
        raise InputError("a constant reference needs no steady control, from which no limit follows; expected --limit")

    def last(limit: float) -> float:
        time = last_saturation(simulate(loop, (-limit, limit), np.array([0.0, horizon_s])))
        return time if np.isfinite(time) else np.inf

    low, high = required, 2 * required
    if last(low) <= target_s:
        raise InputError(
            f"even with the least limit that allows tracking, {low:.4g}, saturation ends before {target_s:g} s; "
            "expected a slower loop, or --limit"
        )
    while last(high) > target_s:
        low, high = high, 2 * high
        if high > 64 * required:
            raise InputError(
                f"saturation does not end within {target_s:g} s with any limit up to {high:.4g}; expected a plant and "
                "a design that follow the reference"
            )
    while high - low > 1e-6 * high:
        middle = (low + high) / 2
        if last(middle) > target_s:
            low = middle
        else:
            high = middle
    return min((low, high), key=lambda limit: abs(last(limit) - target_s))
