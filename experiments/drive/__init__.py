"""Tool: the same controller on a computer with a sampled, quantised, slewing actuator."""
