"""Tool: what a fit says."""
