"""A controller and its plant for python-control: one file of Python that needs numpy and control alone."""

from __future__ import annotations

from pprint import pformat
from typing import Any

from design.blocks.block import plant_block
from experiments.drive.held_plant import sampled_plant
from experiments.export.check_run import CheckRun
from experiments.export.controller import SampledController
from experiments.export.templates import templates
from identification.model.plant import PlantModel


def files(controller: SampledController, run: CheckRun, plant: PlantModel) -> dict[str, str]:
    """The files by their names: NAME.py and NAME_test.csv; ``plant`` is the design's."""
    P = plant_block(plant)
    content = {
        "c": controller,
        "blocks": {
            "FORWARD": controller.forward,
            "FEEDBACK": controller.feedback,
            "WINDUP": controller.theta,
            "PLANT": sampled_plant(plant, 1 / controller.rate_hz),
        },
        "plant": {"zeros": list(P.zeros), "poles": list(P.poles), "gain": P.gain, "delay_s": P.delay_s},
    }
    text = templates(literal=_literal, text=repr).get_template("python.py.j2").render(content)
    return {f"{controller.name}.py": text, f"{controller.name}_test.csv": run.csv()}


def _literal(value: Any) -> str:
    """A number, or an array as nested lists, as Python reads it."""
    listed = value.tolist() if hasattr(value, "tolist") else value
    text = pformat(listed, width=116, compact=True)
    return text.replace("inf", 'float("inf")') if isinstance(listed, float) else text
