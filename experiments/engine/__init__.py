"""Tool: a saturated loop with dead times -> its exact response."""
