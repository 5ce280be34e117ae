"""Thesis: its figures and the report that judges it."""
