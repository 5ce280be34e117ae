"""Runs and models -> figures and captions; the summary of a plant; the thesis's figures and report.

>>> import identification, paper_figures
>>> tests = identification.read_sweeps(["data/elevation/synthetic_test_1_frf.csv"])
>>> model = identification.fit(tests, modes=2, integrators=1)
>>> figure = paper_figures.plot_bode(model, tests)
>>> len(figure.axes)
3
"""

from identification.base.faces import face

__getattr__, __dir__ = face(__name__, __file__)
