"""How often ``antiwindup check`` fails a plant: one that has not moved, and one with a mode that moved by 2 %.

    python -m benchmarks.check_study --models 1000 --seed 1
    python -m benchmarks.check_study --models 200 --tests 3 --scatter 0.005

Each model is fitted to 1 to 6 synthetic tests of one of several plants, with a noise of 0.3 to 10 % of the response and
a tenth of that of its median. Its structure is given. Two new sweeps follow, with half to twice the noise: one of the
same plant, one with the last pole mode moved. With a scatter the gain and the frequency of each mode differ from sweep
to sweep, old and new, by independent normal shares with this standard deviation.
"""

from __future__ import annotations

from dataclasses import replace

import click
import numpy as np
import pandas as pd
from tqdm import tqdm

from experiments.checking.answers import Outcome, answers
from experiments.checking.check_model import check_model
from identification.fit_model import fit_model
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.structure import Structure, Wanted
from identification.sweeps.response import FrequencyResponse

PLANTS = (
    PlantModel(-2.0, (Mode(50.0, 0.03),), (Mode(80.0, 0.02),), 5e-3),
    PlantModel(7.0, (Mode(40.0, 0.01), Mode(200.0, 0.04)), (Mode(65.0, 0.02), Mode(215.0, 0.1)), 8e-3),
    PlantModel(5.0, (Mode(110.0, 0.03),), (Mode(160.0, 0.02),), 3e-3, 0, real_poles=(45.0,)),
    PlantModel(2.0, (Mode(110.0, 0.03),), (Mode(60.0, 0.05), Mode(160.0, 0.02)), 3e-3, 0),
    PlantModel(90.0, (), (Mode(150.0, 0.02),), 10e-3, 2),
)
LINES, TESTS, NOISE = (60, 150, 400), (1, 2, 3, 6), (0.003, 0.1)
MOVED = 0.02


def measured(plant: PlantModel, rng: np.random.Generator, noise: float, lines: int, name: str) -> FrequencyResponse:
    """A sweep of a plant."""
    omega = np.geomspace(20.0, 320.0, lines)
    response = plant(1j * omega)
    sigma = noise * np.hypot(np.abs(response), 0.1 * np.median(np.abs(response)))
    error = sigma * (rng.standard_normal((lines, 2)) @ [1, 1j]) / np.sqrt(2)
    return FrequencyResponse(omega, response + error, None, name)


def with_moved_mode(plant: PlantModel) -> PlantModel:
    """The plant with its last pole mode at another frequency."""
    *others, last = plant.pole_modes
    return replace(plant, pole_modes=(*others, replace(last, omega=last.omega * (1 + MOVED))))


def scattered(plant: PlantModel, rng: np.random.Generator, scatter: float) -> PlantModel:
    """The plant as one sweep meets it."""

    def other(value: float) -> float:
        return value * (1 + scatter * float(rng.standard_normal()))

    return replace(
        plant,
        gain=other(plant.gain),
        zero_modes=tuple(replace(mode, omega=other(mode.omega)) for mode in plant.zero_modes),
        pole_modes=tuple(replace(mode, omega=other(mode.omega)) for mode in plant.pole_modes),
    )


def outcomes(seed: int, k: int, counts: tuple[int, ...], scatter: float) -> list[dict[str, object]]:
    """What is said of the two sweeps of one model."""
    rng = np.random.default_rng([seed, k])
    plant = PLANTS[rng.integers(len(PLANTS))]
    count, lines, noise = int(rng.choice(counts)), int(rng.choice(LINES)), float(np.exp(rng.uniform(*np.log(NOISE))))
    structure = Structure.of(plant)
    tests = [measured(scattered(plant, rng, scatter), rng, noise, lines, f"test {i}") for i in range(count)]
    model = fit_model(tests, Wanted(structure.integrators, structure.modes, structure.real)).model
    found: list[dict[str, object]] = []
    for true in (plant, with_moved_mode(plant)):
        new = scattered(true, rng, scatter)
        sweep = measured(new, rng, noise * float(2 ** rng.uniform(-1, 1)), lines, "new")
        said = {each.question: each.outcome for each in answers(check_model(model, [sweep]))}
        told = {
            "leaves W_a": said["within W_a"].fails,
            "parameters moved": said["parameters"].fails,
            "moved": Outcome.MOVED in said.values(),
            "fails": any(outcome.fails for outcome in said.values()),
        }
        found.append({"mode moved": true is not plant, "tests": count, "lines": lines, "noise": noise} | told)
    return found


@click.command()
@click.option("--models", default=1000, show_default=True)
@click.option("--seed", default=1, show_default=True)
@click.option("--tests", multiple=True, default=TESTS, show_default=True, help="Of a model, one of these at random.")
@click.option("--scatter", default=0.0, show_default=True, help="Standard deviation from sweep to sweep, as a share.")
def main(models: int, seed: int, tests: tuple[int, ...], scatter: float) -> None:
    """Print the shares of sweeps that leave W_a, that are said to have moved, and that fail a check at all."""
    runs = tqdm(range(models), disable=None)
    table = pd.DataFrame([row for k in runs for row in outcomes(seed, k, tests, scatter)])
    table["noise"] = pd.cut(table["noise"], [0.003, 0.01, 0.03, 0.1])
    told = ["leaves W_a", "parameters moved", "moved", "fails"]
    for by in (["mode moved"], *(["mode moved", each] for each in ("tests", "lines", "noise"))):
        groups = table.groupby(by, observed=True)[told]
        click.echo(groups.mean().assign(sweeps=groups.size()).round(4).to_string() + "\n")


if __name__ == "__main__":
    main()
