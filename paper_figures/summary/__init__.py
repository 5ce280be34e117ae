"""Tool: the two-page summary of one plant, from its fit to its runs."""
