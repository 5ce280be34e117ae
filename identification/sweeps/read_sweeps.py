"""Files of sweeps -> the frequency response of each test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from identification.base.errors import printable
from identification.base.files import require_readable
from identification.formats.columns import Table
from identification.formats.csv_file import read_csv
from identification.formats.first_bytes import usual_suffix
from identification.formats.reading import Reading
from identification.formats.uff_file import read_uff
from identification.sweeps.from_table import from_record, from_response
from identification.sweeps.input_files import CSV, MAT, UFF, input_files
from identification.sweeps.kept_responses import read_responses
from identification.sweeps.response import FrequencyResponse

KEPT = ".npz"


def _read_mat(path: Path, reading: Reading) -> list[Table]:
    from identification.formats.mat_file import read_mat  # h5py and scipy.io take a tenth of a second

    return read_mat(path, reading)


READERS = {**dict.fromkeys(CSV, read_csv), **dict.fromkeys(MAT, _read_mat), **dict.fromkeys(UFF, read_uff)}


def read_sweeps(paths: Path | str | Sequence[Path | str], reading: Reading | None = None) -> list[FrequencyResponse]:
    """Read the tests of a file, or of files and folders (see :func:`input_files`), in their order.

    ``reading`` says what the files do not say themselves.

    A file that ends in .npz holds responses that were estimated before, see
    :mod:`identification.sweeps.kept_responses`; they keep their names and the paths that they came from. Every other
    file holds frequency responses or raw records: a MAT or universal file if it begins as such a file does, or its
    name ends in .mat, .uff, .unv, .ufb or .58, and else a CSV. Its columns, in a MAT file its variables, say what
    they are by their names: frequency_hz or omega (rad/s); magnitude_db or magnitude, with phase_deg or phase_rad;
    or real, imag; or response, which is complex; and coherence if there is one. A raw record has time_s, output, and
    input (band-limited like the output before both are sampled) or input_held (the command of a converter that holds
    it for one interval). A column ``test`` tells several tests apart. They may also be spelt as other tools do, see
    :mod:`identification.formats.spellings`. See :mod:`identification.sweeps.from_table` for what becomes of a table.

    A test with the frequencies and the response of one before is the same measurement and is left out, with a remark
    on the one before.

    Raises
    ------
    InputError
        A file cannot be read, lacks a column, or holds numbers that cannot be a sweep's; the sentence names
        the file, the line, the test, what was found and what was expected.
    """
    files = input_files([paths] if isinstance(paths, Path | str) else paths)
    reading = reading or Reading()
    tests: list[FrequencyResponse] = []
    for file, name in zip(files, _names(files), strict=True):
        require_readable(file)
        if file.suffix.lower() == KEPT:
            tests += read_responses(file)
            continue
        suffix = usual_suffix(file) or file.suffix.lower()
        for table in READERS.get(suffix, read_csv)(file, reading):
            label = name if table.test is None else f"{name}, test {table.test}"
            is_record = "time_s" in table.columns
            tests.append(
                from_record(table, label, resample=reading.resample) if is_record else from_response(table, label)
            )
    return _without_copies(tests)


def _without_copies(tests: Sequence[FrequencyResponse]) -> list[FrequencyResponse]:
    """The tests without those that are another bit for bit: no two measurements have the same noise."""
    kept: dict[bytes, FrequencyResponse] = {}
    for test in tests:
        content = sha256(np.ascontiguousarray(test.omega).data)
        content.update(np.ascontiguousarray(test.response).data)
        if (first := kept.get(content.digest())) is None:
            kept[content.digest()] = test
        else:
            remark = f"{test.name} is the same measurement and was left out"
            kept[content.digest()] = replace(first, remarks=(*first.remarks, remark))
    return list(kept.values())


def _names(files: Sequence[Path]) -> list[str]:
    """Each file's base name, printable, with as many of its folders as tell it from the others of that name."""
    names = []
    for file in files:
        parts = file.absolute().parts
        others = [other.absolute().parts for other in files if other != file and other.name == file.name]
        length = 1
        while any(other[-length:] == parts[-length:] for other in others):
            length += 1
        names.append(printable("/".join((*parts[-length:-1], file.name))))
    return names
