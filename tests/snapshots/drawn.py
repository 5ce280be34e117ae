"""What a figure draws, before any renderer sees it: a listing to read and every coordinate as a number."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import Collection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.spines import Spine
from matplotlib.text import Annotation, Text
from strict import flagged


def drawn(figure: Figure) -> tuple[str, dict[str, np.ndarray]]:
    """Return what a figure draws.

    Returns
    -------
    listing
        A line for each of the axes and each artist in draw order: kind, look, texts, how many points.
    columns
        Every coordinate, as the strict fixture takes it. Coordinates are those of the data, or of the axes for what
        is placed there; nothing in them depends on fonts or on a renderer.
    """
    lines, numbers = [], {"size": figure.get_size_inches()}
    left_over = [artist for artist in figure.get_children() if artist not in (figure.patch, *figure.axes)]
    assert not left_over, f"beside the axes the figure holds {left_over}"
    for place, axes in enumerate(figure.axes):
        listed, coordinates = drawn_axes(place, axes)
        lines += listed
        numbers |= coordinates
    return "\n".join(lines) + "\n", numbers


def drawn_axes(place: int, axes: Axes) -> tuple[list[str], dict[str, np.ndarray]]:
    """The lines and the columns of one of the axes, whose number is the first word of each column's name."""
    lines = [_axes(place, axes)]
    numbers = {
        f"{place} place": np.array(axes.get_position().bounds),
        f"{place} xlim": np.array(axes.get_xlim()),
        f"{place} ylim": np.array(axes.get_ylim()),
    }
    for count, artist in enumerate(artists_of(axes)):
        listed, coordinates = _artist(artist)
        lines.append(f"  {count} {type(artist).__name__} {listed} {_shown(artist)}")
        for name, values in coordinates.items():
            numbers |= flagged(f"{place} {count} {name}", values)
    return lines, {name: values for name, values in numbers.items() if len(values)}


def _shown(artist: Artist) -> str:
    """Where an artist lies in the stack, and what hides it, if anything does."""
    hidden = "" if artist.get_visible() else " hidden"
    return f"zorder {artist.get_zorder():.4g}{hidden}{_unless(artist.get_alpha(), None, ' alpha')}"


def _unless(value: object, usual: object, name: str) -> str:
    return "" if value == usual else f"{name} {value}"


def _axes(place: int, axes: Axes) -> str:
    names = [axes.get_title(where) for where in ("left", "center", "right")]  # type: ignore[arg-type]
    return (
        f"axes {place} x {axes.get_xscale()} {axes.get_xlabel()!r} y {axes.get_yscale()} {axes.get_ylabel()!r}"
        f"{'' if axes.axison else ' off'}{' titles ' + repr(names) if any(names) else ''} {_shown(axes)}"
        f"{_unless(_ticks(axes), 'both', ' ticks')}"
    )


def _ticks(axes: Axes) -> str:
    """Which of the axes have ticks where they are seen."""
    within = {
        "x": any(axes.get_xlim()[0] <= at <= axes.get_xlim()[1] for at in axes.get_xticks()),
        "y": any(min(axes.get_ylim()) <= at <= max(axes.get_ylim()) for at in axes.get_yticks()),
    }
    return "both" if all(within.values()) else " ".join(name for name, there in within.items() if there) or "none"


def artists_of(axes: Axes) -> Iterator[Artist]:
    """What was drawn into the axes; their own parts are left out."""
    own = {axes.patch, axes.title, axes._left_title, axes._right_title}  # type: ignore[attr-defined]
    for artist in axes.get_children():
        if artist not in own and not isinstance(artist, Axis | Spine):
            yield artist


def _artist(artist: Artist) -> tuple[str, dict[str, np.ndarray]]:
    """The line of an artist and its coordinates."""
    if isinstance(artist, Line2D):
        x, y = (np.ma.filled(np.ma.asarray(values, dtype=float), np.nan) for values in artist.get_data(orig=False))
        _, dashes = artist._unscaled_dash_pattern  # type: ignore[attr-defined]
        look = f"{to_hex(artist.get_color())} {dashes or artist.get_linestyle()} {artist.get_linewidth():g}"
        marker = ""
        if artist.get_marker() not in ("None", None, ""):
            faces = to_hex(artist.get_markerfacecolor()) if artist.get_markerfacecolor() != "none" else "hollow"
            marker = f" {artist.get_marker()} {artist.get_markersize():g} {faces}"
            marker += _unless(artist.get_markevery(), None, " every")
        marker += _unless(artist.get_drawstyle(), "default", " drawn in")
        return f"{artist.get_label()!r} {look}{marker}: {len(x)} points", {"x": x, "y": y}
    if isinstance(artist, Legend):
        handles = [f"{type(handle).__name__} {to_hex(_colour(handle))}" for handle in artist.legend_handles]
        place = f"at {artist._loc} of {artist._ncols} columns"  # type: ignore[attr-defined]
        return f"{[text.get_text() for text in artist.get_texts()]!r} {handles} {place}", {}
    if isinstance(artist, Text):
        x, y = (float(value) for value in artist.get_position())
        at = {"at": np.array([x, y])}
        if isinstance(artist, Annotation):
            at["of"] = np.array([float(value) for value in artist.xy])
        look = f"{to_hex(artist.get_color())} {artist.get_fontsize():g}"
        look += f" {artist.get_horizontalalignment()} {artist.get_verticalalignment()}"
        return f"{artist.get_text()!r} at {x:.3f} {y:.3f} {look} {artist.get_rotation():g}", at
    if isinstance(artist, Collection):
        paths = artist.get_paths()
        corners = np.concatenate([np.asarray(path.vertices).ravel() for path in paths])
        offsets = np.ma.filled(np.ma.asarray(artist.get_offsets(), dtype=float), np.nan).ravel()
        faces = " ".join(to_hex(face, keep_alpha=True) for face in artist.get_facecolor())  # type: ignore[union-attr]
        return f"{artist.get_label()!r} {faces}: {len(paths)} paths", {"corners": corners, "offsets": offsets}
    assert isinstance(artist, Patch), f"{artist!r} is of a kind whose coordinates are not kept"
    corners = np.asarray(artist.get_patch_transform().transform(artist.get_path().vertices))
    look = f"{to_hex(artist.get_facecolor(), keep_alpha=True)} {to_hex(artist.get_edgecolor())}"
    look += f" {artist.get_linestyle()} {artist.get_linewidth():g}"
    return f"{artist.get_label()!r} {look}: {len(corners)} corners", {"corners": corners.ravel()}


def _colour(handle: object) -> Any:
    """The colour of a legend's handle: a line's own, a patch's face."""
    return handle.get_color() if isinstance(handle, Line2D) else handle.get_facecolor()  # type: ignore[attr-defined]
