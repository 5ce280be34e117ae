"""Tool: a local page with sliders for a design, its saturated run, Nyquist plot, step and audit."""
