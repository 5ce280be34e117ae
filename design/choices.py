"""What a designer chooses among, and what is chosen unless stated."""

METHODS = ("zeros", "lagrange", "poles")
"""How Q is designed."""

SECTOR = 0.95
"""Sector of the corrected compensator unless another is stated: \\|u\\| may reach twenty times the limits."""

ROBUST_LEVEL = 0.5
"""What |W_a C S| is kept below unless another level is stated: half of what loses the proof of stability."""
