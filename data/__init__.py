"""What the project is run on: the thesis's printed numbers and synthetic sweeps."""
