"""What a campaign keeps: its parts while it runs, so that it can go on, and one parquet file at the end."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from experiments.campaign.run_plants import CHUNK, Campaign, Columns
from identification.base.errors import InputError
from identification.base.files import read_text, write_whole

MANIFEST = "manifest.json"
PARTIAL = ".partial-"  # of a command that was killed while it wrote
RUNS = 3  # a plant
PARTS_A_GROUP = 80  # of the file's row groups: 6000 rows
SYNTHETIC = "plants drawn at random inside W_a, not measured"
PACKAGES = ("antiwindup-thesis", "numpy", "scipy", "numba", "pyarrow")
TOLD = ("synthetic", "kind", "design_sha256", "seed", "plants", "limit", "horizon_s")  # in the file's metadata
TEXTS, WHOLE, FLAGS = ("anti_windup",), ("plant", "events"), ("linear_stable", "diverged", "covered")


class CampaignFile:
    """The file of a campaign and the folder OUTPUT.parts beside it.

    Parameters
    ----------
    output
        The parquet file to write.
    campaign
        What its plants share.
    plants
        How many.
    source
        The file of the design, which is not written over.

    Raises
    ------
    InputError
        OUTPUT cannot be a file here, or OUTPUT.parts is there and not from the same campaign; nothing is touched.

    Notes
    -----
    Each part is written whole, so that what is there is good, however the command ended. A campaign is the same if
    its manifest is: design, seed, number of plants, reference, limit, length, chunk, the code of this package and the
    versions of the others that compute.
    """

    def __init__(self, output: Path, campaign: Campaign, plants: int, source: Path) -> None:
        self.output, self.folder = output, output.with_name(f"{output.name}.parts")
        chunks = [(first, min(first + CHUNK, plants)) for first in range(0, plants, CHUNK)]
        self._parts = {chunk: self.folder / f"part-{chunk[0] // CHUNK:06d}.parquet" for chunk in chunks}
        self._facts = {
            "synthetic": SYNTHETIC,
            "kind": campaign.design.kind,
            "design_sha256": campaign.design_sha256,
            "seed": campaign.seed,
            "plants": plants,
            "reference": json.loads(json.dumps(asdict(campaign.reference))),
            "limit": campaign.limit,
            "horizon_s": campaign.horizon_s,
            "chunk": CHUNK,
            "code_sha256": campaign.code_sha256,
            "versions": {name: version(name) for name in PACKAGES},
        }
        self._metadata = {name: str(self._facts[name]) for name in TOLD} | {
            "design": source.name,
            "version": str(version(PACKAGES[0])),
        }
        if output.resolve() == source.resolve():
            raise InputError(f"{output}: is an input too; expected another file to write")
        if output.exists() and not output.is_file():
            raise InputError(f"{output}: cannot be written; expected a file, found something else")
        if not output.parent.is_dir():
            raise InputError(f"{output.parent}: no such folder")
        if self.folder.is_dir() and all(path.name.startswith(PARTIAL) for path in self.folder.iterdir()):
            return
        if self.folder.exists():
            self._require_the_same()

    @property
    def missing(self) -> list[tuple[int, int]]:
        """The chunks of which there is no part that is whole, see :func:`experiments.campaign.run_plants.run_chunk`."""
        return [chunk for chunk, part in self._parts.items() if not _is_whole(part, chunk)]

    def keep(self, chunk: tuple[int, int], columns: Columns) -> None:
        """Write the part of one chunk."""
        from pyarrow import parquet

        if not (self.folder / MANIFEST).exists():
            self._begin()
        table = _table(columns)
        write_whole({self._parts[chunk]: lambda partial: parquet.write_table(table, partial)})

    def finish(self) -> None:
        """Put all parts into the file, in the order of the plants, PARTS_A_GROUP at a time, and remove them."""
        write_whole({self.output: self._join})
        for path in [*self._parts.values(), self.folder / MANIFEST, *self.folder.glob(f"{PARTIAL}*")]:
            path.unlink(missing_ok=True)
        with suppress(OSError):  # what is not ours in it stays
            self.folder.rmdir()

    def _join(self, partial: Path) -> None:
        import pyarrow
        from pyarrow import parquet

        parts = list(self._parts.values())
        schema = _read(parts[0]).schema.with_metadata(self._metadata)
        with parquet.ParquetWriter(partial, schema) as writer:
            for first in range(0, len(parts), PARTS_A_GROUP):
                tables = [_read(part) for part in parts[first : first + PARTS_A_GROUP]]
                writer.write_table(pyarrow.concat_tables(tables).cast(schema))

    def _begin(self) -> None:
        text = json.dumps(self._facts, indent=2) + "\n"
        try:
            self.folder.mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be made ({error.strerror})") from None
        write_whole({self.folder / MANIFEST: lambda partial: partial.write_text(text, encoding="utf-8")})

    def _require_the_same(self) -> None:
        manifest = self.folder / MANIFEST
        try:
            found = json.loads(read_text(manifest))
        except ValueError:
            found = None
        if not isinstance(found, dict):
            raise InputError(f"{self.folder}: is not the folder of a campaign; expected none, or one to go on with")
        for name, value in self._facts.items():
            if found.get(name) != value:
                there, here = _said(found.get(name), value), _said(value, found.get(name))
                raise InputError(
                    f"{self.folder}: holds the parts of another campaign, {name} {there} and not {here}; "
                    "give the same command to go on with it, or remove the folder"
                )


def _said(value: Any, other: Any) -> str:
    """A fact as a sentence gives it: of several numbers only those that differ."""
    if isinstance(value, dict) and isinstance(other, dict):
        return " ".join(f"{name} {number}" for name, number in value.items() if other.get(name) != number)
    return str(value)


def _table(columns: Columns) -> Any:
    import pyarrow

    kinds = {name: pyarrow.string() for name in TEXTS}
    kinds |= {name: pyarrow.int64() for name in WHOLE} | {name: pyarrow.bool_() for name in FLAGS}
    schema = pyarrow.schema([(name, kinds.get(name, pyarrow.float64())) for name in columns])
    return pyarrow.table(columns, schema=schema)


def _is_whole(part: Path, chunk: tuple[int, int]) -> bool:
    import pyarrow
    from pyarrow import parquet

    try:
        return bool(parquet.read_metadata(part).num_rows == RUNS * (chunk[1] - chunk[0]))
    except (pyarrow.ArrowException, OSError):
        return False


def _read(part: Path) -> Any:
    import pyarrow
    from pyarrow import parquet

    try:
        return parquet.read_table(part)
    except (pyarrow.ArrowException, OSError):
        raise InputError(
            f"{part}: cannot be read; expected a part of the campaign, remove it to run it again"
        ) from None
