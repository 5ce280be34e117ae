"""A response of ten lines, in every unit that a file may hold it in; files damaged at random."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from identification.base.errors import InputError
from identification.sweeps.read_sweeps import read_sweeps

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


def require_sentence_after_damage(path: Path, data: st.DataObject) -> None:
    """A file with some bytes changed, or cut off, is read or refused in one sentence that begins with its path."""
    content = bytearray(path.read_bytes())
    for place, byte in data.draw(
        st.lists(st.tuples(st.integers(0, len(content) - 1), st.integers(0, 255)), max_size=4)
    ):
        content[place] = byte
    damaged = path.with_stem("damaged")
    damaged.write_bytes(content[: data.draw(st.integers(0, len(content)))] if data.draw(st.booleans()) else content)
    try:
        read_sweeps([damaged])
        sentence = str(damaged)
    except InputError as refusal:
        sentence = str(refusal)
    assert sentence.startswith(str(damaged))
    assert len(sentence.splitlines()) == 1
