"""`make refit` with stand-ins for the commands: a refusal stops only what hangs on it, and nothing old stays."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
Make = Callable[..., subprocess.CompletedProcess[str]]

# Writes what the command of the same words would; refuses, or crashes, if a file of that name lies beside it.
STAND_IN = r"""#!/bin/bash
here=$(dirname "$0") said="$*" room=$2
shift 2
[ "$1" != --refusal ] || { refusal=$2; rm -f "$refusal"; shift 2; }
[ "$1" != thesis ] || shift
command=$1 output=${!#}
[ "$command" != draw ] || {
    command=$2
    for table in $(sed -n "s/^TABLES-$2 := //p" build/prerequisites.mk); do
        [ -e "$4/$table.csv" ] || exit 0
    done
}
for input; do
    case $input in "$output") ;; *.json | *.parquet) [ -z "$refusal" ] || [ -e "$input" ] || exit 0 ;; esac
done
if [ -e "$here/$command.refuses" ]; then
    echo "Error: $command will not" >&2
    [ -n "$refusal" ] || exit 2
    echo "$command will not" > "$refusal"
    exit
fi
if [ -e "$here/$command.crashes" ]; then echo "Traceback of $command" >&2; exit 1; fi
echo "$said" >> "$here/log"
case $room in
identification) touch "${output%/*}/model.json" "$output" ;;
design) touch "$output" ;;
experiments)
    [ $command != campaign ] || { touch "$output"; exit; }
    name=${command//-/_}
    [ $command != campaign-tables ] || { name=campaign; touch "$output/campaign_distance.csv"; }
    [ $command != limits ] || name=limits_$(basename "$2" .json | sed s/design_//)
    [ $command != sampled-rates ] || name=sampled
    [ $command != interpolation ] || touch "$output/interpolation_map.csv"
    touch "$output/$name.csv" "$output/${name}_summary.csv" ;;
paper_figures) [ $command = summary ] && stem=$output/summary || stem=$output/$command
    touch "$stem.pdf" "$stem.svg" "$stem.png" "$stem.txt" ;;
esac
"""


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """`make` with the stand-in for Python, its output below ``tmp_path / "mine"``."""
    python = tmp_path / "python"
    python.write_text(STAND_IN, encoding="utf-8")
    python.chmod(0o755)
    own = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")}
    for name in ("a.csv", "ready"):
        (tmp_path / name).touch()
    common = [
        "make",
        f"PY={python}",
        f"READY={tmp_path / 'ready'}",
        f"OUT={tmp_path / 'mine'}",
        f"SWEEPS={tmp_path / 'a.csv'}",
    ]

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*common, *arguments], cwd=ROOT, env=own, capture_output=True, text=True, check=False)

    return run


def built(tmp_path: Path) -> set[str]:
    """Everything below mine but for choice.txt, one format a figure."""
    mine = tmp_path / "mine"
    files = {str(path.relative_to(mine)) for path in mine.rglob("*") if path.is_file()}
    return {name for name in files if not name.endswith((".svg", ".png"))} - {"choice.txt"}


def log(tmp_path: Path) -> str:
    return (tmp_path / "log").read_text(encoding="utf-8")


def test_all_is_made_and_then_nothing_is_left_to_do(make: Make, tmp_path: Path) -> None:
    first = make("refit", "FIT=--modes 1")
    assert first.returncode == 0, first.stderr
    names = built(tmp_path)
    assert {"model.json", "design_delay_free.json", "design_extended.json", "summary.pdf", "summary.txt"} <= names
    assert {f"figures/fig_{n}.pdf" for n in ("2_09", "2_10", "2_14", "4_01", "4_04")} <= names
    assert not any("refused" in name for name in names)
    assert f"identification fit {tmp_path}/a.csv --modes 1 --output" in log(tmp_path)
    assert f"summary {tmp_path}/mine/model.json {tmp_path}/mine/responses.npz --build {tmp_path}/mine" in log(tmp_path)
    before = log(tmp_path)
    assert make("refit", "FIT=--modes 1").returncode == 0
    assert log(tmp_path) == before
    assert make("refit", "FIT=--modes 2").returncode == 0
    assert log(tmp_path).count("identification fit") == 2


def test_a_refused_design_takes_only_what_hangs_on_it(make: Make, tmp_path: Path) -> None:
    make("refit")
    everything = built(tmp_path)
    (tmp_path / "extended.refuses").touch()
    (tmp_path / "b.csv").touch()
    refused = make("refit", f"SWEEPS={tmp_path / 'b.csv'}")
    assert refused.returncode == 0
    assert "***" not in refused.stdout + refused.stderr
    gone = everything - built(tmp_path)
    assert gone == {
        *("design_extended.json", "design_robust.json", "results/interpolation_map.csv"),
        *("results/campaign.parquet", "results/campaign_distance.csv"),
        *(
            f"results/{name}{part}.csv"
            for name in (
                "extended",
                "f_gamma",
                "trade_off",
                "interpolation",
                "robustness",
                "limits_extended",
                "sampled",
                "campaign",
            )
            for part in ("", "_summary")
        ),
        *(
            f"figures/fig_{n}.{kind}"
            for n in ("2_10", "2_11", "4_01", "4_02", "4_03", "4_04", "a_01", "a_02", "a_03", "a_04", "a_05", "a_06")
            for kind in ("pdf", "txt")
        ),
    }
    sentence = tmp_path / "mine" / "design_extended.refused.txt"
    assert sentence.read_text(encoding="utf-8") == "extended will not\n"
    (tmp_path / "extended.refuses").unlink()
    assert make("refit", f"SWEEPS={tmp_path / 'b.csv'}").returncode == 0
    assert built(tmp_path) == everything


def test_a_refused_simulation_leaves_its_design(make: Make, tmp_path: Path) -> None:
    (tmp_path / "f-gamma.refuses").touch()
    assert make("refit").returncode == 0
    names = built(tmp_path)
    assert {"design_extended.json", "results/f_gamma.refused.txt", "figures/fig_4_01.pdf", "summary.pdf"} <= names
    assert not names & {"figures/fig_2_10.pdf", "figures/fig_2_11.pdf"}
    (tmp_path / "extended.refuses").touch()
    assert make("refit", "FIT=--modes 1").returncode == 0
    assert "results/f_gamma.refused.txt" not in built(tmp_path)


def test_a_refused_campaign_has_no_tables_and_an_old_one_is_not_gone_on_with(make: Make, tmp_path: Path) -> None:
    (tmp_path / "campaign.refuses").touch()
    parts = tmp_path / "mine" / "results" / "campaign.parquet.parts"
    parts.mkdir(parents=True)
    (parts / "manifest.json").touch()
    assert make("refit").returncode == 0
    names = built(tmp_path)
    assert {"results/campaign.refused.txt", "figures/fig_a_05.pdf", "summary.pdf"} <= names
    assert not any("fig_a_06" in name or name.startswith("results/campaign.parquet") for name in names)
    assert not names & {"results/campaign.csv", "results/campaign_distance.csv", "results/campaign_summary.csv"}


def test_a_crash_is_no_refusal(make: Make, tmp_path: Path) -> None:
    (tmp_path / "delay-free.crashes").touch()
    result = make("refit")
    assert result.returncode == 2
    assert "Traceback of delay-free" in result.stderr
    assert "summary.pdf" not in built(tmp_path)


def test_a_refused_fit_stops_everything_and_nothing_old_stays(make: Make, tmp_path: Path) -> None:
    make("refit")
    (tmp_path / "fit.refuses").touch()
    result = make("refit", "FIT=--modes 1")
    assert result.returncode == 2
    assert "Error: fit will not" in result.stderr
    assert built(tmp_path) == set()


def test_figures_fails_when_a_design_refuses(make: Make, tmp_path: Path) -> None:
    (tmp_path / "extended.refuses").touch()
    result = make("figures", f"BUILD={tmp_path / 'mine'}")
    assert result.returncode == 2
    assert "Error: extended will not" in result.stderr
    assert not any("refused" in name for name in built(tmp_path))


def test_the_files_of_a_folder_count_whatever_their_names(make: Make, tmp_path: Path) -> None:
    folder = tmp_path / "sweeps"
    folder.mkdir()
    (folder / "day 1: cold.CSV").touch()
    goal = ["-q", f"BUILD={tmp_path / 'mine'}", f"SWEEPS={folder}", str(tmp_path / "mine" / "model.json")]
    assert make("refit", f"SWEEPS={folder}").returncode == 0
    assert make(*goal).returncode == 0
    (folder / "notes.txt").touch()
    assert make(*goal).returncode == 0
    for change in (
        (folder / "day 1: cold.CSV").touch,
        (folder / "day 2.mat").touch,
        (folder / "day 2.mat").unlink,
    ):
        change()
        assert make(*goal).returncode == 1
        assert make("refit", f"SWEEPS={folder}").returncode == 0
        assert make(*goal).returncode == 0
