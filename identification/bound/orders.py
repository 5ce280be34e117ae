"""Which orders of W_a are fitted: what a command line says in its help, without anything slow imported."""

from __future__ import annotations

HIGHEST_ORDER = 8
"""Most poles of an additive bound that is fitted."""
