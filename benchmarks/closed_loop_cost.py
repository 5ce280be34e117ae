"""What one run of a saturated loop costs over its horizon, the plant's mode pairs and its dead time.

    python benchmarks/closed_loop_cost.py --output build/bench

Everything here is SYNTHETIC: the plants are the set ``implied`` and seeded random ones, and the times are those of the
machine that it runs on. Writes closed_loop_cost.pdf and .png, and prints the same numbers as a table. The slope is that
of log cost over log horizon where a run is long: 1 is a cost that grows linearly.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tqdm import tqdm

from data.thesis import model_named
from design.chapters_3_4.design_extended import design_extended
from experiments.engine.compiled_loop import compile_loop
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.thesis.printed_choices import thesis_reference
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

OMEGA = 1.5  # of the reference, rad/s
HORIZON_S = 30.0
HORIZONS_S = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 240.0, 480.0, 960.0)
LONG_S = 120.0
"""Runs at least as long give the slope: shorter ones are mostly preparation and the first second, full of events."""
PAIRS = range(1, 9)
PLANTS = 5  # for each number of pairs
DELAYS_S = (0.0, 1e-9, 1e-7, 1e-6, 1e-5, 4e-5, 1e-4, 0.5e-3, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3)
FASTEST = 900.0  # rad/s, the last mode of every random plant, so that only the number of modes differs
ROUNDS = 7


@dataclass(frozen=True)
class Cost:
    """Median and quartiles of the seconds that one run takes."""

    median: float
    lower: float
    upper: float


def main() -> None:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--output", type=Path, required=True, help="folder of the figure; it is made")
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    implied = model_named("implied")
    seeded = [(pairs, seed) for pairs in PAIRS for seed in range(PLANTS)]
    with tqdm(total=len(HORIZONS_S) + len(seeded) + len(DELAYS_S), disable=None, leave=False) as bar:

        def measured(model: IdentifiedModel, horizon_s: float = HORIZON_S) -> Cost:
            bar.update()
            return cost(*saturated_loop(model), horizon_s)

        by_horizon = {horizon: measured(implied, horizon) for horizon in HORIZONS_S}
        by_plant = {
            (pairs, seed): measured(replace(implied, plant=random_plant(pairs, seed))) for pairs, seed in seeded
        }
        by_delay = {
            delay: measured(replace(implied, plant=replace(implied.plant, delay_s=delay))) for delay in DELAYS_S
        }
    by_pairs = {pairs: across([found for (count, _), found in by_plant.items() if count == pairs]) for pairs in PAIRS}
    slope = long_slope(by_horizon)
    print_table("horizon s", by_horizon)
    print_table(f"mode pairs ({PLANTS} random plants each, {HORIZON_S:g} s)", by_pairs)
    print_table(f"dead time s ({HORIZON_S:g} s)", by_delay)
    print_shares(*saturated_loop(implied))
    print(f"slope of log cost over log horizon from {LONG_S:g} s on: {slope:.3f}")
    medians = np.array([found.median for found in by_horizon.values()])
    each, first = np.polyfit(list(by_horizon), medians, 1, w=1 / medians)
    print(f"cost of a run: {1e3 * first:.3g} ms and {1e3 * each:.3g} ms for each second")
    figure = draw(by_horizon, by_pairs, {1e3 * delay: found for delay, found in by_delay.items() if delay > 0}, slope)
    for ending in ("pdf", "png"):
        figure.savefig(folder / f"closed_loop_cost.{ending}", dpi=200)
    print(f"-> {folder / 'closed_loop_cost.pdf'}, .png")


def random_plant(pairs: int, seed: int) -> PlantModel:
    """A plant of the thesis's class with its gain and dead time: anti-resonances and resonances alternate."""
    random = np.random.default_rng([pairs, seed])
    omegas = np.sort(np.exp(random.uniform(np.log(50.0), np.log(0.9 * FASTEST), 2 * pairs)))
    omegas[-1] = FASTEST
    modes = [Mode(float(omega), float(random.uniform(0.01, 0.1))) for omega in omegas]
    return replace(model_named("implied").plant, zero_modes=tuple(modes[::2]), pole_modes=tuple(modes[1::2]))


def saturated_loop(model: IdentifiedModel) -> tuple[SaturatedLoop, float]:
    """The chapter 4 loop with the corrected anti-windup, and a limit that it saturates at and can follow within."""
    design = design_extended(model, [OMEGA], 4.0, [(2.0, 1.0)])
    reference = thesis_reference("extended", [OMEGA])
    limit = 1.2 * reference.required(model.plant).value
    return design_loop(design, reference, design.compensator("corrected")), limit


def cost(loop: SaturatedLoop, limit: float, horizon_s: float) -> Cost:
    """Time one run, sampled a thousand times."""
    time_s = np.linspace(0.0, horizon_s, 1001)
    simulate(loop, (-limit, limit), time_s)
    seconds = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        simulate(loop, (-limit, limit), time_s)
        seconds.append(time.perf_counter() - start)
    lower, median, upper = np.quantile(seconds, [0.25, 0.5, 0.75])
    return Cost(float(median), float(lower), float(upper))


def print_shares(loop: SaturatedLoop, limit: float) -> None:
    """Print where the processor time of a run goes that is sampled every millisecond, by leaving parts out."""
    every, ends = np.linspace(0.0, HORIZON_S, round(1000 * HORIZON_S) + 1), np.array([0.0, HORIZON_S])
    parts = [partial(simulate, loop, (-limit, limit), every), partial(simulate, loop, (-limit, limit), ends)]
    whole, unsampled, prepared = (median_of(part) for part in (*parts, partial(compile_loop, loop)))
    print(f"where {1e3 * whole:.3g} ms of {HORIZON_S:g} s go, all signals sampled every millisecond:")
    for name, seconds in [
        ("equations and tables", prepared),
        ("steps and events", unsampled - prepared),
        ("samples", whole - unsampled),
    ]:
        print(f"  {name:20s}  {1e3 * seconds:8.3f} ms  {seconds / whole:4.0%}")


def median_of(call: Callable[[], object]) -> float:
    """The median processor seconds of a call, after a first one."""
    seconds = []
    for _ in range(1 + ROUNDS):
        start = time.process_time()
        call()
        seconds.append(time.process_time() - start)
    return float(np.median(seconds[1:]))


def across(plants: list[Cost]) -> Cost:
    """Median, least and largest of the medians of several plants."""
    medians = [found.median for found in plants]
    return Cost(float(np.median(medians)), min(medians), max(medians))


def long_slope(by_horizon: dict[float, Cost]) -> float:
    """The slope of log cost over log horizon, by least squares over the long runs."""
    long = [horizon for horizon in by_horizon if horizon >= LONG_S]
    return float(np.polyfit(np.log(long), np.log([by_horizon[horizon].median for horizon in long]), 1)[0])


def print_table(head: str, costs: dict[float, Cost] | dict[int, Cost]) -> None:
    """Print one row a value: median and range in milliseconds."""
    print(f"{head}: median [range] ms")
    for value, found in costs.items():
        print(f"  {value:8g}  {1e3 * found.median:8.3f}  [{1e3 * found.lower:.3f}, {1e3 * found.upper:.3f}]")


def draw(by_horizon: dict[float, Cost], by_pairs: dict[int, Cost], by_delay: dict[float, Cost], slope: float) -> Figure:
    """Three panels with one scale of cost."""
    figure = Figure(figsize=(6.5, 2.8), layout="constrained")
    axes = figure.subplots(1, 3, sharey=True)
    _panel(axes[0], by_horizon, f"horizon / s\nslope from {LONG_S:g} s on: {slope:.2f}")
    _panel(axes[1], by_pairs, f"mode pairs of the plant\n{PLANTS} random plants: median, range")
    _panel(axes[2], by_delay, "dead time / ms\nplant of the set implied")
    last = max(by_horizon)
    line = 1e3 * by_horizon[last].median * np.array([LONG_S / last, 1.0])
    axes[0].plot([LONG_S, last], line, color="black", linestyle="--", linewidth=0.8, label="slope 1")
    axes[0].legend(fontsize=8, frameon=False)
    for panel in axes[[0, 2]]:
        panel.set_xscale("log")
    axes[1].set_xticks(list(PAIRS))
    axes[0].set_yscale("log")
    axes[0].set_ylabel("one run / ms", fontsize=8)
    figure.suptitle(
        f"What one simulated run costs: {HORIZON_S:g} s unless varied, synthetic plants, this machine", fontsize=9
    )
    return figure


def _panel(panel: Axes, costs: dict[float, Cost] | dict[int, Cost], label: str) -> None:
    median, lower, upper = (
        1e3 * np.array([getattr(c, name) for c in costs.values()]) for name in ("median", "lower", "upper")
    )
    panel.errorbar(
        list(costs), median, [median - lower, upper - median], fmt="o-", markersize=3, linewidth=1, capsize=2
    )
    panel.set_xlabel(label, fontsize=8)
    panel.tick_params(labelsize=8)
    panel.grid(which="both", color="#E0E0E0", linewidth=0.4)


if __name__ == "__main__":
    main()
