"""Designs -> saturated closed loops with an exact dead time -> the tables behind every figure."""
