"""Tool: rational transfer functions with a dead time, their state spaces and norms."""
