"""A loop that is compiled once and runs with many limits and from many initial states."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from experiments.engine.compiled_loop import CompiledLoop, compile_loop
from experiments.engine.saturated_loop import SaturatedLoop, with_actuator


@dataclass(frozen=True)
class ReadyLoop:
    """A loop and what :func:`experiments.engine.simulate.simulate` makes of it, whatever its limits and samples.

    Parameters
    ----------
    loop
        With a rate limit the last two states are the actuator's.
    compiled
        Its tables.
    rate
        The most that the actuator's output changes in a second; infinite without a rate limit.
    """

    loop: SaturatedLoop
    compiled: CompiledLoop
    rate: float

    def starting_from(self, x0: np.ndarray) -> ReadyLoop:
        """The same loop from another initial state (n,), without the actuator's states."""
        start = np.append(x0, np.zeros(len(self.loop.x0) - len(x0)))
        return replace(self, loop=replace(self.loop, x0=start), compiled=self.compiled._replace(x0=start))


def ready_loop(loop: SaturatedLoop, rate: float = math.inf, idle_step: float = 1.0) -> ReadyLoop:
    """Compile a loop, with an actuator that changes by ``rate`` a second at most.

    ``idle_step`` seconds are the step of a loop in which nothing else sets one, see :func:`compile_loop`.
    """
    slews = math.isfinite(rate)
    if slews:
        loop = with_actuator(loop)
    return ReadyLoop(loop, compile_loop(loop, idle_step=idle_step, slews=slews), rate)
