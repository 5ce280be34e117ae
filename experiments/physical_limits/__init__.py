"""Tool: the least peak error that any controller reaches under the limits."""
