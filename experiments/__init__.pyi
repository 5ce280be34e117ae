from experiments.drive.sampled_loop import Drive, SampledRun, simulate_sampled
from experiments.engine.simulate import Run
from experiments.runs.batch import simulate_many
from experiments.runs.disturbances import Disturbances, noise, steps
from experiments.runs.guarantee import guarantee
from experiments.runs.references import Reference, SampledReference, sinusoid
from experiments.runs.simulate_design import simulate_design as simulate

__all__ = [
    "Disturbances",
    "Drive",
    "Reference",
    "Run",
    "SampledReference",
    "SampledRun",
    "guarantee",
    "noise",
    "simulate",
    "simulate_many",
    "simulate_sampled",
    "sinusoid",
    "steps",
]
