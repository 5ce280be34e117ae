"""The reference and the limits of an axis: what its engineer gave, and what follows from the plant for the rest."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from experiments.runs.reference_file import read_reference
from experiments.runs.references import Reference
from identification.base.axis_file import KEYS, SINUSOIDS, require_consistent
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel
from identification.model.signals import UNNAMED

SHARE = 0.8  # of the limits, which a reference takes unless its amplitude is given
ROOM = 1 / SHARE  # of the limits over what the reference takes, unless they are given
INSIDE = 2  # times the lowest line is the frequency of the reference, unless given
CREST = math.pi / 2


class Setting(NamedTuple):
    """A value of an axis, see :meth:`identification.base.axis_file.Key.read`, and why it is this, if it was chosen."""

    value: Any
    why: str | None = None


def choose_axis(model: IdentifiedModel, given: Mapping[str, Any]) -> dict[str, Setting]:
    """Complete an axis so that its reference can be followed within its limits.

    Parameters
    ----------
    model
        The plant, its signals, and the lines that it was fitted to.
    given
        Key of :data:`identification.base.axis_file.KEYS` -> value.

    Returns
    -------
    dict
        All that was given, and what was chosen where it was not: the frequency, twice the lowest line; a phase at
        which the reference begins at its crest; the amplitude whose control takes, in the steady state, 80 % of the
        limits, all of its frequencies alike; or, without limits, amplitude 1 and limits 1.25 times what the reference
        takes. A ramp alone and a reference in a file have the frequency 0.

    Raises
    ------
    InputError
        Two references are given at once, the file of one is none, or a choice does not follow from the plant: the
        lines of its fit are not known, or the reference takes no lasting control, or one without bound.
    """
    require_consistent(given)
    found = {name: Setting(value) for name, value in _named(model).items()}
    found |= {name: Setting(value) for name, value in given.items()}
    if "reference-hz" not in found:
        found["reference-hz"] = _frequency(model, given)
    if "reference" in given:
        read_reference(Path(given["reference"]))
        if "limit" not in given:
            raise InputError("a reference in a file has no steady state from which limits follow; expected --limit")
    else:
        _complete_sinusoids(model.plant, found)
    return {name: found[name] for name in KEYS if name in found}


def as_table(axis: Mapping[str, Setting]) -> pd.DataFrame:
    """The settings, a row each: key; value, numbers with blanks between; source, given or chosen; why."""
    rows = [
        {
            "key": name,
            "value": " ".join(map(repr, value)) if isinstance(value, tuple) else str(value),
            "source": "given" if why is None else "chosen",
            "why": why,
        }
        for name, (value, why) in axis.items()
    ]
    return pd.DataFrame(rows)


def _named(model: IdentifiedModel) -> dict[str, str]:
    """The names and units of the signals that somebody gave."""
    signals, usual = asdict(model.signals), asdict(UNNAMED)
    return {name.replace("_", "-"): value for name, value in signals.items() if value != usual[name]}


def _frequency(model: IdentifiedModel, given: Mapping[str, Any]) -> Setting:
    if "reference" in given:
        return Setting((0.0,), "the design follows the constants of the reference in the file, and no other frequency")
    if "slope" in given and "amplitude" not in given:
        return Setting((0.0,), "the reference is a ramp alone")
    if model.fit is None:
        raise InputError("the model does not say to which lines it was fitted; expected --reference-hz")
    lowest, highest = (
        pick(test.band[end] for test in model.fit.tests) / math.tau for pick, end in ((max, 0), (min, 1))
    )
    if INSIDE * lowest < highest:
        why = (
            f"twice the lowest line that every test has, {lowest:.4g} Hz: slow, and an octave within the measured band"
        )
        return Setting((_rounded(INSIDE * lowest),), why)
    why = f"the middle of the lines that every test has, {lowest:.4g} to {highest:.4g} Hz"
    return Setting((_rounded(math.sqrt(lowest * highest)),), why)


def _complete_sinusoids(plant: PlantModel, found: dict[str, Setting]) -> None:
    """Add phases, amplitudes and limits, as far as they are missing."""
    count = len(found["reference-hz"].value)
    if "phase" not in found:
        why = "the reference begins at its crest, the start that asks most of the actuator"
        found["phase"] = Setting((CREST,) * count, why)
    if "amplitude" not in found and "slope" in found and found["reference-hz"].why is not None:
        found["amplitude"] = Setting((0.0,) * count, "the reference is a ramp alone")
    if "limit" in found and "amplitude" not in found:
        amplitude = _amplitude_within(plant, found, found["limit"].value)
        why = f"in the steady state the control of perfect tracking takes {SHARE:.0%} of the limits"
        found["amplitude"] = Setting((amplitude,) * count, why)
    if "amplitude" not in found:
        found["amplitude"] = Setting((1.0,) * count, "no amplitude and no limits were given: one unit of the output")
    reference = _reference(found, found["amplitude"].value)
    if "limit" not in found:
        needed = reference.required(plant).value
        if not 0 < needed < math.inf:
            raise InputError(
                f"the reference needs a steady control of {needed:g}, from which no limits follow; expected --limit"
            )
        why = f"ASSUMED: none were given; {ROOM:g} times what the reference takes in the steady state"
        found["limit"] = Setting((-ROOM * needed, ROOM * needed), why)


def _amplitude_within(plant: PlantModel, found: Mapping[str, Setting], limits: tuple[float, float]) -> float:
    """The amplitude, the same at all frequencies, at which the control comes as near to a limit as SHARE allows."""
    from scipy.optimize import brentq

    middle, half = SHARE * (limits[0] + limits[1]) / 2, SHARE * (limits[1] - limits[0]) / 2
    ones = (1.0,) * len(found["phase"].value)
    waves = _reference({**found, "offset": Setting(0.0), "slope": Setting(0.0)}, ones).required(plant).value

    def beyond(amplitude: float) -> float:
        """How far the control goes from the middle, over what it may; convex."""
        sizes = tuple(amplitude * each for each in ones)
        return _reference(found, sizes).required(plant, middle).value / half - 1

    alone = beyond(0.0)
    if not (0 < waves < math.inf and alone < 0):
        expected = "expected --amplitude"
        if not alone < 0:
            raise InputError(
                f"even at amplitude 0 the control exceeds {SHARE:.0%} of the limits {limits[0]:g} to {limits[1]:g}; "
                f"{expected}, or another --offset or --limit"
            )
        raise InputError(
            f"amplitude 1 needs a steady control of {waves:g}, from which no amplitude follows; {expected}"
        )
    return float(brentq(beyond, 0.0, 2 * (2 + alone) * half / waves, xtol=1e-300, rtol=1e-15))


def _reference(found: Mapping[str, Setting], amplitudes: tuple[float, ...]) -> Reference:
    offset, slope = (found[name].value if name in found else 0.0 for name in SINUSOIDS[2:])
    omegas = tuple(math.tau * hertz for hertz in found["reference-hz"].value)
    return Reference(amplitudes, omegas, found["phase"].value, offset, slope)


def _rounded(hertz: float) -> float:
    return float(f"{hertz:.3g}")
