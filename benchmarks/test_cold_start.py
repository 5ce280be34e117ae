"""A first figure in a fresh process, its design at hand and caches warm, against the import of python-control."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from data.thesis import model_named
from design.chapters_3_4.design_extended import design_extended

PROCESSES = 5

SIMULATE = """
import sys
from pathlib import Path
from design.design_file import read_design
from experiments.thesis.studies.chapter_4 import extended_tables
tables = extended_tables(read_design(Path(sys.argv[1])), 12.0)
"""

DRAW = f"""{SIMULATE}
from paper_figures.thesis.figures import fig_4_03
from paper_figures.look.style import styled
with styled():
    fig_4_03.draw(tables).savefig(sys.argv[2])
"""


@pytest.fixture(scope="module")
def design_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("cold") / "design.json"
    model = model_named("implied")
    design = design_extended(model, [1.5], 4.0, [(2.0, 1.0)])
    path.write_text(design.to_json(), encoding="utf-8")
    return path


@pytest.mark.parametrize("program", [SIMULATE, DRAW], ids=["simulated", "drawn"])
def test_first_figure(against: Callable[..., None], design_file: Path, program: str) -> None:
    """The five runs behind Fig. 4.3, without and with the figure as PNG."""

    def process(*arguments: str) -> None:
        subprocess.run([sys.executable, *arguments], check=True, cwd=Path(__file__).resolve().parents[1])

    against(
        lambda: process("-c", program, str(design_file), str(design_file.with_suffix(".png"))),
        lambda: process("-c", "import control"),
        rounds=PROCESSES,
        our_rounds=PROCESSES,
        error=lambda _ours, _theirs: "peer: import control",
    )
