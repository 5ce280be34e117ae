"""The Nyquist plot of a design: the curve of its model, that of the true plant, and the discs of W_a."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.blocks.frequency_peak import frequency_grid
from design.design_file import Design
from design.stability.delay_loop import DelayLoop
from identification.base.arrays import Complex, Real
from paper_figures.look.loop_curves import LoopCurves

NEAR = 4.0  # modulus of L up to which discs are drawn
FAR = 100.0  # modulus of L beyond which the curve is not drawn
DISCS = 48


@dataclass(frozen=True, eq=False)
class Nyquist:
    """L = P C along the imaginary axis.

    Parameters
    ----------
    model, true
        With the model and with the true plant, shape (n,); NaN where \\|L\\| exceeds :data:`FAR`.
    omega, centres, radii
        Of the discs that hold L of every plant within W_a, shape (m,): in rad/s, L of the model, and \\|W_a C\\|.
    """

    model: Complex
    true: Complex
    omega: Real
    centres: Complex
    radii: Real


def nyquist_of(design: Design, loop: DelayLoop) -> Nyquist:
    """The curves of L, and discs of W_a along what is near 0 of the model's.

    Parameters
    ----------
    design
        The design.
    loop
        Of it and the true plant.
    """
    model, moved = LoopCurves.of(design), LoopCurves(loop, design.additive_bound)
    blocks = (loop.plant, model.loop.plant, loop.forward, loop.feedback, model.W_a)
    omega = frequency_grid([root for block in blocks for root in block.zeros + block.poles])
    with np.errstate(all="ignore"):  # C has poles on the axis
        own, true = (np.where(np.abs(L) < FAR, L, np.nan) for L in (model.open(omega), moved.open(omega)))
        radii = model.radius(omega)
    near = np.flatnonzero(np.abs(own) < NEAR)
    if not len(near):
        return Nyquist(own, true, omega[:0], own[:0], radii[:0])
    parts = [np.abs(np.diff(own[near])), np.diff(np.log(omega[near]))]  # along the curve, and along the frequencies
    along = np.cumsum([0.0, *sum(part / max(part.sum(), 1e-300) for part in parts)])
    worst = np.argmax(radii[near] / np.abs(1 + own[near]))
    at = near[np.unique(np.append(np.searchsorted(along, np.linspace(0.0, along[-1], DISCS)), worst))]
    return Nyquist(own, true, omega[at], own[at], radii[at])
