"""A controller and its plant for MATLAB and Octave: a MAT file, and a function that builds them and runs the loop."""

from __future__ import annotations

from experiments.export.check_run import CheckRun
from experiments.export.controller import SampledController
from experiments.export.mat_file import mat_file
from experiments.export.templates import templates
from identification.model.plant import PlantModel


def files(controller: SampledController, run: CheckRun, plant: PlantModel) -> dict[str, str | bytes]:
    """The files by their names: NAME_loop.m, NAME.mat and NAME_test.csv; ``plant`` is the design's."""
    return {
        f"{controller.name}_loop.m": templates(quoted=quoted).get_template("loop.m.j2").render(c=controller),
        f"{controller.name}.mat": mat_file(controller, run, plant),
        f"{controller.name}_test.csv": run.csv(),
    }


def quoted(text: str) -> str:
    """A text in quotes, as MATLAB reads it."""
    return "'" + text.replace("'", "''") + "'"
