"""Random cases: a plant of the class, its W_a, a design, a reference and a limit, from a seed and an index."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.runs.references import Reference
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

DELAY_FREE = 4  # every fourth case is a delay-free design


@dataclass(frozen=True)
class Finding:
    """One comparison.

    Parameters
    ----------
    quantity
        What was compared.
    disagreement
        How far apart the two answers are.
    allowed
        How far apart they may be; infinite where the referee's own error is too large to decide.
    """

    quantity: str
    disagreement: float
    allowed: float

    @property
    def share(self) -> float:
        """The disagreement as a share of what is allowed; infinite when it is not a number."""
        return self.disagreement / self.allowed if self.disagreement == self.disagreement else math.inf


@dataclass(frozen=True)
class Case:
    """A case; what a check draws beside it comes from :meth:`random`."""

    seed: int
    index: int

    def random(self, purpose: int) -> np.random.Generator:
        """A generator of its own for each purpose, so that no check changes what another one draws."""
        return np.random.default_rng([self.seed, self.index, purpose])

    @property
    def kind(self) -> str:
        """Of the design."""
        return "delay-free" if self.index % DELAY_FREE == DELAY_FREE - 1 else "extended"

    @cached_property
    def rate(self) -> float:
        """The unit of frequency in rad/s: milliseconds, seconds or a quarter of an hour."""
        random = self.random(0)
        return float(random.choice([1.0, 1e3, 1e-3]) * 10 ** random.uniform(-0.5, 0.5))

    @cached_property
    def slow(self) -> float:
        """The frequency in rad/s about which the reference lies: up to two and a half decades below the modes."""
        return float(self.rate * 10 ** self.random(1).uniform(-2.5, 0.0))

    @cached_property
    def model(self) -> IdentifiedModel:
        """K/s times 0 to 3 mode pairs, real pairs in a quarter of the cases, and W_a."""
        random = self.random(2)
        plant = PlantModel(
            gain=float(random.choice([-1, 1], p=[0.3, 0.7]) * 10 ** random.uniform(-6, 6)),
            **_roots(random, self.rate, int(random.integers(0, 4)), int(random.random() < 0.25)),
            delay_s=self._delay(random),
        )
        size = abs(plant.gain) / self.slow
        return IdentifiedModel(plant, _bound(random, self.rate, size))

    def _delay(self, random: np.random.Generator) -> float:
        kind = random.choice(4, p=[0.15, 0.25, 0.35, 0.25])
        low, high = ((0.0, 0.0), (-4.0, -1.5), (-1.5, 0.0), (0.0, 0.8))[kind]
        return float(10 ** random.uniform(low, high) / self.slow) if kind else 0.0

    @cached_property
    def options(self) -> dict[str, object]:
        """The arguments of the design beside the model."""
        random = self.random(3)
        if self.kind == "delay-free":
            share = 10 ** random.uniform(-3, -0.5)
            return {"reference_omegas": (float(self.slow),), "epsilon": float((share * self.slow) ** 2)}
        count = int(random.choice(8, p=[0.1, 0.35, 0.2, 0.1, 0.1, 0.05, 0.05, 0.05]))
        harmonics = np.sort(random.choice(np.arange(1, 12), count, replace=False))
        spread = 0.0 if random.random() < 0.5 else random.uniform(-0.3, 0.3, count)  # commensurate, or not
        omegas = [float(omega) for omega in self.slow * (harmonics + spread) / 6]
        if not omegas or random.random() < 0.2:
            omegas.append(0.0)
        a = float(self.slow * 10 ** random.uniform(0.0, 1.0))
        pairs = []
        for omega in omegas:
            if omega > 0:
                speed, damping = self.slow * 10 ** random.uniform(0.0, 0.6), random.uniform(0.4, 1.4)
                pairs.append((float(2 * damping * speed), float(speed**2)))
        epsilon = robust = None
        kind = random.random()
        if kind < 0.15:
            epsilon = float(10 ** random.uniform(-3, 0) / self.rate)
        elif kind < 0.4:
            robust = float(random.uniform(0.3, 0.95))
        return {
            "reference_omegas": omegas,
            "a": a,
            "pairs": pairs,
            "inverse_epsilon": epsilon or 0.0,
            "robust_level": robust,
        }

    @cached_property
    def design(self) -> Design:
        """The project's design; raises its InputError where it refuses."""
        make = design_delay_free if self.kind == "delay-free" else design_extended
        return make(self.model, **self.options)  # type: ignore[operator]

    @cached_property
    def reference(self) -> Reference:
        """Sinusoids at the frequencies of the design, in a third of the cases with r(0) = 0."""
        random = self.random(4)
        omegas = self.design.reference_omegas
        count = len(omegas)
        starts_at_zero = random.random() < 1 / 3
        size = 10 ** random.uniform(-3, 3)
        amplitudes = tuple(float(size * random.uniform(0.3, 1.0)) for _ in range(count))
        phases = tuple(0.0 if starts_at_zero else float(random.uniform(-math.pi, math.pi)) for _ in range(count))
        if omegas == (0.0,):
            phases = (math.pi / 2,)
        offset = 0.0 if starts_at_zero or random.random() < 0.5 else float(size * random.uniform(-1, 1))
        return Reference(amplitudes, omegas, phases, offset)

    @cached_property
    def limit(self) -> float:
        """From a third of what following takes to ten times that."""
        reference, gain = self.reference, abs(self.model.plant.gain)
        waves = zip(reference.amplitudes, reference.omegas, strict=True)
        needed = sum(amplitude * max(omega, self.slow / 10) for amplitude, omega in waves) / gain
        return float(needed * 10 ** self.random(5).uniform(-0.5, 1.0))


@lru_cache(maxsize=16)
def case_of(seed: int, index: int) -> Case:
    """A case whose design is made once for all that ask for it."""
    return Case(seed, index)


def _mode(random: np.random.Generator, rate: float) -> Mode:
    zeta = random.uniform(0.5, 2.0) if random.random() < 0.15 else 10 ** random.uniform(-2.5, -0.3)
    return Mode(float(rate * 10 ** random.uniform(0.0, 1.5)), float(zeta))


def _roots(random: np.random.Generator, rate: float, pairs: int, reals: int) -> dict[str, tuple[object, ...]]:
    return {
        "zero_modes": tuple(_mode(random, rate) for _ in range(pairs)),
        "pole_modes": tuple(_mode(random, rate) for _ in range(pairs)),
        "real_zeros": tuple(float(rate * 10 ** random.uniform(0.0, 1.5)) for _ in range(reals)),
        "real_poles": tuple(float(rate * 10 ** random.uniform(0.0, 1.5)) for _ in range(reals)),
    }


def _bound(random: np.random.Generator, rate: float, size: float) -> AdditiveBound:
    """Of order 1 to 4, with no more zeros than a pole fewer; its gain a thousandth of ``size`` to a third."""
    gain = float(size * 10 ** random.uniform(-3.0, -0.5))
    corner = float(rate * 10 ** random.uniform(-1.0, 1.0))
    kind = random.integers(0, 4)
    if kind == 0:
        return AdditiveBound(gain, (), (), (), (corner,))
    if kind == 1:
        mode = _mode(random, rate)
        return AdditiveBound.printed_form(gain, corner, mode.omega, mode.zeta)
    poles = (_mode(random, rate), _mode(random, rate)) if kind == 3 else (_mode(random, rate),)
    zeros = (_mode(random, rate),)
    if kind == 3:
        return AdditiveBound(gain, zeros, poles, (corner,), ())
    return AdditiveBound(gain, zeros, poles, (), (corner,))
