"""Thesis: the tables behind the figures."""
