"""The README is short, its examples run on the shipped synthetic tests, and its picture has the numbers it gives."""

from __future__ import annotations

import re
import runpy
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread

from antiwindup.__main__ import main
from design.design_file import Design
from identification.model.model_file import read_model

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
PICTURE = ROOT / "docs/images/windup.py"


def example(language: str) -> list[str]:
    (block,) = re.findall(rf"^```{language}\n(.*?)^```", TEXT, flags=re.MULTILINE | re.DOTALL)
    return [line for line in block.splitlines() if line]


def test_it_is_short() -> None:
    """Words are what blanks and line breaks part, in tables and code too."""
    assert len(TEXT.split()) <= 1200
    assert (len(example("sh")), len(example("python"))) == (6, 8)


def test_its_examples_run_and_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for number, day in enumerate(("monday", "tuesday", "wednesday"), 1):
        shutil.copy(ROOT / f"data/elevation/synthetic_test_{number}_frf.csv", f"{day}.csv")
    for line in example("sh"):
        command, *words = shlex.split(line)
        assert command == "antiwindup"
        done = CliRunner().invoke(main, words)
        assert done.exit_code == (1 if words[0] == "check" else 0), done.output  # a third test lies outside W_a of two
    names: dict[str, object] = {}
    exec("\n".join(example("python")), names)
    own = names["own"]
    assert isinstance(own, Design)
    assert own.loop_plant == read_model("model.json").plant
    written = {path.name for path in tmp_path.iterdir()}
    assert {"design.json", "run.csv", "controller.c", "run.pdf"} < written


def test_its_picture_is_the_current_one_and_has_its_numbers() -> None:
    made = runpy.run_path(str(PICTURE))
    runs, target = made["runs"](), made["MOVE"]
    highest = {name: float(run.outputs["output"].max()) for name, run in runs.items()}
    outside = {name: run.time_s[np.abs(run.outputs["error"]) > 0.01 * target][-1] for name, run in runs.items()}
    text = " ".join(TEXT.split())
    assert f"overshoots to {highest['none']:.0f} degrees" in text
    assert highest["corrected"] < 1.01 * target
    assert f"only after {outside['none']:.1f} s." in text
    assert f"it stops there after {outside['corrected']:.1f} s" in text

    figure = made["picture"]()
    figure.set_dpi(made["DPI"])
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = np.asarray(canvas.buffer_rgba())[..., :3] / 255
    kept = imread(PICTURE.with_suffix(".png"))[..., :3]
    assert drawn.shape == kept.shape
    assert np.mean(np.abs(drawn - kept) > 0.1) < 0.002  # letters may be smoothed otherwise
