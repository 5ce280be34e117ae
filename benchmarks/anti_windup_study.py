"""Which anti-windup recovers soonest, over random plants of 0 to 2 integrators, with dead times and modes.

.venv/bin/python benchmarks/anti_windup_study.py --plants 40 [--off]
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace

import numpy as np
import pandas as pd
from tqdm import tqdm

from design.chapters_3_4.design_extended import design_extended
from experiments.comparison import comparison_tables
from experiments.runs.references import sinusoid
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

REFERENCE = sinusoid(1.0, 1.5, math.pi / 2)
FASTER = 4.0  # times corrected, for a second one


def random_model(rng: np.random.Generator, integrators: int) -> IdentifiedModel:
    """A plant with up to two pairs of modes, and W_a of 0.3 % of its gain."""
    zeros, poles, omega = [], [], 40 * math.exp(rng.uniform())
    for _ in range(rng.integers(0, 3)):
        at_zero = omega * rng.uniform(1.1, 1.6)
        at_pole = at_zero * rng.uniform(1.1, 1.6)
        zeros.append(Mode(at_zero, 10 ** rng.uniform(-2, -1)))
        poles.append(Mode(at_pole, 10 ** rng.uniform(-2, -1)))
        omega = 1.5 * at_pole
    rates = () if integrators else (10 ** rng.uniform(-0.3, 1.0),)
    gain = float(rng.choice([-1, 1])) * 10 ** rng.uniform(-0.5, 1)
    delay_s = 10 ** rng.uniform(-3, -1.3)
    plant = PlantModel(gain, tuple(zeros), tuple(poles), delay_s, integrators, (), rates)
    return IdentifiedModel(plant, AdditiveBound.printed_form(0.003 * abs(gain), 100.0, 300.0, 0.1))


def off(plant: PlantModel) -> PlantModel:
    """The true plant of a model that is off: gain 5 %, modes 3 %, their damping 20 %, dead time 10 %."""
    zeros, poles = (
        tuple(Mode(share * mode.omega, 0.8 * mode.zeta) for mode in modes)
        for share, modes in ((1.03, plant.zero_modes), (0.97, plant.pole_modes))
    )
    return replace(plant, gain=1.05 * plant.gain, zero_modes=zeros, pole_modes=poles, delay_s=1.1 * plant.delay_s)


def study(plants: int, is_off: bool) -> pd.DataFrame:
    """The rows of all comparisons, recovery over that of corrected beside."""
    rng, found = np.random.default_rng(1), []
    for k in tqdm(range(plants)):
        model = random_model(rng, k % 3)
        design = design_extended(model, [1.5])
        own_s, bandwidth = design.corrected.judgement.recovery_s / FASTER, design.corrected.bandwidth
        bandwidth = max(bandwidth, 1.01 * math.log(100) / own_s)
        faster = design_extended(model, [1.5], recovery_s=own_s, bandwidth=bandwidth)
        design = replace(design, added={"corrected, faster": faster.corrected})
        table = comparison_tables(design, REFERENCE, plant=off(model.plant) if is_off else None)["compare"]
        table["recovery_s"] = table["recovery_s"].where(table["recovery_s"].notna(), np.inf)
        own = table[table["run"] == "corrected"].set_index("upset")["recovery_s"]
        with np.errstate(invalid="ignore"):
            table["over_corrected"] = (table["recovery_s"] / table["upset"].map(own)).fillna(1.0)
        table["f"] /= table.loc[table["run"] == "corrected", "f"].iloc[0]
        found.append(table[table["refused"].isna()].assign(plant=k, integrators=model.plant.integrators))
    return pd.concat(found, ignore_index=True)


def main() -> None:
    """Print medians, and how often each was the first of those with a global guarantee."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, default=45)
    parser.add_argument("--off", action="store_true", help="The true plants differ from the models.")
    asked = parser.parse_args()
    rows = study(asked.plants, asked.off)
    for (integrators, upset), part in rows.groupby(["integrators", "upset"]):
        every = part.groupby("run", sort=False)
        covered = part[(part["guarantee"] == "global") & np.isfinite(part["recovery_s"])]
        first = covered.loc[covered.groupby("plant")["recovery_s"].idxmin()]["run"].value_counts()
        table = pd.DataFrame(
            {
                "plants": every.size(),
                "global": every["guarantee"].apply(lambda said: (said == "global").sum()),
                "recovers": every["recovery_s"].apply(lambda time_s: np.isfinite(time_s).sum()),
                "recovery/corrected": every["over_corrected"].median(),
                "worst": every["over_corrected"].max(),
                "f/corrected": every["f"].median(),
                "|u|/limit": every["largest_control"].median(),
                "first": first,
            }
        )
        print(
            f"\n{integrators} integrators, {upset}\n{table.reindex(every.size().index).to_string(float_format='%.3g')}"
        )


if __name__ == "__main__":
    main()
