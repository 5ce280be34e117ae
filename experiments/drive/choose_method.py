"""How a controller is best discretised at a rate, and from which rate on it may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.design_file import Design
from experiments.drive.difference_equations import MOST_LATE
from experiments.drive.judge_loop import UNFOLLOWED, LoopJudgement, judge_loop
from experiments.drive.matched_controller import is_matched
from experiments.drive.sampled_loop import FORMS, METHODS, Drive
from identification.base.errors import InputError
from identification.model.plant import PlantModel

RATES = 16  # a decade, of a search
SPAN = 1e2  # of the rates of a search, to the reference's highest frequency or the loop's fastest root
APART = 1e-3  # relative, of the rates around which stability changes


@dataclass(frozen=True)
class LeastRate:
    """The rates at which the loop is stable, of a search.

    Parameters
    ----------
    method
        How the controller is discretised.
    searched_hz
        The lowest and the highest rate that were tried.
    unstable_hz
        The highest rate found at which the loop is not stable, or the controller cannot run; 0 where none was found.
    stable_hz
        The lowest rate that was tried above it: from there on every rate that was tried is stable. Infinite where none
        was.
    """

    method: str
    searched_hz: tuple[float, float]
    unstable_hz: float
    stable_hz: float

    def __str__(self) -> str:
        """From which rate on the loop is stable, as far as it was tried."""
        low, high = self.searched_hz
        if not math.isfinite(self.stable_hz):
            return f"{self.method}: none from {low:.4g} to {high:.4g} Hz"
        if not self.unstable_hz:
            return f"{self.method}: all from {low:.4g} to {high:.4g} Hz"
        return f"{self.method}: all from {self.stable_hz:.4g} to {high:.4g} Hz"


def judge_methods(
    design: Design,
    drive: Drive,
    plant: PlantModel | None = None,
    omegas: Sequence[float] | None = None,
    form: str = FORMS[0],
) -> list[LoopJudgement]:
    """The judgements with every method there is for the design, the best first.

    That is a stable one of least steady error, at and between the samples. Errors below UNFOLLOWED are alike, and so
    are those whose first two digits are. Among alike ones it is that of the most margin, and among alike margins the
    first of METHODS. The last are those that no computer can run.
    """
    methods = [method for method in METHODS if method != "matched" or is_matched(design)]
    found = [judge_loop(design, replace(drive, method=method), plant, omegas, form) for method in methods]

    def order(each: LoopJudgement) -> tuple[bool, float, float]:
        error, margin = (float(f"{value:.1e}") for value in (max(each.steady_error, UNFOLLOWED), each.modulus_margin))
        return bool(each.refused), error, -margin

    return sorted(found, key=order)


def least_rate(design: Design, drive: Drive, plant: PlantModel | None = None, form: str = FORMS[0]) -> LeastRate:
    """The highest rate found at which the loop is not stable: stability need not come and go once as the rate grows.

    Parameters
    ----------
    design, drive, plant, form
        As of :func:`judge_loop`; the drive's rate does not matter.

    Notes
    -----
    RATES rates a decade are tried from the highest down, to above twice the reference's highest frequency, and the
    step around the first unstable one is refined until it is APART. What lies between neighbouring rates above it was
    not tried.
    """
    fastest = max(design.reference_omegas) / (2 * math.pi)
    roots = [abs(root) for block in design.controller_parts() for root in block.zeros + block.poles]
    low, high = 2.1 * fastest, SPAN * max([fastest, *roots]) / (2 * math.pi)
    low = low or high / SPAN**2
    longest = max(design.loop_plant.delay_s, (design.loop_plant if plant is None else plant).delay_s)
    if late_s := longest + drive.input_delay_s:
        high = max(min(high, MOST_LATE / late_s), low)  # above which no computer runs it

    def stable(rate: float) -> bool:
        return judge_loop(design, replace(drive, rate_hz=rate), plant, form=form).stable

    rates = np.geomspace(high, low, int(RATES * math.log10(high / low)) + 2)
    above = math.inf
    for rate in map(float, rates):
        if stable(rate):
            above = rate
            continue
        below = rate
        while math.isfinite(above) and above > (1 + APART) * below:
            middle = math.sqrt(above * below)
            above, below = (middle, below) if stable(middle) else (above, middle)
        return LeastRate(drive.method, (low, high), below, above)
    return LeastRate(drive.method, (low, high), 0.0, above)


def choose_method(
    design: Design,
    drive: Drive,
    method: str | None = None,
    plant: PlantModel | None = None,
    omegas: Sequence[float] | None = None,
    form: str = FORMS[0],
) -> tuple[LoopJudgement, str]:
    """The linear loop with the best method, or with the one that is asked for, and a sentence on it.

    Parameters
    ----------
    design, drive, plant, omegas, form
        As of :func:`judge_loop`; the drive's method does not matter.
    method
        The one that is asked for, which is kept even if the loop is not stable with it; unless given, the first of
        :func:`judge_methods`.

    Returns
    -------
    judgement, sentence
        The judgement names the method. The sentence says of which method the loop is stable at the rate, with which
        steady error; where the loop is not stable with the judged one, also from which rate on it is.

    Raises
    ------
    InputError
        No computer can run the controller at this rate with the method that is asked for, or with any.
    """
    found = judge_methods(design, drive, plant, omegas, form)
    if method and method not in [each.method for each in found]:
        found.append(judge_loop(design, replace(drive, method=method), plant, omegas, form))
    first = next((each for each in found if each.method == method), found[0])
    if first.refused and method:
        raise InputError(first.refused)
    if first.refused:
        raise InputError(f"no method can run the controller at {first.rate_hz:g} Hz; {first.method}: {first.refused}")
    others = [f"; {each.method}: {each}" for each in found if each != first and not each.refused]
    why = "" if method else ", which is chosen,"
    said = f"At {first.rate_hz:g} Hz with the method {first.method}{why} the linear loop is {first}{''.join(others)}"
    if not first.stable:
        sought = [first] if found[0].stable else [each for each in found if not each.refused]
        searched = (str(least_rate(design, replace(drive, method=each.method), plant, form)) for each in sought)
        said += f". Rates that were tried and leave it stable: {'; '.join(searched)}"
    return first, said
