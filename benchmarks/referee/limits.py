"""Physical limits: the enclosures of the least peak error beside linear programs of another formulation.

Periodic: u is a trigonometric polynomial, and so is the weight of the dual program, so that nothing is held between
samples. From rest: u stands still in coarse cells (an upper bound), or in fine ones with the error known at coarse
times only (a lower bound). All four are bounds from one side; what is compared is that no bound contradicts another.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.optimize import linprog

from benchmarks.referee.cases import Case, Finding
from benchmarks.referee.factors import Factors, Real, of_plant
from benchmarks.referee.realised import realised
from experiments.physical_limits.least_peak_error import RestLimit, periodic_limit
from experiments.runs.references import Reference
from identification.model.plant import PlantModel

HARMONICS = 16
GRID = 12  # points for one harmonic in the programs
DENSE = 256  # points for one harmonic where their answers are judged
CELLS = 60  # of the horizon from rest
FINE = 20  # parts of a cell
SAME = 1e-5  # of the reference's amplitude: our integrals by points, and HiGHS's tolerance of 1e-7 on scaled rows
REST = 2e-3  # the same from rest, where our sums over fine cells err by their square
REACHED = 1e-6  # relative: "the most that the control reaches" against the largest of so many points
STEPS = 100  # of a period in the program from rest, as the project itself takes for settling times


def check(case: Case) -> list[Finding]:
    """The required control, the periodic enclosure, and one from rest, under one limit each."""
    random = case.random(16)
    plant = case.model.plant
    slow = case.rate * float(10 ** random.uniform(-1.0, 0.0))
    count = int(random.integers(1, 4))
    multiples = np.append(1, np.sort(random.choice(np.arange(2, 6), count - 1, replace=False)))
    size = float(10 ** random.uniform(-3, 3))
    reference = Reference(
        tuple(float(size * random.uniform(0.3, 1.0)) for _ in multiples),
        tuple(float(slow * k) for k in multiples),
        tuple(float(random.uniform(-math.pi, math.pi)) for _ in multiples),
        float(random.choice([0.0, size * random.uniform(-1, 1)])),
    )
    reached = _steady_control(plant, reference)
    said: Any = reference.required(plant)
    off = abs(getattr(said, "value", said) / reached - 1)
    findings = [Finding("required is the most that u reaches", off, REACHED)]
    limit = reached * float(random.uniform(0.4, 1.15))
    found = periodic_limit(plant, reference, limit)
    lower, upper = _periodic(of_plant(plant), reference, slow, limit)
    findings += _contradictions("periodic", found.lower, found.upper, lower, upper, reference.amplitude, SAME)
    rest = RestLimit(plant, reference, limit, STEPS)
    index = int(random.integers(0, rest.last + 1))
    start = rest.start_s(index) - plant.delay_s
    found = rest.at(index)
    lower, upper = _from_rest(plant, reference, limit, start, rest.horizon_s - plant.delay_s)
    return findings + _contradictions("from rest", found.lower, found.upper, lower, upper, reference.amplitude, REST)


def _contradictions(
    name: str, lower: float, upper: float, own_lower: float, own_upper: float, amplitude: float, allowed: float
) -> list[Finding]:
    return [
        Finding(f"{name}: lower end above a bound", max(0.0, lower - own_upper, lower - upper) / amplitude, allowed),
        Finding(f"{name}: upper end below a bound", max(0.0, own_lower - upper) / amplitude, allowed),
    ]


def _steady_control(plant: PlantModel, reference: Reference) -> float:
    """The largest |u| in the steady state, by points of a common period."""
    P, slow = of_plant(plant), min(reference.omegas)
    waves = [
        a * np.exp(1j * (p - math.pi / 2)) / complex(P(np.array(1j * w)))
        for a, w, p in zip(reference.amplitudes, reference.omegas, reference.phases_rad, strict=True)
    ]
    time_s = np.linspace(0, 2 * math.pi / slow, 200_001)
    return float(
        np.abs(
            sum((wave * np.exp(1j * w * time_s)).real for wave, w in zip(waves, reference.omegas, strict=True))
        ).max()
    )


def _periodic(P: Factors, reference: Reference, slow: float, limit: float) -> tuple[float, float]:
    """A lower and an upper bound; u and the dual weight have HARMONICS harmonics.

    Upper: minimise max |r - y| under |u| <= limit on points, then scale u into its limits and look densely.
    Lower: for a weight w of period and mean 0, the mean of |w| at most 1, max |r - y| is at least
    mean(w r) - limit mean |P^* w - c|, whatever the constant c, as u has the mean 0.
    """
    k = np.arange(1, HARMONICS + 1)
    gains = P(1j * slow * k)
    phase = slow * np.arange(GRID * HARMONICS) * (2 * math.pi / slow / (GRID * HARMONICS))
    dense = np.arange(DENSE * HARMONICS) * (2 * math.pi / (DENSE * HARMONICS))
    r, r_dense = reference(phase / slow), reference(dense / slow)

    def waves(at: Real) -> tuple[Real, Real]:
        """u, and y or P^* w with the conjugate, of cosines and sines."""
        turn = np.exp(1j * np.outer(at, k))
        return np.hstack([turn.real, turn.imag]), turn

    U, turn = waves(phase)
    unit = float(np.abs(gains[0])) * limit
    Y = np.hstack([(turn * gains).real, (turn * gains).imag])
    n, m = 2 * HARMONICS, len(phase)
    one = np.ones((m, 1))
    # unknowns: u's coefficients over the limit, the mean of y and the peak over unit
    rows = np.vstack([
        np.hstack([Y * limit / unit, one, -one]), np.hstack([-Y * limit / unit, -one, -one]),
        np.hstack([U, 0 * one, 0 * one]), np.hstack([-U, 0 * one, 0 * one]),
    ])  # fmt: skip
    sides = np.concatenate([r / unit, -r / unit, np.ones(2 * m)])
    found = linprog(np.append(np.zeros(n + 1), 1.0), rows, sides, bounds=[(None, None)] * (n + 2), method="highs")
    U_dense, turn = waves(dense)
    Y_dense = np.hstack([(turn * gains).real, (turn * gains).imag])
    x = found.x[:n] / max(1.0, float(np.abs(U_dense @ found.x[:n]).max()))
    error = r_dense - limit * (Y_dense @ x)
    upper = float(np.ptp(error)) / 2  # the mean of y is free

    conjugate = np.conj(gains)
    # the duals of the error's rows, smoothed to HARMONICS harmonics, are the weight
    marginals = found.ineqlin.marginals
    weight = -(marginals[:m] - marginals[m : 2 * m])
    coefficients = 2 * (U.T @ weight)  # over sum |w|, all that matters below
    taper = np.tile(1 - (k / (HARMONICS + 1)) ** 2, 2)
    lower = max(_dual(coefficients * shape, U_dense, dense, conjugate, k, r_dense, limit) for shape in (1.0, taper))
    return max(lower, 0.0), upper


def _dual(c: Real, U: Real, at: Real, conjugate: Any, k: Real, r: Real, limit: float) -> float:
    weight = U @ c
    turn = np.exp(1j * np.outer(at, k)) * conjugate
    adjoint = np.hstack([turn.real, turn.imag]) @ c
    size = float(np.abs(weight).mean())
    if size == 0:  # following is possible: the peak is 0
        return 0.0
    cost = float(np.abs(adjoint - np.median(adjoint)).mean())
    gained = abs(float((weight * r).mean()))
    return (gained - limit * cost) / size


def _from_rest(
    plant: PlantModel, reference: Reference, limit: float, start: float, horizon: float
) -> tuple[float, float]:
    """Bounds on E(t0) of the plant without its dead time, start = t0 less it: from rest at 0, the error ahead by it."""
    A, b, c, _ = realised(of_plant(plant.without_delay()))
    n, total = len(b), CELLS * FINE
    step = horizon / total
    M = np.zeros((n + 1, n + 1))
    M[:n, :n], M[:n, n] = A * step, b * step
    E = expm(M)
    x, pulse = E[:n, n], np.zeros(total)
    for j in range(total):
        pulse[j] = c @ x
        x = E[:n, :n] @ x
    time_s = step * np.arange(1, total + 1)
    r = reference(time_s + plant.delay_s)
    index = np.subtract.outer(np.arange(total), np.arange(total))
    G = np.where(index >= 0, pulse[np.maximum(index, 0)], 0.0)  # u of each fine cell to y at its end
    counted = time_s >= start * (1 - 1e-12)
    unit = float(np.abs(r).max())
    coarse = G.reshape(total, CELLS, FINE).sum(axis=2) * limit / unit
    upper_rows = np.flatnonzero(counted)[:: max(1, FINE // 8)]
    found = _peak(coarse[upper_rows], r[upper_rows] / unit)
    upper = unit * float(np.abs(r[counted] / unit - coarse[counted] @ found.x[:-1]).max())
    lower_rows = np.flatnonzero(counted)[:: FINE // 2]
    marginals = _peak(coarse[lower_rows], r[lower_rows] / unit).ineqlin.marginals
    weight = -(marginals[: len(lower_rows)] - marginals[len(lower_rows) :])
    adjoint = weight @ G[lower_rows]
    size = float(np.abs(weight).sum())
    gained = abs(float(weight @ r[lower_rows])) - limit * float(np.abs(adjoint).sum())
    lower = gained / size if size else 0.0
    return max(lower, 0.0), upper


def _peak(rows: Real, r: Real) -> Any:
    """min over |u| <= 1 of the greatest |r - rows u|."""
    one = np.ones((len(rows), 1))
    return linprog(
        np.append(np.zeros(rows.shape[1]), 1.0),
        np.vstack([np.hstack([rows, -one]), np.hstack([-rows, -one])]),
        np.concatenate([r, -r]),
        bounds=[(-1.0, 1.0)] * rows.shape[1] + [(0.0, None)],
        method="highs",
    )
