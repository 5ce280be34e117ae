"""Tool: style, panels and captions of every figure."""
