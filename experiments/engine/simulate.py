"""The saturated loop with its exact dead time: one engine for every experiment."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from experiments.engine import endings
from experiments.engine.compiled_loop import FURTHEST, CompiledLoop, compile_loop
from experiments.engine.integrator import integrate
from experiments.engine.ready_loop import ReadyLoop, ready_loop
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.watched import Stopped, Tick, watched
from identification.base.errors import InputError, shown

if TYPE_CHECKING:
    from control import TimeResponseData

MOST_STEPS = 2e7  # a few minutes
MOST_ROOM = 1e8  # numbers, a gigabyte
TAIL = 1e-11  # of a polynomial's terms, see integrate


@dataclass(frozen=True, repr=False)
class Run:
    """A simulated run at the sample times.

    Parameters
    ----------
    time_s
        Shape (s,).
    control, saturated_control
        u and the actuator's output m, which without a rate limit is sat(u), shape (s,).
    outputs
        Name -> samples (s,).
    events_s, modes
        Every time at which u crosses a limit, located to rounding, and the mode entered: 1 at the upper limit,
        -1 at the lower one, 0 unsaturated. A jump of u across both limits is two events at one time. With a rate limit
        also every time at which the actuator falls behind and catches up; while it rises the mode is 3 more, while it
        falls 3 less.
    """

    time_s: np.ndarray
    control: np.ndarray
    saturated_control: np.ndarray
    outputs: Mapping[str, np.ndarray]
    events_s: np.ndarray
    modes: np.ndarray

    def __repr__(self) -> str:
        names, end = ", ".join(self.outputs), self.time_s[-1]
        return f"Run({self.time_s.size} samples up to {end:.6g} s, {self.events_s.size} crossings, outputs {names})"

    def to_control(self) -> TimeResponseData:
        """The run as python-control's time response: the outputs by their names, and the input sat(u)."""
        from control import TimeResponseData

        return TimeResponseData(
            self.time_s,
            np.array(list(self.outputs.values())),
            inputs=self.saturated_control,
            output_labels=list(self.outputs),
            input_labels=["saturated_control"],
            issiso=False,
        )


def limit_pair(limits: float | Sequence[float]) -> tuple[float, float]:
    """The lower and the upper limit, of one number +- that.

    Raises
    ------
    InputError
        There are not one or two, one is not positive, or of two the first is not below the second.
    """
    pair = np.atleast_1d(np.asarray(limits, dtype=float))
    if pair.shape not in ((1,), (2,)):
        raise InputError(f"the limits are {shown(limits)}; expected one number, or a lower and an upper one")
    if pair.size == 1 and not pair[0] > 0:
        raise InputError(
            f"the saturation limit is {pair[0]:g}; expected a positive number, or a lower and an upper one"
        )
    low, high = (-float(pair[0]), float(pair[0])) if pair.size == 1 else (float(pair[0]), float(pair[1]))
    if not low < high:
        raise InputError(f"the saturation limits are {low:.12g} and {high:.12g}; expected the lower one first")
    return low, high


class DivergenceError(InputError):
    """The control passed 1e100 times the limits, or without limits a state 1e100, at ``time_s`` seconds."""

    def __init__(self, time_s: float) -> None:
        super().__init__(
            f"the loop diverges: the control passed 1e100 times the limits, or without limits a signal 1e100, at t = "
            f"{time_s:.6g} s"
        )
        self.time_s = time_s


def simulate(
    loop: SaturatedLoop | ReadyLoop,
    limits: tuple[float, float],
    time_s: np.ndarray,
    tick: Tick | None = None,
    rate: float = math.inf,
) -> Run:
    """Simulate a loop from t = 0; what is left out, u - sat(u), is the dead zone of Thesis Eq. (2.16).

    Parameters
    ----------
    loop
        See :class:`SaturatedLoop`; or what :func:`experiments.engine.ready_loop.ready_loop` makes of it, with its rate,
        which spares runs with other limits or from other states the preparation.
    limits
        (sigma_1, sigma_2) of the saturation, sigma_1 < sigma_2, either may be infinite.
    time_s
        Increasing sample times (s,), the first at 0 or later; they do not influence the integration.
    tick
        Called some times a second with the seconds of the run done since the last call.
    rate
        The most that the actuator's output m changes in a second, from 0 (or the limit next to it) at t = 0: m is
        sat(u) as long as it can follow, and moves toward it at the rate when it cannot.

    Raises
    ------
    InputError
        The limits are not in order, the rate is not positive, the times not increasing, the run too long for
        its fastest time constant, or the control chatters past all bounds.
    DivergenceError
        The loop diverges.

    Notes
    -----
    Dead times are exact and events are located on the polynomials, see :mod:`experiments.engine.integrator`. The step,
    see :func:`experiments.engine.compiled_loop.compile_loop`, is halved until the last term of every polynomial is
    below 1e-11 of the largest value of its signal. Ctrl-C stops a run between two steps.
    """
    return watched(partial(simulate_watched, loop, limits, time_s, rate=rate), tick)


def simulate_watched(
    loop: SaturatedLoop | ReadyLoop,
    limits: tuple[float, float],
    time_s: np.ndarray,
    watch: np.ndarray,
    rate: float = math.inf,
) -> Run:
    """:func:`simulate` in the calling thread, under a watch of :mod:`experiments.engine.watched`.

    Raises
    ------
    InputError, DivergenceError
        As of :func:`simulate`.
    Stopped
        The watch says so.
    """
    low, high = limit_pair(limits)
    if not rate > 0:
        raise InputError(f"the rate limit is {rate:g} a second; expected a positive number, inf for none")
    increasing = len(time_s) > 0 and time_s[0] >= 0 and time_s[-1] > 0 and np.all(np.diff(time_s) > 0)
    if not (increasing and np.all(np.isfinite(time_s))):
        raise InputError("the sample times are not increasing finite numbers from zero on that end after zero")
    horizon = float(time_s[-1])
    ready = loop if isinstance(loop, ReadyLoop) else ready_loop(loop, rate, idle_step=horizon)
    own, compiled, rate = ready.loop, ready.compiled, ready.rate
    slews = math.isfinite(rate)
    x0 = np.append(own.x0[:-1], np.clip(0.0, low, high)) if slews else own.x0
    most_events, room = 4096, _room(compiled)
    while True:
        _require_affordable(compiled, room, horizon)
        values, events, modes, places, status, end, _, tail = integrate(
            compiled._replace(x0=x0),
            own.resets.times_s,
            own.resets.values,
            float(low),
            float(high),
            float(rate),
            time_s - compiled.lags[:, None],
            horizon,
            endings.Bounds(int(MOST_STEPS), most_events, room),
            watch,
        )
        if status == endings.CROWDED:
            room *= 2
        elif status == endings.EVENTFUL:
            most_events *= 8
        elif status == endings.COMPLETE and tail > TAIL:
            compiled = compile_loop(own, compiled.step / 2, slews=slews)
            room = max(room, _room(compiled))
        else:
            break
    if status == endings.STOPPED:
        raise Stopped
    if status == endings.DIVERGED:
        raise DivergenceError(end)
    if status != endings.COMPLETE:
        raise InputError(f"the loop could not be integrated: {len(events)} events up to t = {end:.6g} s")
    outputs, m = compiled.reading @ values[1:], values[0]
    if slews and len(events):
        last = np.searchsorted(events, time_s, side="right") - 1
        moved = places[last] + np.sign(modes[last]) * rate * (time_s - events[last])
        m = np.where((last >= 0) & (np.abs(modes[last]) > 1), moved, m)
    return Run(
        time_s=time_s,
        control=values[0],
        saturated_control=np.clip(m, low, high),
        outputs=dict(zip(own.outputs, outputs, strict=True)),
        events_s=events,
        modes=modes,
    )


def _require_affordable(compiled: CompiledLoop, room: int, horizon: float) -> None:
    step = compiled.step
    shortest = float(compiled.delays[~np.isin(compiled.delays, compiled.brief)].min(initial=math.inf))
    asked = (
        f"the shortest dead time, {shortest:.3g} s, needs"
        if step > shortest / 2
        else (f"a root of the loop near {FURTHEST / step:.3g} rad/s needs")
    )
    if room * compiled.tables.increments.shape[2] > MOST_ROOM:
        raise InputError(
            f"{asked} steps of {step:.3g} s, too many to store for the longest dead time, "
            f"{compiled.delays.max():.3g} s; expected dead times that differ less, or a slower design"
        )
    if horizon / step > MOST_STEPS:
        raise InputError(
            f"{asked} {horizon / step:.3g} steps of {step:.3g} s; expected at most {MOST_STEPS:.3g} (a shorter run, a "
            "dead time of zero, or a slower design)"
        )


def _room(compiled: CompiledLoop) -> int:
    """Room for the steps that the longest dead time remembers, twice as many, and a power of two."""
    longest = float(compiled.delays.max(initial=0.0))
    return 1 << math.ceil(math.log2(64 + 2 * longest / compiled.step))
