"""Plant model and additive bound -> the controllers of chapters 2 to 4 with their anti-windup.

>>> import design, identification
>>> Mode = identification.Mode
>>> plant = identification.PlantModel(7.0, (Mode(200.0, 0.05),), (Mode(300.0, 0.02),), delay_s=0.01)
>>> bound = identification.AdditiveBound.printed_form(gain=0.01, corner=100.0, omega=300.0, zeta=0.1)
>>> model = identification.IdentifiedModel(plant, bound)
>>> own = design.extended(model, reference_omegas=[1.5], a=4.0, pairs=[(2.0, 1.0)])
>>> own
Design(extended, reference at 1.5 rad/s, anti-windups thesis, corrected)
>>> round(design.audit(own).margins.modulus.value, 3)
0.917
"""

from identification.base.faces import face

__getattr__, __dir__ = face(__name__, __file__)
