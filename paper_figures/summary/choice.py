"""Which anti-windup the runs of a refit speak for: what recovers, what does harm, what is left."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from experiments.runs.against_none import SAME
from paper_figures.look.captions import duration, of_run
from paper_figures.summary.build_folder import Found

UPSETS = {"start": "from rest", "pulse": "after a disturbance"}

Times = dict[str, tuple[float, float]]


def recoveries(found: Found) -> Times:
    """For each anti-windup that was run when it recovers from rest and after a disturbance, in seconds; NaN: never.

    Before there is a comparison, those of the run under the reference count for both.
    """
    table, tracking = (found.made.get(name) for name in ("compare", "tracking"))
    if table is not None:
        ran = table if "refused" not in table else table[table["refused"].isna()]
        start, pulse = (ran[ran["upset"] == upset].set_index("run")["recovery_s"] for upset in UPSETS)
        return {str(run): (float(start[run]), float(pulse[run])) for run in start.index}
    if tracking is None:
        return {}
    return {str(run): (of_run(tracking, str(run), "recovery_s"),) * 2 for run in tracking["run"]}


def best_anti_windup(found: Found) -> str | None:
    """What to use: the name of an anti-windup, ``none`` where each does harm, None where no run follows the reference.

    Of those that recover from rest, no later than without anti-windup, those count first that recover after a
    disturbance too, then those that are guaranteed to, then the corrected one, then the fastest.
    """
    times = recoveries(found)
    if not times:
        return "corrected"
    if all(math.isnan(start) for start, _ in times.values()):
        return None
    does_harm = any(harm(found))
    helping = [
        run
        for run, (start, _) in times.items()
        if run != "none" and start >= 0 and not _is_later(times[run], times["none"])
        if not (run == "corrected" and does_harm)
    ]
    if not helping:
        return "none" if times["none"][0] >= 0 else None
    return min(
        helping,
        key=lambda run: (
            math.isnan(times[run][1]),
            not is_guaranteed(run, found),
            run != "corrected",
            times[run][0],
        ),
    )


def is_guaranteed(run: str, found: Found) -> bool:
    """Whether a guarantee speaks of the run under the reference."""
    table, tracking = (found.made.get(name) for name in ("compare", "tracking"))
    if run == "corrected" and tracking is not None and of_run(tracking, run, "covered") == 1:
        return True
    return table is not None and "global" in set(table["guarantee"][table["run"] == run])


def _is_later(own: tuple[float, float], none: tuple[float, float]) -> bool:
    """Whether a run recovers later than without anti-windup, from rest or after the disturbance."""
    return any(not math.isnan(other) and not time <= other * (1 + SAME) for time, other in zip(own, none, strict=True))


def harm(found: Found) -> Iterator[str]:
    """Where the corrected anti-windup does harm in the comparison under the user's own reference and limits."""
    times = recoveries(found) if "compare" in found.made else {}
    if not times:
        return
    for said, own, none in zip(UPSETS.values(), times["corrected"], times["none"], strict=True):
        if _is_later((own,) * 2, (none,) * 2):
            yield (
                f"Do not use the anti-windup 'corrected': {said} it recovers {when(own)}, without anti-windup the "
                f"loop recovers {when(none)}."
            )


def when(time_s: float) -> str:
    """When a run recovers."""
    return "never" if math.isnan(time_s) else "at once" if time_s == 0 else f"after {duration(time_s)}"


def enough(table: pd.DataFrame) -> float:
    """How many times smaller the reference must be for a run to recover; NaN: not even at the smallest tried."""
    return float(table["enough"].iloc[0])
