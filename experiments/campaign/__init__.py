"""Tool: random plants within the bound W_a, each simulated."""
