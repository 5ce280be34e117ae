"""Runs and designs -> figures, captions, the summary of a plant, and the thesis's figures and report."""
