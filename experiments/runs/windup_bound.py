"""How much windup a run still has: bounded before it from the linear loop's control, and after it from its own signals.

With M = 1 + theta1~ and v, the control of the loop without saturation, u~ = u - sat(u) obeys M u~ = v - sat(u). Let
V = x'P x be the storage function of a positive real M, dV/dt <= 2 u~ (v - sat(u)), see
:mod:`design.anti_windup.kyp_certificate`. Where v keeps a distance of delta from both limits u~ (sat(u) - v) is at
least delta |u~|, whatever u is. So from any time t0 on, as long as v keeps it,

    the integral of |u~| <= V(t0)/(2 delta).                                                              (after a run)

Let m be how far v is beyond the limits, and c^2 = C P^-1 C'. Then |u~| <= m + |C x| <= m + c V^(1/2) and
dV/dt <= 2 m |u~|, from which, by the inequality of Ou-Iang,

    V(t0)^(1/2) <= (V(0) + 2 integral of m^2)^(1/2) + c integral of m,   integrals from 0 to t0.          (before a run)

For a plant P + Delta within W_a M becomes (1 - C S_Delta Delta) M, and v the control of that plant's own linear loop.
Where M is positive real with the margin of :class:`design.anti_windup.condition.PositiveReal` so is this; no storage
function is known, but from rest

    delta integral of |u~| from t0 on <= integral of u~ (v - sat(u)) from 0 to t0.                         (any plant)

What has to be known: v at all times, and u up to t0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from design.anti_windup.kyp_certificate import Storage
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import simulate
from experiments.runs.guarantee import Guarantee
from identification.base.arrays import Real

EARLY = 2.0  # times the least bound is given up for an earlier time


@dataclass(frozen=True)
class WindupBound:
    """The integral of |u - sat(u)| from a time to the end of a run is ``most`` at most.

    Parameters
    ----------
    from_s
        The time t0 from which it is counted, in seconds: the first one whose bound is no more than EARLY times the
        least one, since a later t0 has a larger distance.
    distance
        delta, which the linear loop's control keeps from both limits from then on, in the actuator's unit.
    most
        In the actuator's unit times second.
    """

    from_s: float
    distance: float
    most: float


def distances(linear: Real, steady: Real, limits: tuple[float, float]) -> tuple[Real, Real]:
    """How far v is beyond the limits, m, and what it keeps from the nearer one from each time on, delta; shape (s,).

    delta counts what v settles at, ``steady``, beside v itself, and is not positive where either still reaches a limit.
    """
    low, high = limits
    inside = np.minimum(high - linear, linear - low)
    settled = np.minimum(high - steady, steady - low).min()
    return np.maximum(-inside, 0.0), np.minimum(np.minimum.accumulate(inside[::-1])[::-1], settled)


def before_run(
    storage: Storage, time_s: Real, linear: Real, steady: Real, limits: tuple[float, float], stored: float = 0.0
) -> WindupBound | None:
    """The bound that is known before a run.

    Parameters
    ----------
    storage
        Of 1 + theta1~.
    time_s, linear, steady
        Times, v and what it settles at, shape (s,): the integrals are those of the straight lines between them.
    limits
        (sigma_1, sigma_2).
    stored
        V at the first time; 0 from rest.

    Returns
    -------
    WindupBound or None
        None where v or what it settles at reaches a limit at the last time.
    """
    beyond, distance = distances(linear, steady, limits)
    squares, total = (cumulative_trapezoid(each, time_s, initial=0) for each in (beyond**2, beyond))
    return _least(time_s, distance, (np.sqrt(stored + 2 * squares) + storage.steepness * total) ** 2 / 2)


def after_run_of_any_plant(
    time_s: Real, linear: Real, steady: Real, control: Real, limits: tuple[float, float]
) -> WindupBound | None:
    """The bound from the control u that a run from rest had with a plant within W_a, v being its own; None as above."""
    saturated = np.clip(control, *limits)
    supplied = cumulative_trapezoid((control - saturated) * (linear - saturated), time_s, initial=0)
    return _least(time_s, distances(linear, steady, limits)[1], np.maximum(supplied, 0.0))


def _least(time_s: Real, distance: Real, left: Real) -> WindupBound | None:
    """The first of the times at which left/distance is no more than EARLY times its least value."""
    if not distance[-1] > 0:
        return None
    bound = np.where(distance > 0, left / np.where(distance > 0, distance, 1.0), np.inf)
    at = int(np.argmax(bound <= EARLY * bound.min()))
    return WindupBound(float(time_s[at]), float(distance[at]), float(bound[at]))


@dataclass(frozen=True)
class Windup:
    """What is guaranteed of the windup of a run whose control may be any, and what the run had.

    Parameters
    ----------
    bound
        Of :func:`before_run`, or with another plant than the design's of :func:`after_run_of_any_plant`.
    stored
        V(t0)/(2 delta) with the state that the run had at the bound's t0; None with another plant, and without a bound.
    was
        The integral of |u - sat(u)| from t0 on; of all of the run without a bound.
    """

    bound: WindupBound | None
    stored: float | None
    was: float

    def __str__(self) -> str:
        """In words, without a full stop."""
        if self.bound is None:
            return "the windup ends once the linear loop's control stays within the limits, which is after this run"
        known = (
            "" if self.stored is None else f" (known before the run) and at most {self.stored:.3g} (by the state then)"
        )
        t0, delta, most = (f"{each:.3g}" for each in (self.bound.from_s, self.bound.distance, self.bound.most))
        return (
            f"from t = {t0} s on the linear loop's control stays {delta} within the limits, and the integral of "
            f"|u - sat(u)| is at most {most}{known}; in this run it was {self.was:.3g}"
        )


def windup_of_run(
    given: Guarantee, loop: SaturatedLoop, limits: tuple[float, float], time_s: Real, steady: Real
) -> Windup:
    """What a guarantee whatever the control says of a run.

    Parameters
    ----------
    given
        Of the run's design, anti-windup and plant, with the sector 1.
    loop, limits
        What was simulated.
    time_s, steady
        Times and what v settles at, shape (s,), close enough for straight lines between the signals, the first time 0.
    """
    storage, stored = given.storage, None
    if storage is None:
        control = simulate(replace(loop, outputs={}), limits, time_s).control
        linear = simulate(replace(loop, outputs={}), (-np.inf, np.inf), time_s).control
        bound = after_run_of_any_plant(time_s, linear, steady, control, limits)
    else:
        run = simulate(with_states(loop, storage), limits, time_s)
        control, linear = run.control, run.outputs["v"]
        bound = before_run(storage, time_s, linear, steady, limits)
        if bound is not None:
            at = np.searchsorted(time_s, [bound.from_s])
            states = np.stack([run.outputs[f"x{k}"][at] for k in range(len(storage.b))], axis=-1)
            stored = float(storage.value(states)[0]) / (2 * bound.distance)
    late = time_s >= (0.0 if bound is None else bound.from_s)
    beyond = np.abs(control - np.clip(control, *limits))
    return Windup(bound, stored, float(np.trapezoid(beyond[late], time_s[late])))


def with_states(loop: SaturatedLoop, storage: Storage) -> SaturatedLoop:
    """The loop with the states of a storage function, driven by u - sat(u), as its outputs x0, x1, ... beside v."""
    n, more = len(loop.x0), len(storage.b)
    A = np.zeros((n + more, n + more))
    A[:n, :n], A[n:, :n], A[n:, n:] = loop.A, np.outer(storage.b, loop.C), storage.A
    none, rows = np.zeros(len(loop.E)), np.eye(n + more)[n:]
    v_x, v_w = loop.outputs["v"]
    return replace(
        loop,
        A=A,
        B=np.append(loop.B, -storage.b),
        C=np.append(loop.C, np.zeros(more)),
        D=np.vstack([loop.D, np.outer(storage.b, loop.E)]),
        Z=np.hstack([loop.Z, np.zeros((len(loop.Z), more))]),
        x0=np.append(loop.x0, np.zeros(more)),
        B_limits=None if loop.B_limits is None else np.append(loop.B_limits, -storage.b),
        outputs={"v": (np.append(v_x, np.zeros(more)), v_w)} | {f"x{k}": (row, none) for k, row in enumerate(rows)},
    )
