"""A block diagram of Simulink's blocks, simulated sample by sample by what each block is documented to do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

INPUTS = {"From Workspace": 0, "Constant": 0}  # others have one, and a sum one for each of its signs


class Diagram:
    """The blocks by their names, each (kind, parameters), and the source (name, port) of each port of each block."""

    def __init__(
        self, blocks: Mapping[str, tuple[str, dict[str, Any]]], sources: Mapping[str, Mapping[int, tuple[str, int]]]
    ) -> None:
        self.blocks, self.sources = blocks, sources
        self.held: dict[str, Any] = {}
        for name, (kind, own) in blocks.items():
            wanted = len(own["Inputs"]) if kind == "Sum" else INPUTS.get(kind, 1)
            assert sorted(sources[name]) == list(range(1, wanted + 1)), name
            if kind == "Discrete State-Space":
                assert not np.any(own["D"])
                self.held[name] = np.zeros(np.size(own["B"]))
            elif kind in ("Discrete FIR Filter", "Unit Delay"):
                self.held[name] = np.zeros(np.size(own.get("Coefficients", 0.0)))

    def run(self, given: np.ndarray) -> dict[str, np.ndarray]:
        """What every To Workspace block is given, by its variable, for samples of the one From Workspace block."""
        sinks = {str(own["VariableName"]): name for name, (kind, own) in self.blocks.items() if kind == "To Workspace"}
        rows = []
        for number in given:
            self.values: dict[str, Any] = {}
            self.open: set[str] = set()
            self.given = number
            rows.append([self.into(name, 1) for name in sinks.values()])
            inputs = {name: self.into(name, 1) for name in self.held}
            for name, value in inputs.items():
                self.held[name] = self.following(name, value)
        return dict(zip(sinks, np.array(rows).T, strict=True))

    def into(self, name: str, port: int) -> float:
        """What enters a block."""
        source, out = self.sources[name][port]
        if source not in self.values:
            assert source not in self.open, f"{source} is in an algebraic loop"
            self.open.add(source)
            self.values[source] = np.atleast_1d(self.output(source))
        return float(self.values[source][out - 1])

    def output(self, name: str) -> Any:
        kind, own = self.blocks[name]
        if kind == "From Workspace":
            return self.given
        if kind == "Constant":
            return own["Value"]
        if kind == "Sum":
            return sum(self.into(name, j + 1) * {"+": 1, "-": -1}[sign] for j, sign in enumerate(own["Inputs"]))
        if kind == "Gain":
            return own["Gain"] * self.into(name, 1)
        if kind == "Saturation":
            return min(max(self.into(name, 1), own["LowerLimit"]), own["UpperLimit"])
        if kind == "Discrete State-Space":
            return np.reshape(own["C"], (-1, len(self.held[name]))) @ self.held[name]
        if kind == "Demux":
            self.into(name, 1)
            return self.values[self.sources[name][1][0]]
        if kind == "Unit Delay":
            return self.held[name]
        assert kind == "Discrete FIR Filter", kind
        return np.atleast_1d(own["Coefficients"]) @ self.following(name, self.into(name, 1))

    def following(self, name: str, given: float) -> np.ndarray:
        kind, own = self.blocks[name]
        held = self.held[name]
        if kind == "Discrete State-Space":
            return np.reshape(own["A"], (len(held), -1)) @ held + np.atleast_1d(own["B"]) * given
        return np.append(given, held[:-1])
