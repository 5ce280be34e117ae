"""Designs -> saturated closed loops with an exact dead time -> runs, and the tables behind every figure.

>>> import design, experiments, identification
>>> Mode = identification.Mode
>>> plant = identification.PlantModel(7.0, (Mode(200.0, 0.05),), (Mode(300.0, 0.02),), delay_s=0.01)
>>> bound = identification.AdditiveBound.printed_form(gain=0.01, corner=100.0, omega=300.0, zeta=0.1)
>>> model = identification.IdentifiedModel(plant, bound)
>>> own = design.extended(model, reference_omegas=[1.5], a=4.0, pairs=[(2.0, 1.0)])
>>> reference = experiments.sinusoid(amplitude=50.0, omega=1.5, phase_rad=0.0, offset=0.0)
>>> run = experiments.simulate(own, limits=11.0, reference=reference, anti_windup="corrected")
>>> run
Run(5001 samples up to 20.944 s, 2 crossings, outputs reference, output, error, y_lin, v)
>>> bool(abs(run.saturated_control).max() <= 11.0)
True
"""

from identification.base.faces import face

__getattr__, __dir__ = face(__name__, __file__)
