"""Tool: what a design promises and what it does not, as numbers and as text."""
