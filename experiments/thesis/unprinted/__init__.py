"""Thesis: searches for the conditions that the thesis does not print."""
