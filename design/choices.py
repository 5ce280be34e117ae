"""What a designer chooses among, and what is chosen unless stated."""

METHODS = ("zeros", "lagrange", "poles")
"""How Q is designed."""

GUARANTEES = ("global", "robust", "sector")
"""What the corrected compensator guarantees: whatever the control, so for every plant within W_a, up to a control."""

SECTOR = 0.95
"""Sector of the corrected compensator where none is stated: \\|u\\| may reach twenty times the limits."""

ROBUST_LEVEL = 0.5
"""What |W_a C S| is kept below unless another level is stated: half of what loses the proof of stability."""
