"""What weights of errors prove of every control, and what one control is proved to reach, all roundings included."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from experiments.physical_limits.exact_chain import positive_exponential
from experiments.physical_limits.response_cells import SPARE, UNIT, Cells

GRAINS = 50  # bits of the sizes' sum in which weights and controls are whole numbers: no sum of them has an error


@dataclass(frozen=True)
class Samples:
    """A reference at the cells' ends, as a share of some scale.

    Parameters
    ----------
    values
        Shape (count + 1,), or (count,) if periodic.
    doubt
        Bounds how far they are off.
    bulge
        Bounds how far the reference leaves its chord within a cell.
    """

    values: np.ndarray
    doubt: float
    bulge: float


def whole(values: np.ndarray, centred: bool) -> np.ndarray:
    """Values of a size up to 1 in whole multiples of a power of 2, which add up without error; none exceeds 1.

    If ``centred``, of values whose sum is but a rounding, the sum becomes exactly 0.
    """
    unit = 2.0 ** (math.ceil(math.log2(max(1.0, float(np.abs(values).sum())))) - GRAINS)
    grains = np.rint(values / unit)
    if centred:
        grains[np.abs(grains).argmin()] -= grains.sum()
    return np.asarray(grains * unit)


def forced(cells: Cells, mu: np.ndarray, r: Samples, gain: float, shares: tuple[float, float] = (-1.0, 1.0)) -> float:
    """A lower bound of the greatest |r - y| at the cells' ends that bear weights, for every u within its limits.

    Parameters
    ----------
    cells
        The plant.
    mu
        Any weights, of the shape of ``r.values`` and a sum of sizes near 1, from :func:`whole`: of sum 0 where an
        offset of y counts for nothing, that is where an integrator does not start from rest. Where y may jump they are
        those of its means in the cells, see :meth:`experiments.physical_limits.response_cells.Cells.costates`; no cell
        begins at the last time of a start from rest, whose weight is then 0.
    r
        The reference.
    gain
        In the unit of u over the scale of ``r``.
    shares
        The lower and the upper limit of u as shares of ``gain``, the larger size 1.

    Notes
    -----
    With the costates p of mu, h = p_{k+1} exp(A (t_{k+1} - t)) b in the cell that ends at t_{k+1}, and q_k the defects,

        |mu| max |r - y| >= sum mu_k (r - y)(t_k) >= sum mu_k r(t_k) - gain integral |h - m| dt - sum |q_k| |x_k|
                            - |p_0 x_0|

    for |u| <= gain; with unequal limits half their distance stands for gain, and gain times their middle times the
    integral of h - m is taken too. m is any number where u has the mean zero, else 0; the last term is 0 where x starts
    from rest or is periodic. Of means, h has mu_k (d + the integral of c exp(A s) b up to t_{k+1} - t) beside.
    Within a cell h differs from its chord by at most 1/8 of its largest second derivative, in the mean by two thirds
    of that. Where it therefore keeps its sign its integral is known; elsewhere its chord's is, and the rest is added.
    """
    size, p, chain = float(np.abs(mu).sum()), cells.costates(mu), cells.chain
    x = cells.reach(cells.within @ np.abs(chain.b) * SPARE)
    stray = float(cells.costate_defects(mu, p) @ x)
    if cells.start == "ever":
        stray += float(np.abs(p[0, : cells.stable]) @ x[: cells.stable])
    p, size_A, impulse, pulse = p[1:], np.abs(chain.A), chain.impulse, chain.pulse
    most_b, values, doubt = cells.within @ np.abs(chain.b), r.values, r.doubt
    if cells.jumps:
        n = len(chain.b)
        p = np.column_stack([p, mu[: len(p)]])
        impulse = np.concatenate([impulse, chain.output[:, :, n:]], axis=2)
        pulse = np.append(pulse, chain.mean[n])
        size_A = np.block([[size_A, np.zeros((n, 1))], [np.abs(chain.c), np.zeros((1, 1))]])
        most_b = np.append(most_b, abs(chain.d) + np.abs(chain.c) @ most_b)
        values, doubt = (values + np.roll(values, -1)) / 2, doubt + r.bulge + UNIT
    weight = np.abs(p)
    left, right, area = (p @ vector for vector in (impulse[0, 1], impulse[0, 0], pulse))
    powers = [np.linalg.matrix_power(size_A, power) @ most_b for power in (0, 2, 4, 8)]
    off = (len(most_b) + 8) * UNIT * (weight @ np.max(powers[:3], axis=0)) * SPARE
    second, fourth = (np.maximum(*np.abs(impulse[power] @ p.T)) for power in (2, 4))
    sixth = weight @ (np.abs(impulse[6]).max(axis=0) + powers[3] / 8)
    bend = (second + (fourth + sixth / 8) / 8) / 8 * SPARE + off
    low, high = shares
    half, middle = (high - low) / 2, (high + low) / 2
    if cells.start == "periodic" and cells.plant.integrators > 0:
        m = float(np.quantile(right, high / (high - low)))
        left, right, area = left - m, right - m, area - m
        off = off + UNIT * (abs(m) + np.abs(left) + np.abs(right) + np.abs(area))
    keeps = (left * right > 0) & (np.minimum(np.abs(left), np.abs(right)) > bend + off)
    most = np.where(keeps, np.abs(area), absolute_integral(left, right) + 2 / 3 * bend) + off
    # each cell takes at most half its integral of |h - m| and middle times that of h - m, of which off is uncertain
    most, sizes = half * most + middle * area, half * most + abs(middle) * (np.abs(area) + off)
    uncertain = abs(middle) * float(off.sum()) + len(most) * UNIT * float(sizes.sum())
    taken = gain * (float(most.sum()) + uncertain + stray) * (1 + 8 * UNIT)
    had = float(mu @ values) - len(mu) * UNIT * float(np.abs(mu) @ np.abs(values)) - doubt * size
    return (had - taken) / size - 4 * UNIT


def reached(cells: Cells, u: np.ndarray, r: Samples, gain: float, counted: slice) -> float:
    """An upper bound of the greatest |r - y| in the counted cells under gain times u.

    Parameters
    ----------
    cells
        The plant, at rest at first or periodic.
    u
        Shape (count,), constant in each cell, from :func:`whole`: of sum 0 where y has an offset that counts for
        nothing. The best offset is taken.
    r, gain
        As in :func:`forced`.
    counted
        Of the cells.

    Notes
    -----
    From the computed states at the beginning of a cell the plant's own flow follows exactly; how far they are from the
    true ones :meth:`experiments.physical_limits.response_cells.Cells.reach` says. Within a cell y leaves its chord by
    at most 1/8 of its largest second derivative.
    """
    x, chain = cells.states(u), cells.chain
    n = len(chain.b)
    flow = np.zeros((n + 1, n + 1))
    flow[:n, :n], flow[:n, n] = np.abs(chain.A), np.abs(chain.b)
    most_c = np.abs(np.append(chain.c, chain.d)) @ positive_exponential(flow * SPARE)
    stray = float(most_c[:n] @ cells.reach(cells.state_defects(u, x))) * SPARE
    z = np.column_stack([x[:-1], u])[counted]
    powers = [most_c @ np.linalg.matrix_power(flow, power) for power in (0, 2, 4, 8)]
    off = (n + 10) * UNIT * (np.abs(z) @ np.max(powers[:3], axis=0)) * SPARE
    second, fourth = (np.maximum(*np.abs(chain.output[power] @ z.T)) for power in (2, 4))
    sixth = np.abs(z) @ (np.abs(chain.output[6]).max(axis=0) + powers[3] / 8)
    bend = (second + (fourth + sixth / 8) / 8) / 8 * SPARE
    values = np.append(r.values, r.values[0]) if cells.start == "periodic" else r.values
    left = values[:-1][counted] - gain * (z @ chain.output[0, 0])
    right = values[1:][counted] - gain * (z @ chain.output[0, 1])
    if cells.start == "periodic" and cells.plant.integrators > 0:
        middle = (max(left.max(), right.max()) + min(left.min(), right.min())) / 2
        left, right = left - middle, right - middle
    inside = np.maximum(np.abs(left), np.abs(right)) + gain * (bend + off + stray)
    return float(inside.max()) * (1 + 8 * UNIT) + r.doubt + r.bulge + 16 * UNIT


def absolute_integral(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The integrals of |chord from left to right| over intervals of length 1, shape (n,) as the ends have."""
    size = np.abs(left) + np.abs(right)
    crossing = left * right < 0
    return np.asarray(np.where(crossing, (left**2 + right**2) / np.where(crossing, size, 1.0), size) / 2)
