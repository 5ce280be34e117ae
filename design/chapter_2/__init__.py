"""Tool: the delay-free design of chapter 2."""
