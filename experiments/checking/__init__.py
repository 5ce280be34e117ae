"""Tool: a model, new sweeps of its plant, a design -> what moved, and what the design still promises."""
