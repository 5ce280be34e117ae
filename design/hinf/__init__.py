"""Tool: the H-infinity problem of mixed sensitivity, solved by Nevanlinna-Pick interpolation."""
