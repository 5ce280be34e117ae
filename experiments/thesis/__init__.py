"""Thesis: what reproduces and judges the print."""
