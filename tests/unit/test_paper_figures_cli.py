"""The command line of the figures: what it writes, and how it answers input it cannot use."""

from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from matplotlib.figure import Figure

from paper_figures import __main__ as command_line
from paper_figures.thesis import figure_registry


class FigureOfTable:
    """A stand-in for a figure module that draws one table."""

    TABLES = ("step",)

    def draw(self, tables):
        figure = Figure()
        figure.add_subplot().plot(tables["step"]["t"], tables["step"]["y"])
        return figure

    def caption(self, tables):
        return f"{len(tables['step'])} rows."


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    folders = tmp_path / "results", tmp_path / "figures"
    for folder in folders:
        folder.mkdir()
    return folders


@pytest.fixture
def figure_of_table(monkeypatch):
    monkeypatch.setattr(figure_registry, "figure_module", lambda name: FigureOfTable())


def run(folders: tuple[Path, Path], *names: str) -> Result:
    results, output = folders
    return CliRunner().invoke(command_line.main, ["draw", *names, "--results", str(results), "--output", str(output)])


def written(folders: tuple[Path, Path]) -> list[str]:
    return sorted(path.name for path in folders[1].iterdir())


def assert_refused(result: Result, *parts: str) -> None:
    assert result.exit_code == 2
    assert result.output.startswith("Error: ")
    assert result.output.count("\n") == 1
    for part in parts:
        assert part in result.output


def test_draws_each_named_figure(folders):
    result = run(folders, "fig_2_01", "fig_3_02")
    assert result.exit_code == 0, result.output
    assert written(folders) == [
        f"{name}.{kind}" for name in ("fig_2_01", "fig_3_02") for kind in ("pdf", "png", "svg", "txt")
    ]


def test_table_reaches_figure_and_caption(folders, figure_of_table):
    (folders[0] / "step.csv").write_text("# synthetic\nt,y\n0,0\n1,2\n", encoding="utf-8")
    result = run(folders, "fig_9_99")
    assert result.exit_code == 0, result.output
    assert (folders[1] / "fig_9_99.txt").read_text(encoding="utf-8") == "2 rows.\n"


def test_unknown_figure_is_refused_before_anything_is_written(folders):
    result = run(folders, "fig_2_01", "fig_9_99")
    assert_refused(result, "fig_9_99: no such figure", "fig_2_01")
    assert written(folders) == []


@pytest.mark.parametrize("name", ["style", "__main__", "../fig_2_01", "fig_2_01.py", ""])
def test_only_figures_are_imported(folders, name):
    assert_refused(run(folders, name), "no such figure")


def test_missing_table_is_refused(folders, figure_of_table):
    assert_refused(run(folders, "fig_9_99"), "step.csv: no such table, which fig_9_99 needs")
    assert written(folders) == []


@pytest.mark.parametrize("text", ["", "# only a comment\n", 't,y\n0,0,0\n1,"2\n'])
def test_malformed_table_is_refused(folders, figure_of_table, text):
    (folders[0] / "step.csv").write_text(text, encoding="utf-8")
    assert_refused(run(folders, "fig_9_99"), "step.csv: is not a table")
    assert written(folders) == []


def test_missing_output_folder_is_refused(folders):
    folders[1].rmdir()
    assert_refused(run(folders, "fig_2_01"), "no such folder")
    assert not folders[1].exists()


def test_no_figure_named_is_refused(folders):
    assert run(folders).exit_code == 2
