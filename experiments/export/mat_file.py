"""The numbers of a controller, its plant and its test run as a MAT file, which MATLAB and Octave load."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np

from design.blocks.block import plant_block
from experiments.drive.difference_equations import SampledBlock
from experiments.drive.held_plant import sampled_plant
from experiments.export.check_run import CheckRun
from experiments.export.controller import SampledController
from identification.model.plant import PlantModel

HEADER = b"MATLAB 5.0 MAT-file, difference equations of a sampled controller"
DATED = 116  # bytes of text, in which scipy writes the time


def mat_file(controller: SampledController, run: CheckRun, plant: PlantModel) -> bytes:
    """The content of NAME.mat, whose variables docs/how_to/export.md explains; columns are column vectors."""
    from scipy.io import savemat

    P = plant_block(plant)
    content = {
        "rate_hz": controller.rate_hz,
        "limits": np.array(controller.limits),
        "around": controller.around,
        "direct": controller.direct,
        "through": controller.through,
        "forward": _block(controller.forward),
        "feedback": _block(controller.feedback),
        "windup": _block(controller.theta),
        "plant": {
            "zeros": _column(P.zeros),
            "poles": _column(P.poles),
            "gain": P.gain,
            "delay_s": P.delay_s,
            "sampled": _block(sampled_plant(plant, 1 / controller.rate_hz)),
        },
        "test": {
            "reference": _column(run.reference),
            "measurement": _column(run.measurement),
            "unsaturated_command": _column(run.control),
            "command": _column(run.command),
        },
    }
    written = BytesIO()
    file: Any = written  # scipy takes files, which its types do not say
    savemat(file, content, oned_as="row")
    return HEADER.ljust(DATED) + written.getvalue()[DATED:]


def _block(block: SampledBlock) -> dict[str, Any]:
    """A, b, C, d, and of each output a row ``lags``: the weight of its value at this sample, the last one, ..."""
    lags = np.zeros((len(block.d), int((block.first + block.length).max())))
    for row, taps, first, length in zip(lags, block.taps, block.first, block.length, strict=True):
        row[first : first + length] = taps[:length]
    return {"A": block.A, "b": _column(block.b), "C": block.C, "d": _column(block.d), "lags": lags}


def _column(values: Any) -> np.ndarray:
    return np.asarray(values).reshape(-1, 1)
