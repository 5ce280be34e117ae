"""Tool: arrays, errors, files and the command line, which every wing uses."""
