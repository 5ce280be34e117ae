"""When the control of a run is beyond the limits."""

from __future__ import annotations

import numpy as np

from experiments.drive.sampled_loop import SampledRun
from experiments.engine.simulate import Run
from identification.base.arrays import Real


def saturated_stretches(run: Run | SampledRun, limits: tuple[float, float]) -> Real:
    """The stretches of a run in which its control is beyond the limits.

    Parameters
    ----------
    run
        Of continuous time, whose crossings of the limits are located to rounding, or of a computer, which holds what
        it asks for from one sample to the next.
    limits
        (lower, upper) of the run, either may be infinite.

    Returns
    -------
    ndarray, shape (n, 2)
        Beginnings and ends in seconds, from the run's first time to its last.
    """
    first, last = float(run.time_s[0]), float(run.time_s[-1])
    with np.errstate(invalid="ignore"):
        beyond = (run.control < limits[0]) | (run.control > limits[1])
    if isinstance(run, Run) and len(run.events_s):
        # of the modes of a rate limit, 3 more and 3 less, what is left is the place between the limits
        entered = (run.modes + 1) % 3 != 1
        later = run.events_s > first
        before = np.flatnonzero(~later)
        start = entered[before[-1]] if before.size else beyond[0]
        edges, inside = np.append(first, run.events_s[later]), np.append(start, entered[later])
    else:
        edges, inside = run.time_s, beyond
    turns = np.flatnonzero(np.diff(inside.astype(int), prepend=0, append=0))
    stretches = np.append(edges, last)[turns].reshape(-1, 2)
    return np.asarray(stretches[stretches[:, 1] > stretches[:, 0]])
