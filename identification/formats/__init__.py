"""Tool: CSV, MAT and universal files -> tables of columns."""
