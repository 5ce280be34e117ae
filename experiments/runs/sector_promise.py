"""The sector that a run under a reference needs, and whether the circle criterion guarantees it.

The control obeys u = v - theta1~ u_tilde, u_tilde = u - sat(u), where v is the control of the loop without saturation.
It settles at v_s, whose output is the reference. The deviation d = u - v_s obeys

    d = (v - v_s) - theta1~ u_tilde,

and u_tilde is a function of d that varies with time. While |v_s| < L that function is 0 at d = 0, and its secant

    (u - sat(u))/(u - v_s), at most (U - L)/(U - V) for |u| <= U and |v_s| <= V < L,

is the sector that the run needs. Let its largest value be k, and k_c the sector of the circle criterion: Re theta1~ +
1/k_c >= 0 at all frequencies. Of every k < k_c, from u_tilde (d - u_tilde/k) >= 0 at all times and Parseval's theorem,

    the norm of u_tilde <= the norm of v - v_s, divided by 1/k - 1/k_c                        (norms: L_2 from 0 on).

So u returns to v, and with a stable theta2 the output to that of the linear loop. Nothing is promised of a run that
needs more, and nothing where v_s itself reaches a limit: it needs an infinite one. k and k_c are found, at times and
frequencies that are refined around their extremes; no bound is put on what lies between. A multiplier m > 0 in Popov's
condition is for a dead zone that does not vary with time: it promises nothing under a reference. With another true
plant v and v_s are those of its own linear loop, and theta1~ is what
:func:`design.anti_windup.popov.robust_loss` makes of it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from experiments.engine.ready_loop import ready_loop
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.engine.simulate import Run, simulate
from experiments.runs.guarantee import Guarantee
from experiments.runs.references import Reference, SampledReference
from experiments.runs.steady_control import response, steady_constant
from experiments.runs.verdict import Verdict, covers
from experiments.runs.windup_bound import windup_of_run
from identification.model.plant import PlantModel

A_EXCURSION = 64  # samples of u between two crossings of the limits, at least
A_TIME_CONSTANT = 10  # samples of u beyond the limits in the loop's shortest time constant
REFINEMENTS = 8  # of the samples around the largest u and secant, and around where the guarantee is left
A_REFINEMENT = 1025  # samples of each, in place of three: twice so refined, a peak is as near as rounding shows
A_PERIOD = 200  # samples of v_s in a period of the reference
MOST_SAMPLES = 1e6
EVENLY = 50_001  # samples of v for the bound on the windup


def steady_control(reference: Reference | SampledReference, plant: PlantModel, time_s: np.ndarray) -> np.ndarray:
    """v_s, the control whose output is the reference once the linear loop has settled.

    Parameters
    ----------
    reference
        r(t); a sampled one ends as a constant.
    plant
        The true plant.
    time_s
        Shape (s,).

    Returns
    -------
    ndarray, shape (s,)
        The sinusoids over P(j omega), and :func:`experiments.runs.steady_control.steady_constant`.
    """
    if isinstance(reference, SampledReference):
        return np.full(len(time_s), steady_constant(plant, float(reference.values[-1]), 0.0))
    steady = np.full(len(time_s), steady_constant(plant, math.fsum(reference.constants), reference.slope))
    for amplitude, omega, phase in zip(reference.amplitudes, reference.omegas, reference.phases_rad, strict=True):
        if omega > 0:
            wave = response(plant, amplitude, omega, phase)
            steady += wave.amplitude * np.sin(omega * (time_s + plant.delay_s) + wave.phase_rad)
    return steady


def needed_sector(control: np.ndarray, steady: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """The secant (u - sat(u))/(u - v_s) of the dead zone, sample by sample.

    Parameters
    ----------
    control, steady
        u and v_s, shape (s,).
    limits
        (sigma_1, sigma_2), sigma_1 < sigma_2.

    Returns
    -------
    ndarray, shape (s,)
        From 0 to 1; infinite where v_s is not within the limits, since no sector promises anything there.
    """
    low, high = limits
    beyond = control - np.clip(control, low, high)
    away = np.where(beyond == 0, 1.0, control - steady)
    inside = (low < steady) & (steady < high)
    return np.where(inside, beyond / np.where(inside, away, 1.0), np.inf)


def verdict(
    given: Guarantee, time_s: np.ndarray, control: np.ndarray, steady: np.ndarray, limits: tuple[float, float]
) -> Verdict:
    """Judge a run by its samples.

    Parameters
    ----------
    given
        See :func:`experiments.runs.guarantee.guarantee`.
    time_s, control, steady
        Times and there u and v_s, shape (s,). What lies between the samples is not seen: the needed sector and the
        largest |u| are those of the samples.
    limits
        (sigma_1, sigma_2).
    """
    low, high = limits
    never = bool(np.all((low <= control) & (control <= high)))
    needed = np.zeros(len(time_s)) if never else needed_sector(control, steady, limits)
    at, largest = int(np.argmax(needed)), int(np.argmax(np.abs(control)))
    left = np.flatnonzero(~covers(given.sector, needed))
    return Verdict(
        guarantee=given,
        farthest_control=float(control[largest]),
        farthest_control_at_s=float(time_s[largest]),
        steady=(float(steady.min()), float(steady.max())),
        limits=limits,
        needed_sector=float(needed[at]),
        needed_at_s=float(time_s[at]),
        left_at_s=float(time_s[left[0]]) if len(left) else math.nan,
    )


def judge_run(
    given: Guarantee,
    loop: SaturatedLoop,
    limits: tuple[float, float],
    run: Run,
    reference: Reference | SampledReference,
    plant: PlantModel,
) -> Verdict:
    """Judge a simulated run by u at its own times and, :func:`finely`, between them.

    Parameters
    ----------
    given
        See :func:`experiments.runs.guarantee.guarantee`.
    loop, limits
        What was simulated.
    run
        What :func:`experiments.engine.simulate.simulate` made of it, its first time 0.
    reference, plant
        r(t) and the true plant.
    """
    time_s, control = run.time_s, run.control
    found = verdict(given, time_s, control, steady_control(reference, plant, time_s), limits)
    if not len(run.events_s) and control[0] == run.saturated_control[0]:
        return found
    only_u = ready_loop(replace(loop, outputs={}))
    more = finely(loop, run, reference)
    settles = steady_control(reference, plant, more)
    if len(run.events_s) and run.modes[-1] == 0:  # from then on u needs no sector
        more = more[: np.searchsorted(more, run.events_s[-1]) + 1]
    for _ in range(REFINEMENTS):
        time_s, first = np.unique(np.append(time_s, more), return_index=True)
        control = np.append(control, simulate(only_u, limits, more).control)[first]
        before, found = found, verdict(given, time_s, control, steady_control(reference, plant, time_s), limits)
        if found.agrees(before):
            break
        at = np.searchsorted(time_s, [found.farthest_control_at_s, found.needed_at_s, found.left_at_s])
        at = at[at < len(time_s)]  # it may never be left
        around = time_s[np.clip(np.add.outer([-1, 1], at), 0, len(time_s) - 1)]
        more = np.unique(np.linspace(around[0], around[1], A_REFINEMENT))
    found = replace(found, steady=(min(found.steady[0], settles.min()), max(found.steady[1], settles.max())))
    if given.sector < 1 or math.isinf(found.needed_sector):
        return found
    end = float(run.time_s[-1])
    evenly = np.linspace(0.0, end, EVENLY)
    closely = np.unique(np.concatenate([evenly, run.events_s, finely(loop, run, reference)]))
    steady = steady_control(reference, plant, closely)
    return replace(found, windup=windup_of_run(given, loop, limits, closely, steady))


def finely(loop: SaturatedLoop, run: Run, reference: Reference | SampledReference) -> np.ndarray:
    """Times at which u shows how far it goes beyond the limits, and v_s how near it comes to them.

    Returns
    -------
    ndarray, shape (s,)
        From each crossing that leads out of the limits to the next one, and before the first one, A_EXCURSION times at
        least and A_TIME_CONSTANT in the time constant of the fastest root of the loop; and A_PERIOD in each period of
        the reference's fastest sinusoid. About MOST_SAMPLES at most of either.
    """
    end = float(run.time_s[-1])
    edges = np.concatenate([[0.0], run.events_s, [end]])
    out = np.concatenate([[True], run.modes != 0]) & (edges[1:] > edges[:-1])
    starts, ends = edges[:-1][out], edges[1:][out]
    roots = np.concatenate([np.linalg.eigvals(loop.A), np.linalg.eigvals(loop.A + np.outer(loop.B, loop.C))])
    rate = min(A_TIME_CONSTANT * float(np.abs(roots).max()), MOST_SAMPLES / end)
    counts = np.maximum(np.ceil((ends - starts) * rate).astype(int), A_EXCURSION)
    fastest = 0.0 if isinstance(reference, SampledReference) else max(reference.omegas) / (2 * math.pi)
    periods = np.linspace(0.0, end, round(min(A_PERIOD * fastest * end, MOST_SAMPLES)) + 2)
    spans = [np.linspace(*span) for span in zip(starts, ends, counts, strict=True)]
    return np.unique(np.concatenate([periods, *spans]))
