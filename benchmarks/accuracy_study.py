"""The engine's error against collocation, for every limit, dead time, reference and anti-windup.

    OPENBLAS_NUM_THREADS=1 .venv/bin/python benchmarks/accuracy_study.py
    OPENBLAS_NUM_THREADS=1 .venv/bin/python benchmarks/accuracy_study.py --horizon 30

Chapter 4's loop, designed anew for every dead time. Each entry is the largest error of y over the run, relative to the
largest |y|, and the number of events; ! stands where the engine's number of events is another, "refused" where it
raises. The last columns, for the worst of the three loops: u, the plant's output before its dead time, the times of
the events in seconds, how much the oracle itself moves with more nodes, shorter intervals and more generations
(--check, some three times as long), and how many times as large as a relative change of the limits (1e-9) the change of
y is: no program that rounds can be closer than that times 1e-16.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path

import numpy as np
from tqdm import tqdm

from data.thesis import model_named
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.references import Reference, SampledReference, sinusoid
from identification.base.errors import InputError

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "unit"))
from collocation import collocated_run

KINDS = ("none", "thesis", "corrected")
LIMITS = (8.0, 9.0, 10.6, 12.0, 13.0, 15.0, 20.0, 25.0, 30.0, 40.0)
DELAYS_S = (0.0, 1e-3, 2e-3, 5e-3, 8.1e-3, 20e-3, 50e-3)
USUAL_LIMIT, USUAL_DELAY_S = 12.0, 8.1e-3
CHANGE = 1e-9


@dataclass(frozen=True)
class Entry:
    """One loop: the engine's errors, relative but for the events' times, the oracle's own change, the sensitivity."""

    y: float
    u: float
    p: float
    events_s: float
    oracle: float
    sensitivity: float
    events: int
    difference: int


@lru_cache
def design_at(delay_s: float) -> Design:
    model = model_named("implied")
    plant = dataclasses.replace(model.plant, delay_s=delay_s)
    return design_extended(dataclasses.replace(model, plant=plant), [1.5], 4.0, [(2.0, 1.0)])


def references(horizon_s: float) -> dict[str, Reference | SampledReference]:
    """The same for every horizon but for the knots of the sampled one, a dozen a second."""
    rng = np.random.default_rng(1)
    knots = np.cumsum(rng.uniform(0.02, 0.15, int(12 * horizon_s)))
    return {
        "sinusoid": sinusoid(50.0, 1.5, np.pi / 2, 0.0),
        "sinusoid from zero": sinusoid(50.0, 1.5, 0.0, 0.0),
        "constant": sinusoid(0.0, 1.5, 0.0, 50.0),
        "ramp": Reference((0.0,), (1.5,), (0.0,), 20.0, slope=60.0),
        "sampled": SampledReference(knots, rng.uniform(-50.0, 50.0, len(knots))),
    }


def relative(values: np.ndarray, exact: np.ndarray) -> float:
    return float(np.abs(values - exact).max() / np.abs(exact).max())


def entry(kind: str, limit: float, delay_s: float, name: str, horizon_s: float, check: bool) -> Entry | str:
    """Simulate one loop with both; the engine's words where it refuses."""
    design = design_at(delay_s)
    reference = references(horizon_s)[name]
    loop = design_loop(design, reference, None if kind == "none" else design.compensator(kind))
    loop = dataclasses.replace(loop, outputs={**loop.outputs, "p": (loop.Z[0], np.zeros(3))})
    time_s = np.linspace(0, horizon_s, round(200 * horizon_s) + 1)
    limits = (-limit, limit)
    control, outputs, events_s, _ = collocated_run(loop, limits, time_s)
    try:
        run = simulate(loop, limits, time_s)
        other = simulate(loop, (-limit * (1 + CHANGE), limit * (1 + CHANGE)), time_s)
    except InputError as error:
        return str(error)
    moved = np.nan
    if check:
        finer = collocated_run(loop, limits, time_s, nodes=32, reach=1.5, generations=20)[1]
        moved = relative(outputs["output"], finer["output"])
    same = len(events_s) == len(run.events_s)
    return Entry(
        y=relative(run.outputs["output"], outputs["output"]),
        u=relative(run.control, control),
        p=relative(run.outputs["p"], outputs["p"]),
        events_s=float(np.abs(run.events_s - events_s).max(initial=0)) if same else np.nan,
        oracle=moved,
        sensitivity=relative(other.outputs["output"], run.outputs["output"]) / CHANGE,
        events=len(events_s),
        difference=len(run.events_s) - len(events_s),
    )


def row_of(label: str, entries: list[Entry | str]) -> str:
    cells = [
        f"{'refused':>17}" if isinstance(e, str) else f"{e.y:>10.1e}{e.events:>6}{'!' if e.difference else ' '}"
        for e in entries
    ]
    known = [e for e in entries if not isinstance(e, str)]
    keys = ("u", "p", "events_s", "oracle", "sensitivity")
    worst = [max((getattr(e, key) for e in known), default=np.nan) for key in keys]
    return f"{label:<20}{''.join(cells)}{''.join(f'{number:>9.1e}' for number in worst)}"


def table(title: str, rows: dict[str, tuple[float, float, str]], run: Callable[..., Entry | str]) -> None:
    """Print a table with a row for each (limit, dead time, reference) and a column for each anti-windup."""
    names = ("u", "p", "events", "oracle", "dy/dlim")
    heading = "".join(f"{kind:>17}" for kind in KINDS) + "".join(f"{name:>9}" for name in names)
    print(f"{title:<20}{heading}", flush=True)
    work = list(product(rows.items(), KINDS))
    entries: list[Entry | str] = []
    for (label, row), kind in tqdm(work, disable=None, leave=False):
        entries.append(run(kind, *row))
        if len(entries) == len(KINDS):
            tqdm.write(row_of(label, entries))
            entries = []
    print(flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description="The engine's error against collocation.")
    parser.add_argument("--horizon", type=float, default=6.0, help="of every run, in seconds")
    parser.add_argument("--check", action="store_true", help="run a finer oracle as well")
    parser.add_argument("--table", choices=["limits", "delays", "references"], action="append")
    arguments = parser.parse_args()

    def run(kind: str, limit: float, delay_s: float, name: str) -> Entry | str:
        return entry(kind, limit, delay_s, name, arguments.horizon, arguments.check)

    rows = {
        "limits": {f"{limit:g}": (limit, USUAL_DELAY_S, "sinusoid") for limit in LIMITS},
        "delays": {f"{1000 * delay_s:g} ms": (USUAL_LIMIT, delay_s, "sinusoid") for delay_s in DELAYS_S},
        "references": {name: (USUAL_LIMIT, USUAL_DELAY_S, name) for name in references(1.0)},
    }
    for name in arguments.table or rows:
        table(name, rows[name], run)


if __name__ == "__main__":
    main()
