"""How often ``antiwindup check`` calls a plant moved: one that has not, and one with a mode that moved by 2 %.

    python -m benchmarks.check_study --models 1000 --seed 1

Each model is fitted to 1 to 6 synthetic tests of one of several plants, with a noise of 0.3 to 10 % of the response and
a tenth of that of its median. Its structure is given. Two new sweeps follow, with half to twice the noise: one of the
same plant, one with the last pole mode moved.
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


def outcomes(seed: int, k: int) -> list[dict[str, object]]:
    """What the two sweeps of one model are told."""
    rng = np.random.default_rng([seed, k])
    plant = PLANTS[rng.integers(len(PLANTS))]
    count, lines, noise = int(rng.choice(TESTS)), int(rng.choice(LINES)), float(np.exp(rng.uniform(*np.log(NOISE))))
    structure = Structure.of(plant)
    tests = [measured(plant, rng, noise, lines, f"test {i}") for i in range(count)]
    model = fit_model(tests, Wanted(structure.integrators, structure.modes, structure.real)).model
    found: list[dict[str, object]] = []
    for true in (plant, with_moved_mode(plant)):
        sweep = measured(true, rng, noise * float(2 ** rng.uniform(-1, 1)), lines, "new")
        given = answers(check_model(model, [sweep]))
        told = {each.question: each.outcome is Outcome.MOVED for each in given}
        found.append({"moved": true is not plant, "tests": count, "lines": lines, "noise": noise} | told)
    return found


@click.command()
@click.option("--models", default=1000, show_default=True)
@click.option("--seed", default=1, show_default=True)
def main(models: int, seed: int) -> None:
    """Print the shares of sweeps that are told to have moved."""
    table = pd.DataFrame([row for k in tqdm(range(models), disable=None) for row in outcomes(seed, k)])
    table["any"] = table["within W_a"] | table["parameters"]
    table["noise"] = pd.cut(table["noise"], [0.003, 0.01, 0.03, 0.1])
    told = ["within W_a", "parameters", "any"]
    for by in (["moved"], ["moved", "tests"], ["moved", "lines"], ["moved", "noise"]):
        groups = table.groupby(by, observed=True)[told]
        click.echo(groups.mean().assign(sweeps=groups.size()).round(4).to_string() + "\n")


if __name__ == "__main__":
    main()
