"""What acts on a loop besides its reference: disturbances at the plant's input and output, and measurement noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from design.blocks.state_space import block_diagonal
from experiments.engine.saturated_loop import Resets
from experiments.runs.references import Generator, Reference, SampledReference
from identification.base.errors import InputError

MOST_NOISE = 1e6  # samples

Signal = Reference | SampledReference


@dataclass(frozen=True)
class Disturbances:
    """Signals of time that act on the loop of Fig. 2.6, each None for none.

    Parameters
    ----------
    input
        Added to what the actuator gives out, in its unit, before the plant's dead time. What passes a plant of as many
        zeros as poles at once was, in continuous time, before t = 0 what it is then.
    output
        Added to what the plant gives out, in the plant's output unit: it is part of y.
    noise
        Added to y where the controller measures it, and only there, in the plant's output unit.
    """

    input: Signal | None = None
    output: Signal | None = None
    noise: Signal | None = None

    def seen(self, time_s: np.ndarray) -> np.ndarray:
        """What the controller measures beside the response of the plant, output + noise, at times of any shape."""
        present = [signal(time_s) for signal in (self.output, self.noise) if signal is not None]
        return np.sum(present, axis=0) if present else np.zeros(np.shape(time_s))


UNDISTURBED = Disturbances()


def steps(levels: Sequence[tuple[float, float]]) -> SampledReference | None:
    """A signal that takes levels from given times on.

    Parameters
    ----------
    levels
        (level, at_s): from ``at_s`` seconds on, not negative, the signal is ``level``; before the first it is 0.

    Returns
    -------
    SampledReference or None
        None of no levels.

    Raises
    ------
    InputError
        A level or a time is not finite, a time is negative, or two are the same.
    """
    ordered = sorted(levels, key=lambda step: step[1])
    for level, at_s in ordered:
        if not (np.isfinite([level, at_s]).all() and at_s >= 0):
            raise InputError(f"a disturbance of {level:g} begins at {at_s:g} s; expected a finite level and time, >= 0")
    if same := [at_s for (_, at_s), (_, after_s) in pairwise(ordered) if at_s == after_s]:
        raise InputError(f"two levels of a disturbance begin at {same[0]:g} s; expected one")
    if not ordered:
        return None
    before = [0.0, *(level for level, _ in ordered[:-1])]
    samples = [
        (at_s, value)
        for (level, at_s), old in zip(ordered, before, strict=True)
        for value in ([old, level] if at_s > 0 else [level])
    ]
    time_s, values = np.array(samples).T
    return SampledReference(time_s, values)


def noise(std: float, rate_hz: float, seed: int, until_s: float) -> SampledReference:
    """Straight lines between independent normal samples: noise that continuous time has a meaning for.

    Parameters
    ----------
    std
        The standard deviation of the samples, in the unit of what is measured; half-way between two it is std/sqrt(2).
    rate_hz
        Samples a second; beyond half of it the noise's spectrum falls off.
    seed
        Of the samples, not negative: the same one gives the same noise, however long the run.
    until_s
        Seconds that the samples reach at least.

    Raises
    ------
    InputError
        A number is not finite or negative, the rate is 0, or there are more than a million samples.
    """
    if not (0 <= std < np.inf and 0 < rate_hz < np.inf and 0 <= until_s < np.inf and seed >= 0):
        raise InputError(
            f"the noise has the standard deviation {std:g}, {rate_hz:g} samples a second and the seed {seed}; expected "
            "finite numbers, none negative and the rate positive"
        )
    if until_s * rate_hz > MOST_NOISE:
        raise InputError(f"the noise has {until_s * rate_hz:.3g} samples; expected at most {MOST_NOISE:.3g}")
    time_s = np.arange(int(np.ceil(until_s * rate_hz)) + 1) / rate_hz
    return SampledReference(time_s, std * np.random.default_rng(seed).standard_normal(time_s.size))


def combined(generators: Sequence[Generator]) -> tuple[Generator, list[np.ndarray]]:
    """One generator of several signals, and each one's row over its states; the generator's own row is the first."""
    sizes = [len(each.start) for each in generators]
    edges = np.concatenate([[0], np.cumsum(sizes)])
    times_s = np.unique(np.concatenate([each.resets.times_s for each in generators]))
    values, rows = np.full((len(times_s), edges[-1]), np.nan), []
    for each, (begin, end) in zip(generators, pairwise(edges), strict=True):
        if len(each.resets.times_s):
            values[np.searchsorted(times_s, each.resets.times_s), begin:end] = each.resets.values
        row = np.zeros(edges[-1])
        row[begin:end] = each.row
        rows.append(row)
    start = np.concatenate([each.start for each in generators])
    matrix = block_diagonal(*(each.matrix for each in generators))
    return Generator(matrix, rows[0], start, Resets(times_s, values)), rows
