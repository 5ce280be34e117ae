"""How many unstable roots a design's loop has with another true plant, by a winding number followed on points."""

from __future__ import annotations

import numpy as np

from design.blocks.block import plant_block
from design.blocks.frequency_peak import frequency_grid
from design.design_file import Design
from design.stability.axis import HALVE, NO_ZERO, judged_cells
from design.stability.characteristic_roots import closing_omega, largest_beyond, roots_right_of
from design.stability.jet import combined, jet
from design.stability.margins import delay_loop, responses
from design.stability.stable_intervals import AxisLoop
from identification.base.arrays import Complex, Real, Whole
from identification.base.errors import InputError
from identification.model.plant import PlantModel

NEGLIGIBLE = 1e-3  # of |T_so| + |P K|: where the nominal loop is no longer followed
TURN = 0.7  # |f(b) - f(a)| over the lesser of |f(a)| and |f(b)| between neighbours: a turn of less than 45 degrees
SMALL = 0.9  # of |f - 1| at both neighbours: f stays in the right half plane
CLOSEST = 1e-10  # of omega, between points
AROUND = np.concatenate([-np.geomspace(1e2, 1e-1, 16), [0.0], np.geomspace(1e-1, 1e2, 16)])  # half widths from a mode


class PerturbedLoop:
    """A design's loop with any true plant in the place of its model.

    Parameters
    ----------
    design
        Its loop with its own model must be stable.

    Raises
    ------
    InputError
        The nominal loop is not stable.

    Notes
    -----
    With D = P_true - P

        1 + P_true C = (1 + P C) (1 + D C S),    S = 1/(1 + P C).

    C S is stable, since the nominal loop is. It vanishes at s = 0 as s^q does, K/s^q being the same in both plants, so
    that D C S has no pole there. As s grows in the right half plane it vanishes, since P C and P_true C do and S tends
    to 1. By the argument principle f(j omega) = 1 + D C S turns about 0 clockwise, while omega grows from -infinity to
    infinity, as often as f has zeros there more than poles: these zeros are the roots of the loop with P_true and the
    unstable poles of P, the poles those of P_true, which are as many. So the roots are the turns of its phase in units
    of -pi from 0 on, f being real there. Where |D C S| < 1 everywhere there is no turn, whatever else: that is the
    guarantee of W_a.

    It is the loop from the reference to output and control that is judged. What the controller hides in itself is
    the design's, and no true plant moves it.
    """

    def __init__(self, design: Design) -> None:
        self.plant = design.loop_plant
        self.loop = delay_loop(design, self.plant)
        if roots_right_of(self.loop, 0.0) or any(root.real > 0 for root in self.loop.hidden):
            raise InputError("the design's loop is not stable with its own model; expected a stable one")
        axis = AxisLoop(self.loop)
        control = (self.loop.forward * axis.a[0],)

        def judge(centre: Real, half: Real) -> Whole:
            whole = combined(*axis.both(centre, half), 1.0)
            clear = whole.is_clear_of_zero & jet(control, 0.0, centre, half).is_clear_of_zero
            return np.where(clear, NO_ZERO, HALVE)

        self._top = closing_omega(self.loop, 0.0, 1.0, NEGLIGIBLE)
        _, followed, _ = judged_cells(judge, axis.edges(self._top))
        block = plant_block(self.plant)
        roots = (*block.zeros, *block.poles, *self.loop.forward.zeros, *self.loop.forward.poles)
        grid = frequency_grid(roots, per_decade=20)
        self._omega = np.union1d(followed, grid[grid < self._top])
        none, s = np.zeros_like(self._omega), 1j * self._omega
        whole = combined(*axis.both(self._omega, none), 1.0)
        self._on_grid = self.plant(s), jet(control, 0.0, self._omega, none).value / whole.value

    def unstable_roots(self, true: PlantModel) -> int:
        """How many roots of the loop with ``true`` lie in the open right half plane.

        Parameters
        ----------
        true
            P_true, with as many integrators and as many poles in the right half plane as the model, and the same gain
            if there are integrators.

        Raises
        ------
        InputError
            The plant is not as above, or a root lies on the imaginary axis as far as can be seen.

        Notes
        -----
        f is followed on a grid that resolves the nominal loop and both plants; intervals are halved until f moves
        by less than 0.7 of its modulus, and the dead times' difference turns it by less than 0.7 rad, but where
        |f - 1| < 0.9 at both ends. Beyond the grid's end |f - 1| is bounded by 0.9. Within it the number is found,
        not proved: a turn that begins and ends between two points would be missed. Where |D C S| < 1 at all
        frequencies the number is 0 without it.
        """
        same_gain = true.integrators <= 0 or true.gain == self.plant.gain
        if true.integrators != self.plant.integrators or not same_gain:
            raise InputError("the true plant's integrators differ from the model's; expected the same number and gain")
        if len(true.unstable_poles) != len(self.plant.unstable_poles):
            raise InputError(
                f"the true plant has {len(true.unstable_poles)} poles in the right half plane, the model "
                f"{len(self.plant.unstable_poles)}; expected equal numbers"
            )
        modes = [*true.zero_modes, *true.pole_modes]
        around = [mode.omega * np.exp(min(abs(mode.zeta), 0.1) * AROUND) for mode in modes]
        near = np.concatenate([*around, self._further(true)])
        omega = np.concatenate([self._omega, near])
        plant, control = self._on_grid
        known = (true(1j * self._omega) - plant) * control
        order = np.argsort(omega, kind="stable")
        omega, L = omega[order], np.concatenate([known, self._deviation(true, near)])[order]
        while True:
            f, size = 1 + L, np.abs(1 + L)
            moved = np.abs(np.diff(f)) > TURN * np.minimum(size[1:], size[:-1])
            turned = np.diff(omega) * abs(true.delay_s - self.plant.delay_s) > TURN
            wide = np.flatnonzero((moved | turned) & (np.maximum(np.abs(L[1:]), np.abs(L[:-1])) > SMALL))
            if not len(wide):
                return _turns(f)
            if np.any(np.diff(omega)[wide] < CLOSEST * omega[wide]):
                place = f"{omega[wide[0]]:.6g} rad/s"
                raise InputError(f"a root of the loop is on the imaginary axis near {place}, within rounding errors")
            middle = (omega[wide] + omega[wide + 1]) / 2
            omega = np.insert(omega, wide + 1, middle)
            L = np.insert(L, wide + 1, self._deviation(true, middle))

    def _further(self, true: PlantModel) -> Real:
        """Frequencies beyond the grid, up to one from which on |D C S| is at most (|P_true K| + |P K|)/(1 - ...)."""
        outer, top = plant_block(true) * self.loop.forward, self._top
        while True:
            inner, own, other = (
                largest_beyond(each, 0.0, top) for each in (self.loop.inner_loop, self.loop.open_loop, outer)
            )
            if own + other < SMALL * (1 - inner - own):
                break
            top *= 2
        turned = (top - self._top) * max(true.delay_s, self.plant.delay_s) / TURN
        return np.linspace(self._top, top, 2 + int(turned + 20 * np.log2(top / self._top)))[1:]

    def _deviation(self, true: PlantModel, omega: Real) -> Complex:
        """D C S at frequencies (n,)."""
        s = 1j * omega
        return np.asarray((true(s) - self.plant(s)) * responses(self.loop, omega)[1])


def _turns(f: Complex) -> int:
    turns = -float(np.sum(np.angle(f[1:] / f[:-1]))) / np.pi
    if abs(turns - round(turns)) > 0.1:
        raise InputError("the loop could not be followed from s = 0 to infinity; expected a strictly proper plant")
    return round(turns)
