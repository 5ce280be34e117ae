"""Read what the report is made of: model, sweeps, designs, figures, tables and ledger, with the hash of every file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from io import StringIO
from pathlib import Path
from typing import TypeVar

import pandas as pd

from data.thesis import THESIS
from design.asked_model import asked_model
from design.design_file import Design
from identification.base.errors import InputError, shown
from identification.base.files import is_file, read_bytes
from identification.base.manifest import require_as_written
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel
from identification.sweeps.as_fitted import as_fitted
from identification.sweeps.input_files import input_files
from identification.sweeps.read_sweeps import KEPT, read_sweeps
from identification.sweeps.response import FrequencyResponse
from paper_figures.thesis.report.of_designs import FOLLOWING

Kind = TypeVar("Kind")

LEDGER = (
    *("id", "where", "printed", "computed", "unit", "tolerance", "verdict", "touches", "kind"),
    *("quote", "reason", "evidence"),
)
"""The columns of the ledger that the report shows, in its order."""

KINDS = {"delay_free": "delay-free", "extended": "extended", "robust": "extended"}
"""The kind of each of the designs."""

SOURCES = ("data/thesis/thesis.toml", "data/thesis/claims.csv", "requirements.lock")
"""Files of the project that everything rests on; those that an installation lacks are left out."""


@dataclass(frozen=True)
class Picture:
    """A drawn figure and its caption."""

    svg: bytes
    caption: str


@dataclass(frozen=True)
class Inputs:
    """What the report is made of.

    Parameters
    ----------
    model_name
        ``table``, ``implied`` or the name of the model's file.
    model
        The model that designs and experiments are for.
    tests
        The sweeps.
    designs, outcomes
        Name -> the design, or the summary of the experiment; or the sentence with which it was refused.
    ledger
        The recomputed ledger, every cell as text.
    figures
        Name -> picture, or the sentence that says why there is none; in the order of the thesis.
    figure_tables
        Name of a figure -> the names of the tables that it draws and that are there.
    tables
        Name -> text of each of them, and of the ledger as ``claims``.
    hashes
        Name and SHA-256 of every file that was read, the pictures apart.
    files
        The paths of all that was read.
    """

    model_name: str
    model: IdentifiedModel
    tests: Sequence[FrequencyResponse]
    designs: Mapping[str, Design | str]
    outcomes: Mapping[str, pd.DataFrame | str]
    ledger: pd.DataFrame
    figures: Mapping[str, Picture | str]
    figure_tables: Mapping[str, tuple[str, ...]]
    tables: Mapping[str, str]
    hashes: tuple[tuple[str, str], ...]
    files: tuple[Path, ...]


def read_inputs(
    model: str,
    sweeps: Sequence[Path],
    build: Path,
    figures: Mapping[str, tuple[str, ...]],
    designs: Mapping[str, Design | str],
    outcomes: Mapping[str, pd.DataFrame | str],
) -> Inputs:
    """Read what is not yet read.

    Parameters
    ----------
    model
        A model.json, or the word ``table`` or ``implied``.
    sweeps
        Files and folders of tests.
    build
        Folder with ``claims.csv``, the designs, ``results`` and ``figures``.
    figures
        Name of each figure -> the tables it draws.
    designs, outcomes
        As in :class:`Inputs`.

    Raises
    ------
    InputError
        A file is missing that no refusal accounts for, is not what it should be, is of another model, or was changed
        since the manifest of ``build`` was written.
    """
    hashes: list[tuple[str, str]] = []
    files: list[Path] = []

    def read(path: Path, name: str) -> str:
        content = read_bytes(path)
        files.append(path)
        hashes.append((name, sha256(content).hexdigest()))
        return _decoded(content, path)

    def without_path(found: Mapping[str, Kind | str]) -> dict[str, Kind | str]:
        return {name: each.replace(f"{build}/", "") if isinstance(each, str) else each for name, each in found.items()}

    designs, outcomes = without_path(designs), without_path(outcomes)
    identified = asked_model(model)
    tests = as_fitted(identified, read_sweeps(sweeps))
    files += dict.fromkeys([*(test.path for test in tests if test.path), *input_files(sweeps)])
    hashes += [(path.name, sha256(read_bytes(path)).hexdigest()) for path in files if path.suffix != KEPT]
    for source in SOURCES:
        if is_file(path := THESIS.parent.parent / source):
            read(path, source)
    if is_file(Path(model)):
        read(Path(model), Path(model).name)
    for name in FOLLOWING:
        path = build / f"design_{name}.json"
        if name not in designs:
            raise InputError(f"{path}: no such file; expected a design, or the sentence that refused it")
        if isinstance(design := designs[name], Design):
            _require_of_model(path, design, KINDS[name], identified.plant)
            read(path, path.name)
    pictures = {name: _picture(build, name, tables, designs, outcomes) for name, tables in figures.items()}
    paths = {table: build / "results" / f"{table}.csv" for tables in figures.values() for table in tables}
    held = {
        name: tuple(table for table in tables if isinstance(pictures[name], Picture) or is_file(paths[table]))
        for name, tables in figures.items()
    }
    wanted = dict.fromkeys(table for tables in held.values() for table in tables)
    texts = {table: read(paths[table], f"results/{table}.csv") for table in wanted}
    for table, text in texts.items():
        if len(text.splitlines()) < 2:
            raise InputError(f"{paths[table]}: holds a header and no rows; expected one or more")
    texts["claims"] = read(build / "claims.csv", "claims.csv")
    ledger = _ledger(texts["claims"], build / "claims.csv")
    files += [build / "figures" / f"{name}.{kind}" for name in figures for kind in ("svg", "txt")]
    require_as_written(build, files)
    return Inputs(
        model if model in ("table", "implied") else Path(model).name,
        identified,
        tests,
        designs,
        outcomes,
        ledger,
        pictures,
        held,
        texts,
        tuple(hashes),
        tuple(files),
    )


def _require_of_model(path: Path, design: Design, kind: str, plant: PlantModel) -> None:
    if design.kind != kind:
        raise InputError(f"{path}: kind is '{design.kind}'; expected '{kind}'")
    if design.plant != plant:
        gains = f"{design.plant.gain:g}; expected one for the model, whose gain is {plant.gain:g}"
        raise InputError(f"{path}: is for a plant of gain {gains}")


def experiment_of(table: str) -> str:
    """The experiment that writes a table: the longest name in ``FOLLOWING`` that the table's begins with, or none."""
    experiments = [name for names in FOLLOWING.values() for name in names]
    return max((name for name in experiments if f"{table}_".startswith(f"{name}_")), key=len, default="")


def _picture(
    build: Path,
    name: str,
    tables: Sequence[str],
    designs: Mapping[str, Design | str],
    outcomes: Mapping[str, pd.DataFrame | str],
) -> Picture | str:
    """A drawn figure, or the sentence that refused what it would show."""
    svg, caption = (build / "figures" / f"{name}.{kind}" for kind in ("svg", "txt"))
    if is_file(svg) and is_file(caption):
        picture = read_bytes(svg)
        if b"<svg" not in picture:
            raise InputError(f"{svg}: no SVG picture; expected what 'python -m paper_figures draw {name}' writes")
        return Picture(picture, _decoded(read_bytes(caption), caption).strip())
    for experiment in map(experiment_of, tables):
        needed = [designs[design] for design, names in FOLLOWING.items() if experiment in names]
        for outcome in (outcomes.get(experiment), *needed):
            if isinstance(outcome, str):
                return outcome
    missing = caption if is_file(svg) else svg
    raise InputError(f"{missing}: no such file; expected what 'python -m paper_figures draw {name}' writes")


def _ledger(text: str, path: Path) -> pd.DataFrame:
    try:
        ledger = pd.read_csv(StringIO(text), dtype=str, keep_default_na=False)
    except (pd.errors.ParserError, pd.errors.EmptyDataError):
        raise InputError(f"{path}: is not a table of comma-separated values") from None
    lacking = [column for column in LEDGER if column not in ledger.columns]
    if lacking:
        raise InputError(
            f"{path}: no column {', '.join(lacking)}; expected what 'python -m experiments thesis claims' writes"
        )
    if ledger.empty:
        raise InputError(f"{path}: holds a header and no rows; expected one or more")
    for column in ("computed", "tolerance"):
        cells = ledger[column][ledger[column] != ""]
        if (words := cells[pd.to_numeric(cells, errors="coerce").isna()]).any():
            raise InputError(f"{path}: {shown(words.iloc[0])} in the column {column}; expected a number or nothing")
    if (again := ledger["id"][ledger["id"].duplicated()]).any():
        raise InputError(f"{path}: the id {again.iloc[0]} occurs in several rows; expected each once")
    return ledger


def _decoded(content: bytes, path: Path) -> str:
    """The text of a file with its line ends as they are."""
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start} is not UTF-8; expected a text file") from None
