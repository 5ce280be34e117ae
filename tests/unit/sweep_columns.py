"""A response of ten lines, in every unit that a file may hold it in."""

from __future__ import annotations

import numpy as np

FREQUENCY_HZ = np.arange(1.0, 11.0)
RESPONSE = 10 ** (-FREQUENCY_HZ / 20) * np.exp(1j * np.radians(10 * FREQUENCY_HZ))
COLUMNS = {
    "frequency_hz": FREQUENCY_HZ,
    "omega": 2 * np.pi * FREQUENCY_HZ,
    "magnitude_db": 20 * np.log10(np.abs(RESPONSE)),
    "magnitude": np.abs(RESPONSE),
    "phase_deg": np.degrees(np.angle(RESPONSE)),
    "phase_rad": np.angle(RESPONSE),
    "real": RESPONSE.real,
    "imag": RESPONSE.imag,
}
