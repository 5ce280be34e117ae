"""Thesis: one module ``fig_x_yy`` each figure, and what several of them share.

A figure module has ``TABLES``, the names of the tables it needs, ``draw(tables)``, which returns the figure and
touches nothing else, and ``caption(tables)``, which returns its caption. ``tables`` maps the names to data frames.
The command line reads the tables, draws and saves.
"""
