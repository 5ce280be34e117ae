"""What a designer chooses among, and what is chosen unless stated."""

METHODS = ("zeros", "lagrange", "poles")
"""How Q is designed."""

GUARANTEES = ("global", "robust", "sector")
"""What the corrected compensator guarantees: whatever the control, so for every plant within W_a, up to a control."""

SECTOR = 0.95
"""Sector of the corrected compensator where none is stated: \\|u\\| may reach twenty times the limits."""

WEAKER = (0.9, 0.8, 0.65, 0.5, 0.3)
"""Sectors in turn where no compensator has :data:`SECTOR` and none is stated."""

ROBUST_LEVEL = 0.5
"""What |W_a C S| is kept below unless another level is stated: half of what loses the proof of stability."""
