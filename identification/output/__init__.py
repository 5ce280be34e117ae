"""Tool: what a fit says and how it looks."""
