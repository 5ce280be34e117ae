"""Tool: the summary on one page of one plant, from its fit to its runs."""
