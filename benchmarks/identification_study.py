"""A seeded study of the fit on synthetic tests: how often it is right, how close to the statistical limit, how fast.

    make study                      the cases below with 200 sets each
    make study SETS=1000

Everything here is SYNTHETIC: each set is three tests of one plant, drawn anew with complex Gaussian errors of variance
b^2 |P|^2 + a^2, a being 1 % of the median |P|. The fit is told nothing: it finds the numbers of integrators,
modes and real roots, the delay and the noise itself. Only of the tests with 8 lines it is told the structure.

Columns. right: the structure is the plant's. success: and every parameter is within 5 Cramer-Rao standard deviations of
the truth. RMSE/CRB: root mean square error of each parameter over all sets of right structure, over the square root
of the Cramer-Rao bound (variances known); the mean over the parameters and the worst of them. From n sets that ratio is
itself uncertain by 1/sqrt(2 n). coverage: how often the 95 % intervals hold the truth, mean and range over the
parameters. (Cases with another plant in every set have no ratio and coverage for one parameter: theirs are over all
parameters of all sets.) seconds: median and 95 % quantile of one call of fit_plant, three tests.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from tqdm import tqdm

from data.thesis import model_named
from identification.base.errors import InputError
from identification.fitting.fit_plant import fit_plant
from identification.fitting.least_squares import log_jacobian
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.structure import Structure, Wanted
from identification.sweeps.response import FrequencyResponse

TESTS = 3
FLOOR = 0.01
OMEGA = 2 * np.pi * np.geomspace(10.0, 200.0, 400)
FAR = 5.0


@dataclass(frozen=True)
class Outcome:
    """Of one set: errors over the Cramer-Rao standard deviations, and whether the intervals hold the truth."""

    right: bool
    errors: np.ndarray
    covered: np.ndarray
    seconds: float


def structure_of(plant: PlantModel) -> Structure:
    zeros = 2 * len(plant.zero_modes) + len(plant.real_zeros)
    return Structure(plant.integrators, zeros, 2 * len(plant.pole_modes) + len(plant.real_poles))


def theta_of(plant: PlantModel) -> np.ndarray:
    """The parameters of :class:`identification.model.structure.Structure`, modes sorted by omega."""
    values = [parameter.value for parameter in plant.parameters]
    return np.append(np.log(np.abs(values[:-1])), values[-1])


def thesis_plant(rng: np.random.Generator) -> PlantModel:
    return model_named("implied").plant


def random_modes(rng: np.random.Generator, count: int) -> list[Mode]:
    """Modes within the band, each apart from its neighbours by 0.8 to 1.2 of their mean distance in log frequency."""
    places = np.linspace(np.log(OMEGA[0]), np.log(OMEGA[-1]), count + 2)
    width = places[1] - places[0]
    places = rng.permutation(places[1:-1] + rng.uniform(-0.1, 0.1, count) * width)
    return [Mode(float(np.exp(place)), float(np.exp(rng.uniform(np.log(0.005), np.log(0.15))))) for place in places]


def in_order(modes: list[Mode]) -> tuple[Mode, ...]:
    return tuple(sorted(modes, key=lambda mode: mode.omega))


def random_plant(rng: np.random.Generator) -> PlantModel:
    """One integrator, 1 to 3 mode pairs, delay 0 to 20 ms, gain of either sign over four decades."""
    pairs = int(rng.integers(1, 4))
    modes = random_modes(rng, 2 * pairs)
    gain = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-2, 2))
    return PlantModel(gain, in_order(modes[:pairs]), in_order(modes[pairs:]), float(rng.uniform(0, 0.02)))


def general_plant(rng: np.random.Generator) -> PlantModel:
    """0 to 2 integrators, 0 to 2 zero modes and at least as many pole modes, a real pole or zero in the band or not."""
    zeros, extra = int(rng.integers(0, 3)), int(rng.integers(0, 2))
    real_poles, integrators = int(rng.integers(0, 2)), int(rng.integers(0, 3))
    real_zeros = int(rng.integers(0, 2)) if real_poles + integrators + 2 * extra > 0 else 0
    modes = random_modes(rng, 2 * zeros + extra)
    low, high = np.log(OMEGA[0] * 1.5), np.log(OMEGA[-1] / 1.5)
    rates = np.exp(
        rng.permutation([rng.uniform(low, low + 0.35 * (high - low)), rng.uniform(high - 0.35 * (high - low), high)])
    )
    return PlantModel(
        float(rng.choice([-1, 1]) * 10 ** rng.uniform(-2, 2)),
        in_order(modes[:zeros]),
        in_order(modes[zeros:]),
        float(rng.uniform(0, 0.02)),
        integrators,
        tuple(float(rate) for rate in rates[:1] * real_zeros if real_zeros),
        tuple(float(rate) for rate in rates[1:] * real_poles if real_poles),
    )


def plain_plant(rng: np.random.Generator) -> PlantModel:
    """An integrator and a dead time."""
    return PlantModel(0.7, (), (), 0.1)


@dataclass(frozen=True)
class Case:
    """Plants, relative noise, lines, and what the fit is told."""

    draw: Callable[[np.random.Generator], PlantModel]
    relative: float
    omega: np.ndarray = field(default_factory=lambda: OMEGA)
    wanted: Wanted | None = None


def one_set(case: Case, seed: list[int]) -> Outcome:
    """Draw a plant and three tests, fit, compare."""
    rng, omega = np.random.default_rng(seed), case.omega
    plant = case.draw(rng)
    exact = plant(1j * omega)
    sigma = np.hypot(case.relative * np.abs(exact), FLOOR * np.median(np.abs(exact)))
    noise = rng.standard_normal((TESTS, omega.size, 2)) @ [1, 1j] / np.sqrt(2)
    tests = [
        FrequencyResponse(omega, exact + sigma * noise[k], None, f"synthetic {k}", synthetic=True) for k in range(TESTS)
    ]
    begin = time.perf_counter()
    try:
        result = fit_plant(tests, case.wanted)
    except InputError:  # a fit refused is a fit that failed
        return Outcome(False, np.zeros(0), np.zeros(0), time.perf_counter() - begin)
    seconds = time.perf_counter() - begin
    structure, truth = structure_of(plant), theta_of(plant)
    # whether a short dead time shows is no matter of structure here: its interval holds it or does not
    if replace(result.structure, delayed=True) != structure or np.sign(plant.gain) != np.sign(result.plant.gain):
        return Outcome(False, np.zeros(0), np.zeros(0), seconds)
    rows = (exact / sigma)[:, None] * log_jacobian(structure, truth, omega)
    bound = np.sqrt(np.diag(np.linalg.inv(2 * TESTS * (rows.conj().T @ rows).real)))
    lower, upper = result.nominal.intervals
    values = np.array([parameter.value for parameter in plant.parameters])
    return Outcome(True, (result.nominal.theta - truth) / bound, (lower <= values) & (values <= upper), seconds)


CASES = {
    "thesis's plant, 3 % noise": Case(thesis_plant, 0.03),
    "thesis's plant, 10 % noise": Case(thesis_plant, 0.10),
    "random plants, 5 % noise": Case(random_plant, 0.05),
    "general plants, 5 % noise": Case(general_plant, 0.05),
    "8 lines, integrator": Case(plain_plant, 0.02, np.geomspace(1.0, 1000.0, 8), Wanted(1, (0, 0), (0, 0))),
}


def row_of(name: str, outcomes: list[Outcome]) -> str:
    right = [outcome for outcome in outcomes if outcome.right]
    success = np.mean([outcome.right and bool(np.all(np.abs(outcome.errors) < FAR)) for outcome in outcomes])
    same = len({outcome.errors.size for outcome in right}) == 1 and ("thesis" in name or "lines" in name)
    errors, covered = ([getattr(o, key) for o in right] for key in ("errors", "covered"))
    table, holds = (np.array(x) if same else np.concatenate(x)[:, None] for x in (errors, covered))
    ratio, coverage = np.sqrt(np.mean(table**2, axis=0)), np.mean(holds, axis=0)
    seconds = np.array([outcome.seconds for outcome in outcomes])
    return (
        f"{name:<28}{len(outcomes):>5}{100 * len(right) / len(outcomes):>8.1f} %{100 * success:>8.1f} %"
        f"{ratio.mean():>8.3f}{ratio.max():>8.3f}"
        f"{100 * coverage.mean():>8.1f}{100 * coverage.min():>7.1f} -{100 * coverage.max():>6.1f} %"
        f"{np.median(seconds):>8.3f}{np.quantile(seconds, 0.95):>7.3f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Study of the fit on synthetic tests.")
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--case", choices=CASES, action="append")
    arguments = parser.parse_args()
    print(
        f"{'SYNTHETIC, 3 tests, 400 lines':<28}{'sets':>5}{'right':>7}{'success':>10}{'RMSE/CRB mean, worst':>16}"
        f"{'coverage mean, range':>24}{'seconds':>13}"
    )
    with ProcessPoolExecutor(os.process_cpu_count() if hasattr(os, "process_cpu_count") else os.cpu_count()) as pool:
        for number, (name, case) in enumerate(CASES.items()):
            if arguments.case and name not in arguments.case:
                continue
            seeds = [[arguments.seed, number, k] for k in range(arguments.sets)]
            work = pool.map(partial(one_set, case), seeds, chunksize=4)
            print(row_of(name, list(tqdm(work, total=len(seeds), disable=None, leave=False))), flush=True)


if __name__ == "__main__":
    main()
