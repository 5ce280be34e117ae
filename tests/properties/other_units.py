"""The same plant, bound, design and reference in other units of time, of the output and of the input."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import tau

import numpy as np

from design.anti_windup.compensator import AntiWindup
from design.anti_windup.judge import Compensator
from design.blocks.block import Block
from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from design.parameters import DelayFreeParameters, ExtendedParameters
from experiments.runs.references import Reference, SampledReference
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel


@dataclass(frozen=True)
class Units:
    """By what numbers in the old units are multiplied in the new ones.

    Parameters
    ----------
    time
        Of times; positive.
    output, input
        Of y and of u; the sign of the one and of the other may differ, which changes that of the plant's gain.
    """

    time: float = 1.0
    output: float = 1.0
    input: float = 1.0

    @property
    def gain(self) -> float:
        """Of what takes an input and gives an output, such as P(j omega)."""
        return self.output / self.input

    def mode(self, mode: Mode) -> Mode:
        """Its frequency is a rate."""
        return Mode(mode.omega / self.time, mode.zeta)

    def rates(self, rates: tuple[float, ...]) -> tuple[float, ...]:
        """In rad over the unit of time."""
        return tuple(rate / self.time for rate in rates)

    def plant(self, plant: PlantModel) -> PlantModel:
        """K is an output over an input and a time to the number of integrators."""
        return PlantModel(
            plant.gain * self.gain / self.time**plant.integrators,
            tuple(map(self.mode, plant.zero_modes)),
            tuple(map(self.mode, plant.pole_modes)),
            plant.delay_s * self.time,
            plant.integrators,
            self.rates(plant.real_zeros),
            self.rates(plant.real_poles),
        )

    def bound(self, bound: AdditiveBound) -> AdditiveBound:
        """A magnitude, whatever the sign of the plant's gain."""
        return AdditiveBound(
            bound.gain * abs(self.gain),
            tuple(map(self.mode, bound.zero_modes)),
            tuple(map(self.mode, bound.pole_modes)),
            self.rates(bound.real_zeros),
            self.rates(bound.real_poles),
        )

    def model(self, model: IdentifiedModel) -> IdentifiedModel:
        """Plant and bound; standard errors and what the fit says are left out."""
        return IdentifiedModel(self.plant(model.plant), self.bound(model.additive_bound))

    def block(self, block: Block, factor: float = 1.0) -> Block:
        """``factor`` times the block at s times the unit of time."""
        zeros, poles = (tuple(root / self.time for root in roots) for roots in (block.zeros, block.poles))
        return Block(block.gain * factor * self.time**-block.relative_degree, zeros, poles, block.delay_s * self.time)

    def reference(self, reference: Reference) -> Reference:
        """Amplitudes, offset and slope are outputs, the last one a unit of time."""
        return Reference(
            tuple(amplitude * self.output for amplitude in reference.amplitudes),
            self.rates(reference.omegas),
            reference.phases_rad,
            reference.offset * self.output,
            reference.slope * self.output / self.time,
        )

    def samples(self, reference: SampledReference) -> SampledReference:
        """A reference of a file."""
        return SampledReference(reference.time_s * self.time, reference.values * self.output)

    def design(self, design: Design) -> Design:
        """A finished design: what a run takes of it, exact where the units are powers of 2.

        C is an input over an output. Of chapter 2 it is K A/Lambda, whose A is s as s -> 0 and whose Lambda is monic.
        """
        blocks = dict(design.blocks)
        if design.kind == "delay-free":
            order = len(blocks["Lambda"].zeros)
            blocks["Lambda"] = self.block(blocks["Lambda"], self.time**-order)
            blocks["K"] = self.block(blocks["K"], self.time ** (design.plant.integrators - order) / self.gain)
        else:
            blocks["K"] = self.block(blocks["K"], 1 / self.gain)
            blocks["T_so"] = self.block(blocks["T_so"])
        return replace(
            design,
            plant=self.plant(design.plant),
            additive_bound=self.bound(design.additive_bound),
            reference_omegas=self.rates(design.reference_omegas),
            blocks=blocks,
            parameters=self.parameters(design.parameters),
            thesis=self.compensator(design.thesis),
            corrected=self.compensator(design.corrected),
        )

    def compensator(self, of: Compensator) -> Compensator:
        """Times of the thesis's, bandwidth, f and certificate of the corrected one; of each f, where and recovery."""
        factors = {"alpha": self.time, "beta": self.time, "bandwidth": 1 / self.time, "f_lower": abs(self.gain)}
        judged, rows = of.judgement, getattr(of, "certificate", None)
        certificate = {} if rows is None else {"certificate": tuple(tuple(self.time * P for P in row) for row in rows)}
        return replace(
            of,
            kind=AntiWindup(self.block(of.kind.theta1_tilde), self.block(of.kind.one_plus)),
            judgement=replace(
                judged,
                f=judged.f * abs(self.gain),
                f_omega=None if judged.f_omega is None else judged.f_omega / self.time,
                recovery_s=judged.recovery_s * self.time,
            ),
            **{name: getattr(of, name) * factor for name, factor in factors.items() if hasattr(of, name)},
            **certificate,
        )

    def parameters(self, of: DelayFreeParameters | ExtendedParameters) -> DelayFreeParameters | ExtendedParameters:
        """a, e and f; nothing runs with chapter 2's."""
        if isinstance(of, DelayFreeParameters):
            return of
        pairs = tuple((e / self.time, f / self.time**2) for e, f in of.pairs)
        return replace(of, a=of.a / self.time, pairs=pairs)


def small_extended(model: IdentifiedModel, time: float) -> Design:
    """Chapters 3 and 4 for the small plant, in a unit of time."""
    return design_extended(model, [0.5 / time], 1.0 / time, [(1.0 / time, 0.3 / time**2)])


def small_delay_free(model: IdentifiedModel, time: float) -> Design:
    """Chapter 2 for the small plant, in a unit of time."""
    return design_delay_free(model, [tau / 12.0 / time], 1e-3 / time**2)


def same(found: np.ndarray, expected: np.ndarray, share: float) -> None:
    """Both are the same within a share of the largest that is expected; cells are empty in both or in none."""
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(expected))
    scale = float(np.abs(expected[np.isfinite(expected)]).max(initial=0.0))
    np.testing.assert_allclose(found, expected, rtol=0, atol=share * scale)
