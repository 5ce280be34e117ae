"""What sampling makes of the linear loop, judged without a run: stable or not, its steady error, its margin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.blocks.block import Block, plant_block
from design.design_file import Design
from experiments.drive.difference_equations import SampledBlock
from experiments.drive.held_plant import between_samples, held_plant, image
from experiments.drive.sampled_loop import FORMS, Drive, controller_blocks
from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.model.plant import PlantModel

A_DECADE = 60  # frequencies, to begin with
AROUND = np.geomspace(1e-2, 1e2, 41)  # a root, in distances from the unit circle
ON_IT = 1e-6  # of its distance from 1: a root that is as near to the unit circle may be on it
TURN = 0.5  # radians: between neighbouring frequencies the characteristic function turns by less
FINEST = 40  # halvings of an interval of frequencies
UNFOLLOWED = 1e-6  # % of the amplitude: smaller steady errors are alike
PAST = 1e-11  # relative
AT_REST = 1e-2  # of the lowest angle: a constant, next to integrators that the controller cancels


@dataclass(frozen=True)
class LoopJudgement:
    """The linear loop of a design with its controller on a computer.

    Parameters
    ----------
    method, rate_hz
        As of :class:`experiments.drive.sampled_loop.Drive`.
    refused
        Why the controller cannot run so; empty where it can.
    stable
        Whether every closed-loop pole is inside the unit circle.
    omegas, steady_errors, between_errors, continuous_errors
        The reference's frequencies in rad/s; the error that stays at the samples in % of the amplitude of each, and the
        largest that stays between them, not a number where the loop is not stable; and that of the continuous loop.
    modulus_margin
        The least |1 + L| on the unit circle: the distance of the loop's frequency response from -1; 0 where it is not
        stable.
    """

    method: str
    rate_hz: float
    refused: str
    stable: bool
    omegas: tuple[float, ...]
    steady_errors: tuple[float, ...]
    between_errors: tuple[float, ...]
    continuous_errors: tuple[float, ...]
    modulus_margin: float

    @property
    def steady_error(self) -> float:
        """The largest of the steady errors, at and between the samples; infinite where the loop is not stable."""
        return max(*self.steady_errors, *self.between_errors) if self.stable else math.inf

    def __str__(self) -> str:
        """What the loop does, a clause without its subject."""
        if not self.stable:
            return "UNSTABLE"
        error, beside = _percent(max(self.steady_errors)), max(self.continuous_errors)
        error += f", between the samples {_percent(max(self.between_errors))}"
        if beside >= UNFOLLOWED:
            error += f" (in continuous time {_percent(beside)})"
        return f"stable, its steady error at the samples {error} and its modulus margin {self.modulus_margin:.2g}"


def judge_loop(
    design: Design,
    drive: Drive,
    plant: PlantModel | None = None,
    omegas: Sequence[float] | None = None,
    form: str = FORMS[0],
) -> LoopJudgement:
    """Judge the linear loop of a design with its controller on a computer.

    Parameters
    ----------
    design
        Of either kind.
    drive
        The computer; of the actuator only the input delay counts, its limits, levels and slopes are not linear.
    plant
        The true plant; the design's own unless given.
    omegas
        Frequencies of the reference in rad/s; those of the design unless given.
    form
        As of :func:`experiments.drive.sampled_loop.simulate_sampled`.

    Notes
    -----
    With the held plant P_d z^-N, exact at the samples, and C_d = forward/(1 - feedback) the closed-loop poles are the
    zeros of f = 1 - feedback + forward P_d z^-N. The stable f g, where g = prod(1 - z_i/z) over the poles z_i of P_d
    and of forward that are not inside the unit circle, has as many zeros outside it as it turns around 0 on it: the
    argument principle, however long the dead time is. The turns are counted on frequencies that are refined until f g
    turns by less than TURN between neighbours. The steady error at the samples is |(1 - feedback)/f|, and
    :func:`experiments.drive.held_plant.between_samples` has that between them. An integrator that the
    controller cancels, as that of chapter 2 does, is hidden and not judged.
    """
    true = design.loop_plant if plant is None else plant
    frequencies = tuple(design.reference_omegas if omegas is None else omegas)
    try:
        loop = _Loop(design, drive, true, form)
    except InputError as error:
        refused, stable, margin = str(error), False, 0.0
    else:
        refused, (stable, margin) = "", loop.stability()
    errors = [loop.errors(omega) if stable else (math.nan, math.nan) for omega in frequencies]
    sampled, between = (tuple(100 * error for error in each) for each in zip(*errors, strict=True))
    forward, feedback = design.controller_parts()
    late = Block(1.0, (), (), design.loop_plant.delay_s)
    rest = 1 - (feedback * late)(1j * np.array(frequencies))
    around = forward * plant_block(true) * Block(1.0, (), (), drive.input_delay_s)
    with np.errstate(invalid="ignore"):  # an integrator against a constant
        continuous = 100 * np.abs(rest / (rest + around(1j * np.array(frequencies))))
    left = tuple(0.0 if math.isnan(error) else float(error) for error in continuous)
    return LoopJudgement(drive.method, drive.rate_hz, refused, stable, frequencies, sampled, between, left, margin)


def _percent(error: float) -> str:
    return f"below {UNFOLLOWED:g} %" if error < UNFOLLOWED else f"{error:.2g} % of the amplitude"


class _Loop:
    """f g and 1 - feedback on the unit circle, at the angles theta = omega T."""

    def __init__(self, design: Design, drive: Drive, plant: PlantModel, form: str) -> None:
        self.T, self.true, self.input_delay_s = 1 / drive.rate_hz, plant, drive.input_delay_s
        self.forward, self.feedback, _, self.around = controller_blocks(design, None, drive, form)
        self.sampled, self.samples = held_plant(plant, self.T, drive.input_delay_s)
        outside, own = list(plant_block(plant).unstable_poles), Block(1.0)
        if form == "thesis" or design.kind == "delay-free":  # integrators that the controller cancels are hidden
            own = design.controller_parts()[0]
            for _ in range(min(own.zeros.count(0j), outside.count(0j))):
                outside.remove(0j)
        self.hidden = 0j in plant_block(plant).unstable_poles and 0j not in outside
        self.anchors = [image(pole, self.T) for pole in outside]
        self.plant = self.sampled * Block(1.0, tuple(self.anchors))
        by_tustin = drive.method == "tustin"
        moved = [pole / (1 - pole * self.T / 2) if by_tustin else image(pole, self.T) for pole in own.unstable_poles]
        self.poles = [1 + self.T * pole for pole in moved]
        roots = (np.linalg.eigvals(block.A) for block in (self.forward, self.feedback))
        self.roots = np.concatenate([*roots, 1 + self.T * np.array([*self.sampled.poles, *self.sampled.zeros])])
        apart = np.abs(np.log(self.roots[np.abs(self.roots) > 0]))
        self.lowest = 1e-3 * min([1.0, *apart[apart > 1e-12]])

    def parts(self, theta: Real) -> tuple[Complex, Complex]:
        """F g and (1 - feedback) g at angles (k,)."""
        z, w = np.exp(1j * theta), np.expm1(1j * theta) / self.T
        g, own = np.ones(len(z), dtype=complex), np.ones(len(z), dtype=complex)
        for anchor in self.anchors:
            g *= (w - anchor) * self.T / z
        for pole in self.poles:
            own *= 1 - pole / z
        controlled = own * _response(self.forward, z) * self.plant(w) * (self.T / z) ** len(self.anchors)
        rest = (1 - _response(self.feedback, z)) * g * own
        return rest + controlled * z**-self.samples, rest

    def errors(self, omega: float) -> tuple[float, float]:
        """The error at the samples and the largest between them, of a reference exp(j omega t).

        Poles of the controller on the unit circle are passed by. A constant is at z = 1 itself: where the plant or the
        controller integrates, the error is 0; next to hidden integrators its real part is taken, even in the angle.
        """
        theta, integrates = omega * self.T * (1 + PAST), 0 in self.anchors or 1 in self.poles
        if omega == 0 and self.hidden:
            theta = AT_REST * self.lowest
        if omega == 0 and integrates:
            error = 0j
        else:
            f, rest = self.parts(np.array([theta]))
            error = complex(rest[0] / f[0])
        if omega == 0:
            error = complex(error.real)
        control = self.control(theta) if abs(error) > 0.5 else None
        late_s, output = between_samples(self.true, self.T, self.input_delay_s, theta / self.T, 1 - error, control)
        return abs(error), float(np.max(np.abs(np.exp(1j * theta / self.T * late_s) - output)))

    def control(self, theta: float) -> complex:
        """The control of a reference exp(j k theta), where neither the plant nor the controller has a pole."""
        z, w = np.exp(1j * np.array([theta])), np.expm1(1j * np.array([theta])) / self.T
        forward, rest = _response(self.forward, z), 1 - _response(self.feedback, z)
        return complex((forward / (rest + forward * self.sampled(w) * z**-self.samples))[0])

    def stability(self) -> tuple[bool, float]:
        """Whether no zero of f is on or outside the unit circle, and the least |1 + L| on it, 0 where one is."""
        theta = self._angles()
        f, rest = self.parts(theta)
        for _ in range(FINEST):
            turns = np.abs(np.angle(f[1:] / f[:-1]))
            wide = np.flatnonzero(~(turns < TURN))
            if not len(wide):
                break
            between = (theta[wide] + theta[wide + 1]) / 2
            more = self.parts(between)
            theta = np.insert(theta, wide + 1, between)
            f, rest = (np.insert(each, wide + 1, new) for each, new in zip((f, rest), more, strict=True))
        else:
            return False, 0.0  # a zero on the circle
        if not np.isfinite(f).all():
            return False, 0.0
        turned = float(np.angle(f[1:] / f[:-1]).sum()) + float(np.angle(f[0] * np.sign(f[0].real)))
        if abs(turned) > math.pi / 2:
            return False, 0.0
        return True, float(1 / np.max(np.abs(rest / f)))

    def _angles(self) -> Real:
        """From far below every root to pi, denser around the roots of the blocks."""
        roots = self.roots[np.abs(self.roots) > 0]
        place, apart = np.abs(np.angle(roots)), np.abs(np.log(roots))
        distance = np.maximum(np.abs(np.log(np.abs(roots))), ON_IT * apart)
        lowest = self.lowest
        near = np.concatenate(
            [place[:, None] - distance[:, None] * AROUND, place[:, None] + distance[:, None] * AROUND]
        )
        grid = np.geomspace(lowest, math.pi, int(A_DECADE * math.log10(math.pi / lowest)) + 2)
        every = np.concatenate([grid, near.ravel()])
        return np.unique(every[(every >= lowest) & (every <= math.pi)])


def _response(block: SampledBlock, z: Complex) -> Complex:
    """The sum of a block's outputs over its input at points (k,) of the unit circle."""
    n = len(block.b)
    states = np.linalg.solve(z[:, None, None] * np.eye(n) - block.A, np.broadcast_to(block.b[:, None], (len(z), n, 1)))
    found = np.zeros(len(z), dtype=complex)
    for o in range(len(block.d)):
        memory = np.polyval(block.taps[o, : block.length[o]][::-1], 1 / z)
        found += (states[:, :, 0] @ block.C[o] + block.d[o]) * memory * z ** -float(block.first[o])
    return found
