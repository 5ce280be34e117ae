from paper_figures.look.bode import plot_bode
from paper_figures.look.plot_run import plot_run

__all__ = ["plot_bode", "plot_run"]
