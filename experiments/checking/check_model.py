"""A model, new sweeps and a design -> what was found of each sweep, as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.design_file import Design
from experiments.checking.design_on_plant import OnPlant, Promise, on_plant, promise, require_of_model
from experiments.checking.new_sweep import NewSweep, fitted, lines_to_check
from experiments.checking.parameter_moves import Move, moves
from experiments.checking.within_bound import Reach, reach_at_lines, reach_between_lines
from identification.model.fit_record import FitRecord
from identification.model.model_file import IdentifiedModel
from identification.sweeps.response import FrequencyResponse

LEVEL = 0.01
"""Probability with which a check finds that something moved though nothing did: half for W_a, half for parameters.

It holds where tests of the plant, old and new, differ by noise alone. Where they differ by more, a plant outside W_a
need not have moved, and the rates are those that docs/how_to/check.md has measured.
"""


@dataclass(frozen=True)
class SweepCheck:
    """What was found of one new sweep.

    Parameters
    ----------
    name, lines, band
        Of the sweep: how many lines were compared, and the lowest and highest in rad/s.
    sweep
        With its own fit in the model's structure; or why no such plant fits.
    at_lines, between_lines
        Where it comes farthest from the model; None without a fit.
    beyond_fit
        Where a line comes farthest beyond both W_a and the sweep's own fit; None without a fit.
    moves
        Of each parameter; None where the model does not say how sure its own are, or without a fit.
    design
        What the design has on the fitted plant; None without a fit or a design.
    new_at
        Frequency in rad/s near which the sweep shows what the model's structure does not have: neighbouring residuals
        of its fit correlate by more than chance and more than those of the model's tests. None where they do not.
    """

    name: str
    lines: int
    band: tuple[float, float]
    sweep: NewSweep | str
    at_lines: Reach | None = None
    between_lines: Reach | None = None
    beyond_fit: Reach | None = None
    moves: tuple[Move, ...] | None = None
    design: OnPlant | None = None
    new_at: float | None = None


@dataclass(frozen=True)
class ModelCheck:
    """What was found of all new sweeps.

    Parameters
    ----------
    model
        The model that they were compared with.
    sweeps
        One for each sweep, or one for all where their bands differ.
    promise
        Of the design; None without one.
    """

    model: IdentifiedModel
    sweeps: tuple[SweepCheck, ...]
    promise: Promise | None

    @property
    def share(self) -> float:
        """Probability with which one question of one sweep is answered wrongly where nothing moved."""
        return LEVEL / (2 * len(self.sweeps))


def check_model(model: IdentifiedModel, tests: Sequence[FrequencyResponse], design: Design | None = None) -> ModelCheck:
    """Compare new sweeps of a plant with its model, and see what a design has on the plant as it is now.

    Parameters
    ----------
    model
        The model.
    tests
        One or more new sweeps.
    design
        A design of this model.

    Raises
    ------
    InputError
        A sweep has no or too few lines in the model's band, or does not determine the plant's parameters; the design is
        of another model.
    """
    if design is not None:
        require_of_model(design, model)
    used = lines_to_check(model, tests)
    promised = None if design is None else promise(design)
    share = LEVEL / (2 * len(used))
    return ModelCheck(model, tuple(_checked(model, test, design, share) for test in used), promised)


def _checked(model: IdentifiedModel, test: FrequencyResponse, design: Design | None, share: float) -> SweepCheck:
    sweep, band = fitted(model, test), (float(test.omega[0]), float(test.omega[-1]))
    if isinstance(sweep, str):
        return SweepCheck(test.name, test.omega.size, band, sweep)
    return SweepCheck(
        test.name,
        test.omega.size,
        band,
        sweep,
        at_lines=reach_at_lines(model, sweep),
        between_lines=reach_between_lines(model, sweep),
        beyond_fit=reach_at_lines(model, sweep, or_fit=True),
        moves=None if model.fit is None else moves(model, model.fit, sweep, share),
        design=None if design is None else on_plant(design, sweep.fit.plant),
        new_at=None if model.fit is None else _new_at(model.fit, sweep),
    )


def _new_at(record: FitRecord, sweep: NewSweep) -> float | None:
    before = max(test.residual_correlation for test in record.tests)
    by_chance = 3 / np.sqrt(sweep.fit.lines)  # 4.2 standard deviations
    return sweep.fit.worst_omega if sweep.fit.correlation > max(before, 0.0) + by_chance else None
