"""Tool: a design and a reference -> loops, runs, metrics, and what the guarantee covers."""
