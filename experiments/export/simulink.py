"""A controller and its plant as a Simulink model: a script that builds it block by block, and its numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import partial

from experiments.drive.difference_equations import SampledBlock
from experiments.export.check_run import CheckRun
from experiments.export.controller import SampledController
from experiments.export.mat_file import mat_file
from experiments.export.matlab import quoted
from experiments.export.templates import templates
from identification.model.plant import PlantModel

SUM = "Math Operations/Sum"
GAIN = "Math Operations/Gain"
SATURATION = "Discontinuities/Saturation"
STATES = "Discrete/Discrete State-Space"
FILTER = "Discrete/Discrete FIR Filter"
DELAY = "Discrete/Unit Delay"
SPLIT = "Signal Routing/Demux"


@dataclass(frozen=True)
class Part:
    """A block of the model.

    Parameters
    ----------
    name, library
        Its name, and its path in Simulink's library.
    parameters
        Its dialogue's parameters, expressions of MATLAB over the variable ``data``.
    inputs
        What drives each of its ports, in their order: a block's name, with the port after a slash.
    """

    name: str
    library: str
    parameters: dict[str, str]
    inputs: tuple[str, ...] = ()


def files(controller: SampledController, run: CheckRun, plant: PlantModel) -> dict[str, str | bytes]:
    """The files by their names: NAME_simulink.m, NAME.mat and NAME_test.csv; ``plant`` is the design's."""
    own = templates(quoted=quoted, value=partial(_value, f"{controller.name}_data"), port=_port)
    script = own.get_template("simulink.m.j2").render(c=controller, parts=parts(controller))
    return {
        f"{controller.name}_simulink.m": script,
        f"{controller.name}.mat": mat_file(controller, run, plant),
        f"{controller.name}_test.csv": run.csv(),
    }


def parts(controller: SampledController) -> list[Part]:
    """The blocks of the model.

    Notes
    -----
    Of every block of the controller what its states give is read before its input is known, so that no block of the
    model passes an input on within an algebraic loop: the direct parts are gains beside it, and the loop that they
    make is solved as in :class:`experiments.export.controller.SampledController`.
    """
    rest, own = "1/(1 - data.around)", "(data.windup.d(1) + data.through)"
    found = [
        Part("reference", "Sources/From Workspace", {"VariableName": "data.reference", "SampleTime": "1/data.rate_hz"})
    ]
    windup = _outputs("windup", controller.theta, "u_tilde", [2])
    states = _outputs("forward", controller.forward, "e", [])
    feedback = _outputs("feedback", controller.feedback, "v", list(range(1, len(controller.feedback.d) + 1)))
    plant = _outputs("plant", None, "command", [1])
    found += [*windup.parts, *states.parts, *feedback.parts, *plant.parts]
    measured = plant.memories[0]
    found.append(Part("e_0", SUM, {"Inputs": "+--"}, ("reference", measured, windup.memories[0])))
    found.append(Part("e_0 at once", GAIN, {"Gain": "data.forward.d(1)"}, ("e_0",)))
    terms = (states.values[0], "e_0 at once", *feedback.memories)
    found += [
        Part("v sum", SUM, {"Inputs": "+" * len(terms)}, terms),
        Part("v_0", GAIN, {"Gain": rest}, ("v sum",)),
        Part("u_0", SUM, {"Inputs": "+-"}, ("v_0", windup.values[0])),
        Part("u_0 within", SATURATION, {"LowerLimit": "data.limits(1)", "UpperLimit": "data.limits(2)"}, ("u_0",)),
        Part("u_0 beyond", SUM, {"Inputs": "+-"}, ("u_0", "u_0 within")),
        Part("u_tilde", GAIN, {"Gain": f"1/(1 + {own})"}, ("u_0 beyond",)),
        Part("v at once", GAIN, {"Gain": "data.through"}, ("u_tilde",)),
        Part("v", SUM, {"Inputs": "+-"}, ("v_0", "v at once")),
        Part("e without", GAIN, {"Gain": "data.direct"}, ("u_tilde",)),
        Part("e", SUM, {"Inputs": "+-"}, ("e_0", "e without")),
        Part("u at once", GAIN, {"Gain": own}, ("u_tilde",)),
        Part("u", SUM, {"Inputs": "+-"}, ("u_0", "u at once")),
        Part("command", SATURATION, {"LowerLimit": "data.limits(1)", "UpperLimit": "data.limits(2)"}, ("u",)),
    ]
    for name, source in (("output", measured), ("unsaturated command", "u"), ("limited command", "command")):
        variable = {"VariableName": name.replace(" ", "_"), "SaveFormat": "Array"}
        found.append(Part(f"{name} to workspace", "Sinks/To Workspace", variable, (source,)))
    return found


def _value(variable: str, expression: str) -> str:
    """A parameter in quotes, ``data`` by its name in the workspace."""
    return quoted(re.sub(r"\bdata\.", f"{variable}.", expression))


def _port(source: str) -> str:
    """A source with its port."""
    return source if "/" in source else f"{source}/1"


@dataclass(frozen=True)
class _Outputs:
    """The parts of one of the controller's blocks, and where to find what its states and its memories give."""

    parts: list[Part]
    values: list[str]
    memories: list[str]


def _outputs(name: str, block: SampledBlock | None, given: str, remembered: list[int]) -> _Outputs:
    """A block whose input is the signal ``given``; the plant where there is none. ``remembered`` are counted from 1."""
    data = f"data.{name}" if block else "data.plant.sampled"
    count = len(block.d) if block else 1
    zero = {"Value": "0"}
    found, values = [], []
    if block is None or len(block.b):
        matrices = {"A": f"{data}.A", "B": f"{data}.b", "C": f"{data}.C", "D": f"zeros({count}, 1)"}
        found.append(Part(f"{name} states", STATES, matrices | {"SampleTime": "1/data.rate_hz"}, (given,)))
        values = [f"{name} states"]
        if count > 1:
            found.append(Part(f"{name} outputs", SPLIT, {"Outputs": str(count)}, (f"{name} states",)))
            values = [f"{name} outputs/{o + 1}" for o in range(count)]
    else:
        found.append(Part(f"{name} states", "Sources/Constant", zero))
        values = [f"{name} states"] * count
    memories = []
    for o in remembered:
        own = f"{name} {o}"
        lags = f"{data}.lags({o}, :)"
        earlier = f"{data}.d({o})*[{data}.lags({o}, 2:end), 0]"  # a part of the input that is late by one sample
        found += [
            Part(f"{own} of states", FILTER, {"Coefficients": lags}, (values[o - 1],)),
            Part(f"{own} input", DELAY, {}, (given,)),
            Part(f"{own} of inputs", FILTER, {"Coefficients": earlier}, (f"{own} input",)),
            Part(f"{own} memory", SUM, {"Inputs": "++"}, (f"{own} of states", f"{own} of inputs")),
        ]
        memories.append(f"{own} memory")
    return _Outputs(found, values, memories)
