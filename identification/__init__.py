"""Sweep record -> frequency response -> plant model -> additive bound."""
