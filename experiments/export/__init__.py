"""Tool: the controller of a design as code and data for the computer that is to run it."""
