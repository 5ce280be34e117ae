"""Sweep records -> frequency responses -> plant model and additive bound.

>>> import identification
>>> tests = identification.read_sweeps(["data/elevation/synthetic_test_1_frf.csv"])
>>> tests
[FrequencyResponse('synthetic_test_1_frf.csv', 1216 lines, 10.06 to 199.9 Hz, synthetic)]
>>> model = identification.fit(tests, modes=2, integrators=1)
>>> model
IdentifiedModel(gain ..., integrators 1, 2 zero and 2 pole modes, dead time ... s; W_a of order 2)
>>> python_control = model.plant.to_control(pade_order=3)
"""

from identification.base.faces import face

__getattr__, __dir__ = face(__name__, __file__)
