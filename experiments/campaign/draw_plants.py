"""Plants drawn inside the additive bound: modes, damping, gain and dead time perturbed, each proved to be inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.blocks.frequency_peak import frequency_grid
from experiments.campaign.distance import FIRST, Changes, Factors, at_the_ends, distance, moved, reach
from experiments.campaign.distance_certificate import stays_below
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.modes import Mode
from identification.model.plant import PlantModel

LARGEST = np.log(2.0)  # of a parameter's change in logarithms, however loose the bound
SHORTEST = 0.05  # of its unit, below which a dead time of 0 stays 0; of itself, to which another one shrinks at most
FASTER = 4.0  # than the corner of the gain's change, the one at which the slope at s = 0 is made up for
SMALLEST = 1e-9  # of the largest change, below which none is within the bound
FINER = 3  # points of the check for one of the search
AROUND = np.sort(np.concatenate([[0.0], *(sign * np.geomspace(7e-3, 7e2, 61) for sign in (-1, 1))]))  # half widths
SHRINK, MOST_SHRINK = 1e-6, 1e-2  # of the way, given up in turn until the plant is proved to be within
ABOVE, LEAST_ABOVE = 1e-3, 1e-6  # how far the distance may lie above the largest ratio found: a share, and in any case
ABOVE_OF_TWO = 1e-2  # the share with two integrators, of which rounding leaves less to see next to s = 0
ROUNDINGS = 64  # of a plant's response, in units of its last digit
TRIES = 500


@dataclass(frozen=True)
class Member:
    """A plant inside the bound.

    Parameters
    ----------
    plant
        P_true; around a plant with integrators it has a real zero and a real pole more than P for each of them.
    distance
        The largest |P_true - P|/|W_a| that was found. Over all frequencies it is proved to be at most 1, and higher by
        no more than ABOVE of itself and LEAST_ABOVE. Around two integrators the share is ABOVE_OF_TWO, and the proof
        is of a P_true whose slope at s = 0 is that of P. Rounded to doubles it misses that by some 1e-16 of itself,
        which the ratio shows only at frequencies so much nearer to 0.
    """

    plant: PlantModel
    distance: float


class PlantsWithin:
    """The plants inside W_a around P, to draw from.

    Parameters
    ----------
    plant
        P: any plant of its class.
    bound
        W_a.

    Raises
    ------
    InputError
        No plant but P itself is within the bound: W_a falls faster than P.

    Notes
    -----
    What is perturbed: the logarithm of the size of omega and zeta of every mode, of every real root's rate, of the
    gain, and the dead time; every root stays in its half plane. With an integrator (K' - K)/s has a pole at s = 0 and
    no W_a that is finite there covers another K. The gain is then perturbed away from s = 0: by g above a corner c,
    with (1 + s/z)/(1 + s/p), z = c/sqrt(g), p = c sqrt(g), and c at random between the slowest and the fastest of the
    plant's roots. With two integrators the slope of the rest at s = 0 may not change either: another zero z and pole p,
    with sqrt(z p) = FASTER c and 1/z - 1/p equal to what that slope lacks, take every change of it back.

    How these weigh against each other is a choice of ours that has no number in it: the unit of each is the change
    that alone, upwards, brings P to the boundary of W_a (at most a factor of 2; of the dead time at most itself or
    1/corner of W_a, whichever is larger), and the direction is a vector of independent standard normal numbers in
    these units. A dead time of 0 may only grow; it stays 0 where it would grow by less than a twentieth of its unit,
    and another one shrinks to no less than a twentieth of itself, since a run takes at least one step a dead time.

    Along the direction the plant lies at a share, uniform in (0, 1], of the way to the boundary. To first order that
    share is its distance. It is not the distance itself that is drawn, because where W_a and P fall alike a plant with
    another dead time, however little it differs, is (|P| + |P_true|)/|W_a| away as omega grows. Where 2 |P|/|W_a| is 1
    or more there, none near P is within W_a, and the dead time is left as it is.
    """

    def __init__(self, plant: PlantModel, bound: AdditiveBound) -> None:
        self.plant, self.bound = plant, bound
        modes, zeros_and_poles = _modes(plant), [*plant.real_zeros, *plant.real_poles]
        omegas = [*(mode.omega for mode, _ in modes), *map(abs, zeros_and_poles)] or [bound.corner]
        self._corners = np.log([min(omegas), max(omegas)])
        self._bound = as_factors(bound)
        roots = [root for mode, _ in modes + _modes(bound) for root in mode.roots]
        roots += [complex(-rate) for rate, _ in [*_rates(plant), *_rates(bound)]]
        self._grid = self._resolved(frequency_grid(roots))
        ratio = self._grid[1:] / self._grid[:-1]
        finer = [self._grid[:-1] * ratio ** (k / FINER) for k in range(1, FINER)]
        self._check = np.sort(np.concatenate([self._grid, *finer]))
        self._on_grid, self._on_check = (
            (plant(1j * omega), np.abs(bound(1j * omega))) for omega in (self._grid, self._check)
        )
        self._count = 2 * len(modes) + len(zeros_and_poles) + 2  # parameters: modes, rates, gain, dead time
        self._most = np.full(self._count, LARGEST)
        self._most[-1] = max(plant.delay_s, 1 / bound.corner)
        middle = float(np.mean(self._corners))
        steps = np.ones(self._count)
        steps[-1] = self._most[-1] / FIRST  # seconds are no unit: the first dead time that is tried is the largest
        axes = zip(np.diag(steps), self._most / steps, strict=True)
        alone = steps * [self._reach(middle, axis, float(most)) for axis, most in axes]
        self._units = np.where(alone > SMALLEST * self._most, alone, 0.0)
        if not self._units.any():
            raise InputError(
                "only the model itself is within the additive bound, which falls faster than |P| as omega grows; "
                "expected a bound that does not"
            )

    def draw(self, seed: int, index: int) -> Member:
        """Plant ``index`` of a seed, whatever else is drawn, and wherever: a G_Delta of Thesis Eq. (2.7).

        Raises InputError when there is none.
        """
        random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index,)))
        corner = random.uniform(*self._corners)
        direction = random.standard_normal(self._count) * self._units
        share = 1.0 - random.random()
        if self.plant.delay_s == 0:
            direction[-1] = abs(direction[-1])
        return self.along(direction, share, float(np.exp(corner)))

    def along(self, direction: np.ndarray, share: float, corner: float) -> Member:
        """The plant at a share of the way from P to the boundary.

        Parameters
        ----------
        direction
            Changes (parameters,) in the order omega and zeta of each mode (zeros first), rates (zeros first), gain,
            dead time in seconds; all but the last in logarithms.
        share
            In (0, 1].
        corner
            Of the gain's change in rad/s, where the plant has integrators.
        """
        with np.errstate(divide="ignore"):
            most = np.min(self._most / np.abs(direction))
        if direction[-1] < 0:
            most = min(most, (1 - SHORTEST) * self.plant.delay_s / -direction[-1])
        t = share * self._reach(float(np.log(corner)), direction, most)
        if self.plant.delay_s == 0 and t * direction[-1] < SHORTEST * self._units[-1]:
            direction = np.append(direction[:-1], 0.0)
        nominal, changes = self._problem(corner, direction)
        shrink, above = SHRINK, ABOVE_OF_TWO if self.plant.integrators == 2 else ABOVE
        for _ in range(TRIES if t > 0 else 0):
            true = moved(nominal, changes, t)
            plant = self._as_plant(true)
            found = max(
                distance(true, nominal, self._bound, self._grid, *self._on_grid),
                at_the_ends(true, nominal, self._bound),
                self._checked(plant),
            )
            if found <= 1 and stays_below(true, nominal, self._bound, min(found * (1 + above) + LEAST_ABOVE, 1.0)):
                return Member(plant, float(found))
            t *= 1 - shrink
            shrink = min(10 * shrink, MOST_SHRINK)
        raise InputError(
            "no plant other than the model was found within W_a; expected a larger W_a, as from a fit with another "
            "--bound-order, --bound-below or --bound-above"
        )

    def _resolved(self, omega: np.ndarray) -> np.ndarray:
        """The frequencies but those, next to s = 0, at which the rounding of P alone would show beside W_a."""
        lost = ROUNDINGS * np.finfo(float).eps * np.abs(self.plant(1j * omega) / self.bound(1j * omega)) > LEAST_ABOVE
        return omega[int(np.argmin(lost)) :]

    def _reach(self, log_corner: float, direction: np.ndarray, most: float) -> float:
        nominal, changes = self._problem(np.exp(log_corner), direction)
        return float(reach(nominal, changes, float(most), self._bound, self._grid, *self._on_grid))

    def _problem(self, corner: float, direction: np.ndarray) -> tuple[Factors, Changes]:
        """P as factors, with a real zero and a real pole that cancel for each integrator, and their changes."""
        plant = self.plant
        modes, rates = _modes(plant), _rates(plant)
        split = 2 * len(modes)
        log_rates, (log_gain, later) = direction[split:-2], direction[-2:]
        if plant.integrators > 0:
            rates += [(corner, 1.0), (corner, -1.0)]
            log_rates, log_gain = np.append(log_rates, [-log_gain / 2, log_gain / 2]), 0.0
        if plant.integrators == 2:
            rates += [(FASTER * corner, 1.0), (FASTER * corner, -1.0)]
            log_rates = np.append(log_rates, [0.0, 0.0])
        nominal = _factors(plant.gain, plant.delay_s, plant.integrators, modes, rates)
        return nominal, (float(log_gain), float(later), direction[:split].reshape(-1, 2).copy(), log_rates.copy())

    def _as_plant(self, factors: Factors) -> PlantModel:
        gain, delay, integrators, modes, rates = factors
        as_modes = {sign: tuple(Mode(w, zeta) for w, zeta, of in modes.tolist() if of == sign) for sign in (1, -1)}
        as_rates = {sign: tuple(rate for rate, of in rates.tolist() if of == sign) for sign in (1, -1)}
        return PlantModel(gain, as_modes[1], as_modes[-1], delay, integrators, as_rates[1], as_rates[-1])

    def _checked(self, true: PlantModel) -> float:
        """The largest |P_true - P|/|W_a| on another, finer grid, by the plants themselves: a check of their factors."""
        modes = [mode for mode, _ in _modes(true)]
        around = [mode.omega * np.exp(min(abs(mode.zeta), 0.02) * AROUND) for mode in modes]
        omega = np.concatenate([np.zeros(0), *around])
        worst = np.max(np.abs(true(1j * self._check) - self._on_check[0]) / self._on_check[1])
        s = 1j * omega[omega >= self._grid[0]]
        if not len(s):
            return float(worst)
        return float(max(worst, np.max(np.abs(true(s) - self.plant(s)) / np.abs(self.bound(s)))))


def _modes(model: PlantModel | AdditiveBound) -> list[tuple[Mode, float]]:
    return [(mode, 1.0) for mode in model.zero_modes] + [(mode, -1.0) for mode in model.pole_modes]


def _rates(model: PlantModel | AdditiveBound) -> list[tuple[float, float]]:
    return [(rate, 1.0) for rate in model.real_zeros] + [(rate, -1.0) for rate in model.real_poles]


def as_factors(model: PlantModel | AdditiveBound) -> Factors:
    """A model as :func:`experiments.campaign.distance.response` takes it."""
    delay_s, integrators = (model.delay_s, model.integrators) if isinstance(model, PlantModel) else (0.0, 0)
    return _factors(model.gain, delay_s, integrators, _modes(model), _rates(model))


def _factors(
    gain: float, delay_s: float, integrators: int, modes: list[tuple[Mode, float]], rates: list[tuple[float, float]]
) -> Factors:
    """As :func:`experiments.campaign.distance.response` takes them."""
    table = np.array([[mode.omega, mode.zeta, sign] for mode, sign in modes]).reshape(-1, 3)
    return float(gain), float(delay_s), integrators, table, np.array(rates, dtype=float).reshape(-1, 2)
