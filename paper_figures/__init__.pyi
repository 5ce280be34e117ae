from paper_figures.look.bode import plot_bode
from paper_figures.look.nyquist import plot_nyquist
from paper_figures.look.plot_run import plot_run
from paper_figures.look.sensitivity import plot_sensitivity

__all__ = ["plot_bode", "plot_nyquist", "plot_run", "plot_sensitivity"]
