"""The Monte Carlo campaign: plants inside the additive bound, each run without and with the two anti-windups."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from design.design_file import Design
from experiments.campaign.draw_plants import PlantsWithin
from experiments.campaign.linear_stability import PerturbedLoop
from experiments.engine.simulate import DivergenceError, simulate
from experiments.runs.compare_anti_windups import SETTLED, compensators, is_slewing
from experiments.runs.design_loop import Controller, plant_loop, realized_controller
from experiments.runs.guarantee import Guarantee, guarantee_within
from experiments.runs.metrics import last_saturation, settling_time
from experiments.runs.references import Reference
from experiments.runs.region import require_short
from experiments.runs.run_length import span
from experiments.runs.sector_promise import judge_run
from identification.base.errors import InputError
from identification.model.plant import PlantModel

SAMPLES_PER_PERIOD = 500
MEASURED = ("peak_error", "steady_error", "recovery_s", "last_saturation_s", "events")  # of a run that does not diverge

Chunk = tuple[int, int]
Columns = dict[str, list[Any]]


@dataclass(frozen=True)
class Campaign:
    """What every chunk of a campaign shares.

    Parameters
    ----------
    design
        The design; campaigns are told apart by its hash.
    design_sha256
        Of design.json.
    seed
        Not negative.
    reference
        r(t) of every run.
    limits
        (lower, upper), in the actuator's unit.
    periods
        Length of a run in :attr:`span_s`.
    rate_limit
        The most that the actuator changes in a second, in its unit.
    """

    design: Design = field(compare=False)
    design_sha256: str
    seed: int
    reference: Reference
    limits: tuple[float, float]
    periods: int
    rate_limit: float = math.inf

    @property
    def span_s(self) -> float:
        """What counts as a period, in seconds, see :func:`experiments.runs.run_length.span`."""
        return span(self.design, self.reference)

    @property
    def horizon_s(self) -> float:
        """Length of a run in seconds."""
        return self.periods * self.span_s


def run_chunk(campaign: Campaign, chunk: Chunk) -> Columns:
    """Draw and run the plants of a chunk, the same whatever the chunk, the process and the machine.

    Parameters
    ----------
    campaign
        What they share.
    chunk
        Number of its first plant, the very first being 0, and of the one after its last.

    Returns
    -------
    dict
        Three rows a plant, as columns:

        plant, anti_windup, distance
            The number, none or thesis or corrected, and the largest |P_true - P|/|W_a|, see
            :class:`experiments.campaign.draw_plants.Member`.
        linear_stable
            Whether the loop without saturation is, as :class:`experiments.campaign.linear_stability.PerturbedLoop`
            finds.
        diverged
            Whether the control passed 1e100 times the limits; then the numbers below are None.
        peak_error
            The largest |error| after the first quarter of the period: the loop starts from rest, and before that the
            error is the reference itself, whatever the controller.
        steady_error
            The largest |error| of the last period.
        recovery_s
            The time from which on |error| stays within 1 % of the reference's amplitude; None if that is not so all
            through the last period.
        last_saturation_s
            A located event, no sample; None if it saturates to the end.
        events
            How often the control crosses a limit.
        guaranteed_sector
            Of every plant within W_a, see :func:`experiments.runs.guarantee.guarantee_within`; 0: nothing is
            guaranteed.
        covered
            Whether the guarantee covers the run, see :mod:`experiments.runs.sector_promise`.
        largest_control, needed_sector
            The largest |u|, and the sector that the run needs, infinite where the reference takes a control that
            reaches a limit; None where nothing is guaranteed, or the actuator was too slow for the control.
        gain, delay_s, zero_omega_1, zero_zeta_1, ..., real_zero_1, ...
            The true plant.

    Raises
    ------
    InputError
        A plant cannot be drawn or a loop not be simulated, and the sentence names the plant.

    Notes
    -----
    The errors are those at 500 samples a period. The runs start from rest.
    """
    prepared = _prepared(campaign)
    columns: Columns = {}
    for index in range(*chunk):
        try:
            rows = prepared.rows(index)
        except InputError as error:
            raise InputError(f"plant {index} of seed {campaign.seed}: {error}") from None
        for row in rows:
            for name, value in row.items():
                columns.setdefault(name, []).append(value)
    return columns


@lru_cache(maxsize=2)
def _prepared(campaign: Campaign) -> _Runner:
    return _Runner(campaign)


class _Runner:
    """What is computed once for all plants of a campaign."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign, design = campaign, campaign.design
        self.plants = PlantsWithin(design.loop_plant, design.additive_bound)
        self.loop = PerturbedLoop(design)
        kinds = compensators(design)
        self.controllers = {name: realized_controller(design, kind) for name, kind in kinds.items()}
        self.guarantees = {
            name: Guarantee(0.0) if kind is None else guarantee_within(design, kind) for name, kind in kinds.items()
        }
        self.reference = campaign.reference
        samples = campaign.periods * SAMPLES_PER_PERIOD + 1
        require_short(design.loop_plant, campaign.horizon_s)
        self.time_s = np.linspace(0.0, campaign.horizon_s, samples)
        self.early = SAMPLES_PER_PERIOD // 4  # samples before the peak counts

    def rows(self, index: int) -> list[dict[str, Any]]:
        member = self.plants.draw(self.campaign.seed, index)
        stable = self.loop.unstable_roots(member.plant) == 0
        numbers = parameters(member.plant)
        return [
            {"plant": index, "anti_windup": name, "distance": member.distance, "linear_stable": stable}
            | self._metrics(member.plant, controller, self.guarantees[name])
            | numbers
            for name, controller in self.controllers.items()
        ]

    def _metrics(self, plant: PlantModel, controller: Controller, given: Guarantee) -> dict[str, Any]:
        loop = plant_loop(controller, plant, self.reference)
        loop = replace(loop, outputs={"error": loop.outputs["error"]})  # the others need not be read
        limits = self.campaign.limits
        promised = {"guaranteed_sector": given.sector, "covered": False, "largest_control": None, "needed_sector": None}
        try:
            run = simulate(loop, limits, self.time_s, rate=self.campaign.rate_limit)
        except DivergenceError:
            return {"diverged": True} | promised | dict.fromkeys(MEASURED)
        if given.sector and not is_slewing(run):  # a guarantee is of limits alone
            found = judge_run(given, loop, limits, run, self.reference, plant)
            promised |= {"covered": found.covered, "largest_control": found.largest_control}
            promised |= {"needed_sector": found.needed_sector}
        error = np.abs(run.outputs["error"])
        band, steady = SETTLED * self.reference.amplitude, float(error[-SAMPLES_PER_PERIOD - 1 :].max())
        recovery = _number(settling_time(self.time_s, error, band)) if steady <= band else None
        return {
            "diverged": False,
            "peak_error": float(error[self.early :].max()),
            "steady_error": steady,
            "recovery_s": recovery,
            "last_saturation_s": _number(last_saturation(run)),
            "events": len(run.events_s),
        } | promised


def parameters(plant: PlantModel) -> dict[str, float]:
    """The numbers of a plant, named: gain, delay_s, zero_omega_1, zero_zeta_1, ..., real_zero_1, ..."""
    found = {parameter.name: float(parameter.value) for parameter in plant.parameters}
    return {"gain": plant.gain, "delay_s": plant.delay_s} | found


def _number(value: float) -> float | None:
    return None if np.isnan(value) else float(value)
