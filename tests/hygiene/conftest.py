"""A copy of what is installed, to be built or spoiled."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("antiwindup", "identification", "design", "experiments", "paper_figures")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """The rooms, the thesis's numbers and what pyproject.toml names, in a folder of their own."""
    copy = tmp_path / "tree"
    for folder in (*ROOMS, "data/thesis", "tests/hygiene"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / file, copy / file)
    return copy
