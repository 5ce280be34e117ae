"""Tool: frequency responses -> the nominal plant."""
