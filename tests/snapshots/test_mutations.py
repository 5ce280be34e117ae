"""Every change of every stored snapshot is caught: each number, name, column, row and letter, one at a time.

``benchmarks/mutation_study.py`` counts the same mutants.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from drawn import artists_of, drawn, drawn_axes
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.contour import ContourSet
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon, Rectangle, StepPatch
from matplotlib.text import Text
from mutants import SMALL, is_caught, snapshot_files, stored_snapshot, tallied
from pytest_regressions.common import check_text_files
from strict import Stored
from test_figure_data import STORED, draw_stored

from paper_figures.thesis.figure_registry import figure_names

LARGER = 1 + SMALL
FILES = snapshot_files()
MOST_BELOW = 0.15
"""Share of a file's numbers, such as errors that have died away, whose last six digits rounding may change."""

each_file = pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)


def test_no_stored_file_is_passed_over() -> None:
    assert set(FILES) == {path for path in Path(__file__).parent.glob("test_*/*") if path.is_file()}
    assert {path.suffix for path in FILES} == {".csv", ".npz", ".txt"}


@each_file
def test_every_mutant_is_caught(path: Path) -> None:
    found = tallied(path)
    assert {change: tally.missed for change, tally in found.items() if tally.missed} == {}
    for change, tally in found.items():
        if change.startswith("every value") and "swapped" not in change:
            assert tally.below <= MOST_BELOW * tally.mutants, f"{change}: {tally.below} of {tally.mutants}"


@each_file
def test_the_same_is_not_caught(path: Path, tmp_path: Path) -> None:
    if path.suffix == ".txt":
        check_text_files(path, path, encoding="utf-8")
        changed = tmp_path / path.name
        changed.write_text(path.read_text(encoding="utf-8").replace("axes 0", "axes 1"), encoding="utf-8")
        with pytest.raises(AssertionError):
            check_text_files(changed, path, encoding="utf-8")
    else:
        stored = stored_snapshot(path)
        stored.check({name: values.copy() for name, values in stored.columns.items()})


class Panel:
    """One of a figure's axes with what is stored of it."""

    def __init__(self, place: int, axes: Axes, stored: Stored) -> None:
        self.place, self.axes = place, axes
        own = {name: values for name, values in stored.columns.items() if name.split()[0] == str(place)}
        self.stored, self.lines = Stored(own, stored.name), drawn_axes(place, axes)[0]

    def is_noticed(self) -> bool:
        """Whether the axes as they are now are refused."""
        lines, columns = drawn_axes(self.place, self.axes)
        return lines != self.lines or is_caught(self.stored, columns)


def moved(artist: Artist) -> Iterator[Callable[[float], object]]:
    """For each set of an artist's coordinates what multiplies it by a factor."""
    if isinstance(artist, Line2D):
        x, y = artist.get_data(orig=False)
        if np.any(x):
            yield lambda factor: artist.set_data(np.multiply(x, factor), y)
        if np.any(np.nan_to_num(y)):
            yield lambda factor: artist.set_data(x, np.multiply(y, factor))
    elif isinstance(artist, Text):
        at = artist.get_position()
        yield lambda factor: artist.set_position((factor * at[0], factor * at[1]))
    elif isinstance(artist, Collection):
        for path in artist.get_paths():
            corners = np.array(path.vertices)
            yield lambda factor, path=path, corners=corners: setattr(path, "vertices", corners * factor)
    elif isinstance(artist, Polygon):
        points = artist.get_xy()
        yield lambda factor: artist.set_xy(points * factor)
    elif isinstance(artist, Rectangle):
        bottom = artist.get_y()
        yield lambda factor: artist.set_y(factor * bottom)
        width = artist.get_width()
        yield lambda factor: artist.set_width(factor * width)
    elif isinstance(artist, Circle):
        center = artist.get_center()
        yield lambda factor: artist.set_center((factor * center[0], factor * center[1]))
    elif isinstance(artist, StepPatch):
        steps = artist.get_data()
        yield lambda factor: artist.set_data(edges=steps.edges * factor)
        if np.any(np.nan_to_num(steps.values)):
            yield lambda factor: artist.set_data(values=steps.values * factor)
    else:
        assert isinstance(artist, Legend), artist


@pytest.mark.parametrize("name", figure_names())
def test_every_change_of_a_drawing_is_caught(name: str) -> None:
    """Each artist shifted by 1e-6 relative, hidden, made pale, each view shifted, each name changed, one taken away."""
    drawing, stored = draw_stored(name), stored_snapshot(STORED / f"{name}.npz")
    listing, columns = drawn(drawing)
    assert listing == (STORED / f"{name}.txt").read_text(encoding="utf-8")
    assert not is_caught(stored, columns)
    panels = [Panel(place, axes, stored) for place, axes in enumerate(drawing.axes)]
    assert "".join(f"{line}\n" for panel in panels for line in panel.lines) == listing
    for panel in panels:
        axes = panel.axes
        for artist in artists_of(axes):
            for move in moved(artist):
                move(LARGER)
                assert panel.is_noticed(), f"{artist} shifted"
                move(1.0)
            artist.set_visible(False)
            assert panel.is_noticed(), f"{artist} hidden"
            artist.set_visible(True)
            if not isinstance(artist, ContourSet | Patch):  # whose faces and edges do not come back
                alpha = artist.get_alpha()
                artist.set_alpha(0.05)
                assert panel.is_noticed(), f"{artist} pale"
                artist.set_alpha(alpha)
            assert not panel.is_noticed(), f"{artist} restored"
        for ends, set_ends in ((axes.get_xlim(), axes.set_xlim), (axes.get_ylim(), axes.set_ylim)):
            set_ends(ends[0], ends[1] * LARGER)
            assert panel.is_noticed(), f"{axes} with another view"
            set_ends(*ends)
        axes.set_visible(False)
        assert panel.is_noticed(), f"{axes} hidden"
        axes.set_visible(True)
        label = axes.get_ylabel()
        axes.set_ylabel(f"{label}.")
        assert panel.is_noticed(), f"{axes} with another label"
        axes.set_ylabel(label)
    assert not any(panel.is_noticed() for panel in panels)
    first = next(artists_of(panels[0].axes))
    first.remove()
    assert panels[0].is_noticed(), f"{first} taken away"
