"""Tool: nominal plant and frequency responses -> the additive bound W_a."""
