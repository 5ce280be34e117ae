"""Tool: the plant, its structure, its bound, and model.json."""
