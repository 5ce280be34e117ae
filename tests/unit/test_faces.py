"""The faces of the rooms: their examples run, their names are there, and nothing is imported before it is asked for."""

from __future__ import annotations

import doctest
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest

from design.design_file import Design
from identification.model.model_file import IdentifiedModel

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("identification", "design", "experiments", "paper_figures")
SLOW = {"scipy", "numba", "pandas", "matplotlib", "control", "flint"}


@pytest.mark.parametrize("room", ROOMS)
def test_the_example_of_a_face_runs(room: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    found = doctest.testmod(import_module(room), optionflags=doctest.ELLIPSIS)
    assert found.failed == 0
    assert found.attempted >= 4


@pytest.mark.parametrize("room", ROOMS)
def test_every_name_of_a_face_is_there_and_documented(room: str) -> None:
    face = import_module(room)
    assert len(face.__all__) >= 2
    for name in face.__all__:
        assert getattr(face, name).__doc__, name
    assert face.__all__ == dir(face)
    with pytest.raises(AttributeError, match=f"module '{room}' has no attribute 'nothing'"):
        face.nothing  # noqa: B018


def test_a_notebook_shows_tables(implied: IdentifiedModel, extended_design: Design) -> None:
    assert "<td>zero mode 1, omega [rad/s]</td>" in implied._repr_html_()
    assert "standard error" in replace(implied, standard_errors=(1.0,) * 10)._repr_html_()
    assert "<th>corrected</th>" in extended_design._repr_html_()


def test_a_face_and_a_help_page_import_nothing_slow() -> None:
    code = (
        "import sys, identification, design, experiments, paper_figures\n"
        "from importlib import import_module\n"
        f"for room in {ROOMS}: import_module(room + '.__main__')\n"
        f"print(*{SLOW} & set(sys.modules))"
    )
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout.split() == []
