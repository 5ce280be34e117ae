"""The picture of windup in the README: ``python docs/images/windup.py`` writes windup.png beside this file."""

from __future__ import annotations

from math import pi
from pathlib import Path

from matplotlib.figure import Figure

import design
import experiments
import paper_figures
from identification import AdditiveBound, IdentifiedModel, Mode, PlantModel, Signals

LIMIT, MOVE = 3.0, 40.0
DPI = 130


def runs() -> dict[str, experiments.Run]:
    """A move of a synthetic rotary table against the limits of its drive, by anti-windup."""
    plant = PlantModel(12.0, (Mode(90.0, 0.03),), (Mode(130.0, 0.02),), delay_s=0.006, integrators=1)
    bound = AdditiveBound.printed_form(gain=0.17, corner=1000.0, omega=127.0, zeta=0.11)
    own = design.extended(IdentifiedModel(plant, bound), reference_omegas=[0.0])
    move = experiments.sinusoid(amplitude=MOVE, omega=0.0, phase_rad=pi / 2)
    return {name: experiments.simulate(own, LIMIT, move, name, until_s=6.0) for name in ("none", "corrected")}


def picture() -> Figure:
    """Both runs, one upon the other."""
    signals = Signals("speed command", "V", "angle", "deg")
    title = f"A synthetic rotary table moves by {MOVE:g} degrees under limits of $\\pm${LIMIT:g} V"
    return paper_figures.plot_run(runs(), LIMIT, signals, title)


if __name__ == "__main__":
    picture().savefig(Path(__file__).with_suffix(".png"), dpi=DPI, metadata={"Software": None})
