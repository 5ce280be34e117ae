"""What a campaign keeps: its parts while it runs, so that it can go on, and one parquet file at the end."""

from __future__ import annotations

import json
import os
import re
from contextlib import suppress
from dataclasses import asdict
from hashlib import sha256
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import Any

import click

from experiments.campaign.run_plants import Campaign, Chunk, Columns
from experiments.campaign.seal import SEAL, Seal
from experiments.runs.code_hash import DISTRIBUTION, code_sha256
from identification.base.errors import InputError
from identification.base.files import read_bytes, read_text, require_writable, write_whole

MANIFEST = "manifest.json"
PARTIAL = ".partial-"  # of a command that was killed while it wrote
PART = re.compile(r"part-(\d+)-[0-9a-f]{64}\.parquet")
CHUNK, MOST_CHUNK = 25, 250  # plants that one task runs and a part holds
MOST_PARTS = 4000  # of a campaign whose chunks may grow: each costs a scheduler and a disk their time
PLANTS_A_GROUP = 2000  # of the file's rows
SYNTHETIC = "plants drawn at random inside W_a, not measured"
PACKAGES = (DISTRIBUTION, "numpy", "scipy", "numba", "pyarrow")
TOLD = ("synthetic", "kind", "design_sha256", "seed", "plants", "lower_limit", "limit", "rate_limit", "horizon_s")
"""What the file's metadata say."""
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
    anew
        Whether the parts of another campaign are removed; no other file of their folder is.

    Raises
    ------
    InputError
        OUTPUT cannot be a file here, or OUTPUT.parts is there and not from the same campaign; nothing is touched.

    Notes
    -----
    A campaign is the same if its manifest is: design, seed, number of plants, reference, limit, rate limit, length,
    chunk, the
    code of this package and the versions of the others that compute. The name of a part holds the hash of that
    manifest and of the part's content together, so that what is read is whole and of this campaign, or is run again.
    """

    def __init__(self, output: Path, campaign: Campaign, plants: int, source: Path, anew: bool = False) -> None:
        self.output, self.folder = output, output.with_name(f"{output.name}.parts")
        self._plants, self._chunk = plants, min(max(plants // MOST_PARTS, CHUNK), MOST_CHUNK)
        self._facts = {
            "synthetic": SYNTHETIC,
            "kind": campaign.design.kind,
            "design_sha256": campaign.design_sha256,
            "seed": campaign.seed,
            "plants": plants,
            "reference": json.loads(json.dumps(asdict(campaign.reference))),
            "lower_limit": campaign.limits[0],
            "limit": campaign.limits[1],
            "rate_limit": campaign.rate_limit,
            "horizon_s": campaign.horizon_s,
            "chunk": self._chunk,
            "code_sha256": code_sha256(),
            "versions": {name: version(name) for name in PACKAGES},
        }
        self._manifest = json.dumps(self._facts, indent=2) + "\n"
        self._metadata = {name: str(self._facts[name]) for name in TOLD} | {
            "design": source.name,
            "version": version(DISTRIBUTION),
        }
        require_writable(output, inputs=[source])
        self._parts: dict[int, Path] = {}
        if self.folder.exists():
            self._claim_folder(anew)
            self._parts = self._parts_of(self._manifest)

    @property
    def missing(self) -> list[Chunk]:
        """The chunks of which there is no part that is whole, see :func:`experiments.campaign.run_plants.run_chunk`."""
        firsts = range(0, self._plants, self._chunk)
        chunks = [(first, min(first + self._chunk, self._plants)) for first in firsts]
        return [chunk for number, chunk in enumerate(chunks) if number not in self._parts]

    def keep(self, chunk: Chunk, columns: Columns) -> None:
        """Write the part of one chunk."""
        from pyarrow import parquet

        if not (self.folder / MANIFEST).exists():
            self._begin()
        buffer = BytesIO()
        parquet.write_table(_table(columns), buffer)
        content, number = buffer.getvalue(), chunk[0] // self._chunk
        part = self.folder / _name(number, self._manifest, content)
        write_whole({part: content})
        self._parts[number] = part

    def finish(self) -> None:
        """Put all parts into the file, in the order of the plants, a group of rows at a time, and remove them."""
        write_whole({self.output: self._join})
        for path in [*self._parts.values(), self.folder / MANIFEST]:
            path.unlink(missing_ok=True)
        with suppress(OSError):
            self.folder.rmdir()
        if self.folder.exists():
            left = min(path.name for path in self.folder.iterdir())
            click.echo(f"{self.folder} is kept, since it holds {left}, which does not belong to the campaign", err=True)

    def _join(self, partial: Path) -> None:
        import pyarrow
        from pyarrow import parquet

        numbers, at_once = range(len(self._parts)), max(PLANTS_A_GROUP // self._chunk, 1)
        groups = [numbers[first : first + at_once] for first in numbers[::at_once]]
        schema = self._read(0).schema.with_metadata(self._metadata)
        seal = Seal(schema)
        for group in groups:
            for number in group:
                for batch in self._read(number).to_batches():
                    seal.update(batch)
        schema = schema.with_metadata(self._metadata | {SEAL: str(seal)})
        # Arrow takes no name that is not UTF-8
        with partial.open("wb") as opened, parquet.ParquetWriter(opened, schema) as writer:
            for group in groups:
                writer.write_table(pyarrow.concat_tables(map(self._read, group)).cast(schema))

    def _read(self, number: int) -> Any:
        from pyarrow import parquet

        path = self._parts[number]
        content = read_bytes(path)
        if path.name != _name(number, self._manifest, content):
            raise InputError(f"{path}: was changed during the run; give the same command to run this part again")
        return parquet.read_table(BytesIO(content))

    def _parts_of(self, manifest: str) -> dict[int, Path]:
        """The whole parts of the campaign with a manifest, by their numbers."""
        parts = {}
        for path in self.folder.iterdir():
            found = PART.fullmatch(path.name)
            with suppress(OSError):  # what cannot be read is run again
                if found and path.name == _name(int(found[1]), manifest, path.read_bytes()):
                    parts[int(found[1])] = path
        return parts

    def _begin(self) -> None:
        try:
            self.folder.mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be made ({error.strerror})") from None
        write_whole({self.folder / MANIFEST: self._manifest})

    def _claim_folder(self, anew: bool) -> None:
        if not (self.folder.is_dir() and os.access(self.folder, os.W_OK | os.X_OK)):
            raise InputError(f"{self.folder}: cannot be written; expected a folder that may be written to, or none")
        if all(path.name.startswith(PARTIAL) for path in self.folder.iterdir()):
            return None
        try:
            found = json.loads(text := read_text(self.folder / MANIFEST))
        except ValueError:
            found = None
        if not isinstance(found, dict):
            raise InputError(f"{self.folder}: is not the folder of a campaign; expected one, or no such folder")
        for name, value in self._facts.items():
            if found.get(name) != value and anew:
                return self._remove_parts(text)
            if found.get(name) != value:
                there, here = _said(found.get(name), value), _said(value, found.get(name))
                raise InputError(
                    f"{self.folder}: holds the parts of another campaign, {name} {there} and not {here}; "
                    "give the same command as then to continue it, or --anew to remove them"
                )
        return None

    def _remove_parts(self, manifest: str) -> None:
        for path in self._parts_of(manifest).values():
            path.unlink(missing_ok=True)
        (self.folder / MANIFEST).unlink(missing_ok=True)


def _name(number: int, manifest: str, content: bytes) -> str:
    """The name of a part, by which it is known to be whole and of its campaign."""
    return f"part-{number:06d}-{sha256(manifest.encode() + content).hexdigest()}.parquet"


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
