"""At which rates a controller runs on a computer by which method, and at which not, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from experiments.rates import NAMES, continuous_error, is_near, lowest_rate
from identification.model.signals import Signals
from paper_figures.look.captions import LITTLE, ROUNDING, a_second, duration, hertz, only, with_unit

CYCLES = 10  # times the error without the rate limit: what the rate limit makes of the loop
METHODS = {"matched": "the method 'matched'", "tustin": "Tustin's rule", "exact": "held-input discretisation"}


def discretise(rates: pd.DataFrame, run: str | None, signals: Signals) -> Iterator[str]:
    """Which method, from which rate on; and what the computer's own rate gives.

    Of a loop that does not follow in continuous time (run None), only whether its linear loop is stable.
    """
    asked = only(rates, "asked_hz")
    if run in NAMES:
        yield _from_where_on(rates, str(run))
    if math.isnan(asked):
        return
    rows = _at(rates, "corrected" if run is None else run, asked)
    if run is None or rows.empty:
        rows = _at(rates, "corrected", asked)
        said = [f"{'stable' if row.stable else 'UNSTABLE'} by {METHODS[str(row.method)]}" for row in rows.itertuples()]
        yield f"At your rate of {hertz(asked)} the linear loop is {', '.join(said)}."
        return
    errors = {str(row["method"]): _left(row, signals) for _, row in rows.iterrows() if row["stable"]}
    unstable = [METHODS[str(row.method)] for row in rows.itertuples() if not row.stable]
    parts = []
    if errors:
        parts.append("the steady error is " + ", ".join(f"{left} by {METHODS[each]}" for each, left in errors.items()))
    if unstable:
        parts.append(f"the loop is unstable by {' and by '.join(unstable)}")
    yield f"At your rate of {hertz(asked)} {'; '.join(parts)}."


def _from_where_on(rates: pd.DataFrame, run: str) -> str:
    lowest = {method: lowest_rate(rates, run, method) for method in METHODS}
    usable = {method: rate for method, rate in lowest.items() if not math.isnan(rate)}
    if not usable:
        return (
            "Look for a faster computer or a slower reference: by no method does the controller come within 1 % of the "
            f"reference's amplitude of what it does in continuous time, up to {hertz(float(rates['rate_hz'].max()))}."
        )
    method = min(usable, key=usable.__getitem__)
    return (
        f"Run it on a computer by {METHODS[method]} at {hertz(usable[method])} or more: there and at all rates tried "
        "above, the steady error is no more than 1 % of the reference's amplitude above that in continuous time."
    )


def avoid(rates: pd.DataFrame, run: str | None, signals: Signals) -> Iterator[str]:
    """Below which rates which method does not do; and at the computer's own rate, whether the rate limit is why."""
    if run is None:
        return
    for method, words in METHODS.items() if run in NAMES else ():
        rows = rates[(rates["run"] == run) & (rates["method"] == method)].sort_values("rate_hz")
        lowest = lowest_rate(rates, run, method)
        below = rows if math.isnan(lowest) else rows[rows["rate_hz"] < lowest]
        if len(below):
            last = below.iloc[-1]
            left = f"the steady error is {_left(last, signals)}" if last["stable"] else "the loop is unstable"
            until = f"at any rate up to {hertz(last['rate_hz'])}" if math.isnan(lowest) else f"below {hertz(lowest)}"
            yield f"Do not use {words} {until}: at {hertz(last['rate_hz'])} {left}."
    for _, row in _at(rates, run, only(rates, "asked_hz")).iterrows():
        if not row["stable"] or is_near(row, continuous_error(rates, run)):
            continue
        words, unslewed = METHODS[str(row["method"])], float(row["unslewed_error"])
        at = f"Do not run it by {words} at your rate of {hertz(row['rate_hz'])}"
        if float(row["steady_error"]) > CYCLES * unslewed:
            slope = a_second(only(rates, "rate_limit"), signals.input_unit)
            yield (
                f"{at}: because of the rate limit of {slope} the loop does not come to rest, and an error of "
                f"{_left(row, signals)} stays; without the rate limit it is {with_unit(unslewed, signals.output_unit)}."
            )
        elif run not in NAMES:
            yield f"{at}: the steady error is {_left(row, signals)}."


def _at(rates: pd.DataFrame, run: str, rate_hz: float) -> pd.DataFrame:
    """The rows of a run at a rate, one a method."""
    rows = rates[(rates["run"] == run) & rates["method"].isin(list(METHODS))]
    return rows[(rows["rate_hz"] - rate_hz).abs() <= 1e-9 * rate_hz]


def _left(row: pd.Series, signals: Signals) -> str:
    error = float(row["steady_error"])
    if row["settled"] == 0:
        return f"not known (not settled within {duration(row['until_s'])})"
    if error < ROUNDING * float(row["amplitude"]):
        return LITTLE
    return "without bound" if math.isnan(error) else with_unit(error, signals.output_unit)
