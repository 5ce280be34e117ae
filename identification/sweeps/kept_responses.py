"""Responses that were estimated once, kept in a .npz file and read from then on like sweeps."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from identification.base.errors import InputError
from identification.base.files import require_readable
from identification.sweeps.response import FrequencyResponse, LeftOut

CURVES = ("omega", "response", "coherence", "excitation")


def write_responses(path: Path, tests: Sequence[FrequencyResponse]) -> None:
    """Write tests, their raw records left out: the curves of test i as omega_i, response_i and so on,
    and those of its j-th lines that are left out as omega_i_j and response_i_j.
    """
    curves = {f"{name}_{i}": getattr(test, name) for i, test in enumerate(tests) for name in CURVES}
    for i, test in enumerate(tests):
        curves[f"left_out_{i}"] = np.array([lines.reason for lines in test.left_out], dtype=str)
        for j, lines in enumerate(test.left_out):
            curves[f"omega_{i}_{j}"], curves[f"response_{i}_{j}"] = lines.omega, lines.response
    with path.open("wb") as file:  # a path would get another suffix
        np.savez(
            file,
            allow_pickle=False,
            name=[test.name for test in tests],
            path=[str(test.path or "") for test in tests],
            synthetic=[test.synthetic for test in tests],
            conjugated=[test.conjugated for test in tests],
            remarks=["\n".join(test.remarks) for test in tests],
            **{name: curve for name, curve in curves.items() if curve is not None},
        )


def read_responses(path: Path) -> list[FrequencyResponse]:
    """Read what :func:`write_responses` wrote.

    Raises
    ------
    InputError
        The file is missing or of another kind.
    """
    require_readable(path)
    try:
        with zipfile.ZipFile(path) as archive:
            if any(each.compress_type != zipfile.ZIP_STORED for each in archive.infolist()):
                raise ValueError("compressed, which is never written, and may unpack to more than the memory holds")
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            content: dict[str, Any] = dict(kept)
        if any(np.iscomplexobj(curve) and not name.startswith("response_") for name, curve in content.items()):
            raise ValueError("complex where real numbers belong")
        return [
            FrequencyResponse(
                content[f"omega_{i}"],
                content[f"response_{i}"],
                content.get(f"coherence_{i}"),
                str(name),
                content.get(f"excitation_{i}"),
                synthetic=bool(content["synthetic"][i]),
                path=Path(str(content["path"][i])) if content["path"][i] else None,
                left_out=tuple(
                    LeftOut(content[f"omega_{i}_{j}"], content[f"response_{i}_{j}"], str(reason))
                    for j, reason in enumerate(content.get(f"left_out_{i}", ()))
                ),
                conjugated=bool(content["conjugated"][i]) if "conjugated" in content else False,
                remarks=tuple(str(content["remarks"][i]).splitlines()) if "remarks" in content else (),
            )
            for i, name in enumerate(content["name"])
        ]
    except (
        OSError,
        EOFError,
        ValueError,
        KeyError,
        TypeError,
        IndexError,
        RuntimeError,
        MemoryError,
        zipfile.BadZipFile,
    ):
        raise InputError(f"{path}: not the responses that 'identification fit --responses' keeps") from None
