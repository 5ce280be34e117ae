"""Runs and models -> figures and captions; the summary of a plant; the thesis's figures and report.

>>> import design, experiments, identification, paper_figures
>>> tests = identification.read_sweeps(["data/elevation/synthetic_test_1_frf.csv"])
>>> model = identification.fit(tests, modes=2, integrators=1)
>>> len(paper_figures.plot_bode(model, tests).axes)
4
>>> own = design.extended(model, reference_omegas=[1.5], a=4.0, pairs=[(2.0, 1.0)])
>>> nyquist, sensitivity = paper_figures.plot_nyquist(own), paper_figures.plot_sensitivity(own)
>>> run = experiments.simulate(own, 0.5, experiments.sinusoid(1.0, 1.5), until_s=5.0)
>>> figure = paper_figures.plot_run(run, limits=0.5)
>>> figure.savefig("run.pdf")  # doctest: +SKIP
"""

from identification.base.faces import face

__getattr__, __dir__ = face(__name__, __file__)
