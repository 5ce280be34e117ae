"""The Makefile builds into an empty folder, does nothing the second time, and refuses what is not there."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def make(*arguments: str) -> subprocess.CompletedProcess[str]:
    own = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")}
    return subprocess.run(["make", *arguments], cwd=ROOT, env=own, capture_output=True, text=True, check=False)


@pytest.fixture
def build(tmp_path: Path) -> Path:
    return tmp_path / "build"


def test_from_nothing_then_nothing_to_do(build: Path) -> None:
    table, figure = build / "results" / "pid.csv", build / "figures" / "fig_2_02.pdf"
    goal = ["MODEL=implied", f"BUILD={build}", str(figure)]
    assert not build.exists()
    first = make(*goal)
    assert first.returncode == 0, first.stderr
    assert all(figure.with_suffix(suffix).stat().st_size > 0 for suffix in (".pdf", ".svg", ".png", ".txt"))
    assert table.exists()
    second = make(*goal)
    assert second.returncode == 0
    assert "up to date" in second.stdout
    assert make("-q", *goal).returncode == 0
    # another model rebuilds what is for a model, and the benchmark is for none
    assert make("-q", "MODEL=table", f"BUILD={build}", str(figure)).returncode == 0
    assert make("-q", "MODEL=table", f"BUILD={build}", str(build / "design_extended.json")).returncode == 1


def test_a_dry_run_makes_nothing(build: Path) -> None:
    result = make("-n", "MODEL=implied", f"BUILD={build}", str(build / "figures" / "fig_2_01.pdf"))
    assert result.returncode == 0, result.stderr
    assert "paper_figures draw fig_2_01" in result.stdout
    assert not build.exists()


@pytest.mark.parametrize(
    ("arguments", "part"),
    [(["SWEEPS=nowhere.csv"], "nowhere.csv: no such file"), (["MODEL=nowhere.json"], "nowhere.json: no such file")],
)
def test_missing_files_are_refused_before_anything_is_made(build: Path, arguments: list[str], part: str) -> None:
    result = make("figures", f"BUILD={build}", *arguments)
    assert result.returncode == 2
    assert part in result.stderr
    assert not build.exists()


def test_every_target_is_in_the_help() -> None:
    text = make("help").stdout
    assert all(
        f"\n{name} " in f"\n{text}"
        for name in [
            "help",
            "figures",
            "report",
            "refit",
            "claims",
            "test",
            "bench",
            "study",
            "referee",
            "lint",
            "clean",
        ]
    )


def test_the_report_draws_every_figure_and_judges_the_ledger_first(build: Path) -> None:
    result = make("-n", "MODEL=implied", f"BUILD={build}", "report")
    assert result.returncode == 0, result.stderr
    steps = result.stdout
    assert all(
        f"draw {path.stem} " in steps for path in (ROOT / "paper_figures" / "thesis" / "figures").glob("fig_*.py")
    )
    assert "experiments thesis claims" in steps
    assert "paper_figures report implied data/elevation/" in steps.splitlines()[-1]
    assert not build.exists()
