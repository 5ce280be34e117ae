"""The paths that a command line is given: outputs are looked at before the command reads or computes anything."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from identification.base.files import require_folder, require_writable

FIGURE_KINDS = (".pdf", ".svg", ".png")
"""How the name of a figure's file may end, which says what it is."""


class _Path(click.Path):
    """A path that is not empty: an empty one would be the current folder."""

    def __init__(self, **allowed: bool) -> None:
        super().__init__(path_type=Path, readable=False, **allowed)  # who reads says what is wrong

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        if not str(value):
            self.fail("the path is empty; expected a name", param, ctx)
        return Path(os.fsdecode(super().convert(value, param, ctx)))


class _OutputFile(_Path):
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = super().convert(value, param, ctx)
        require_writable(path)
        return path


class _FigureFile(_OutputFile):
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = super().convert(value, param, ctx)
        if path.suffix.lower() not in FIGURE_KINDS:
            found = f"ends in '{path.suffix}'" if path.suffix else "has no ending"
            self.fail(f"'{path}' {found}; expected {', '.join(FIGURE_KINDS[:-1])} or {FIGURE_KINDS[-1]}", param, ctx)
        return path


class _OutputFolder(_Path):
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = super().convert(value, param, ctx)
        require_folder(path)
        return path


INPUT = _Path()
"""A file or a folder to read."""
INPUT_FILE = _Path(dir_okay=False)
"""A file to read."""
OUTPUT_FILE = _OutputFile(dir_okay=False)
"""A file to write."""
FIGURE_FILE = _FigureFile(dir_okay=False)
"""A figure to write."""
OUTPUT_FOLDER = _OutputFolder(file_okay=False)
"""An existing folder to write into."""
