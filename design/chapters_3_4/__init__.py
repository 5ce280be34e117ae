"""Tool: the extended (Smith predictor) design of chapters 3 and 4."""
