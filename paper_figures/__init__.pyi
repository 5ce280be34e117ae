from paper_figures.look.plot_run import plot_run as plot_run
