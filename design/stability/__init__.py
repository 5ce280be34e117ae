"""Tool: loops with a dead time: characteristic roots, margins, stable intervals."""
