"""The block diagrams: complete, legible, inside the page, and the same bytes on every run."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from paper_figures.thesis.figure_registry import figure_module

SIGNALS = {
    "fig_2_01": ["$r$", "$e$", "$u$", "$d$", "$y$", "$C(s)$", "$P(s)$"],
    "fig_2_05": [
        *("$r_0$", "$r$", "$e$", r"$u_\mathrm{lin}$", "$u$", "$y$"),
        *(r"$\Lambda(s)^{-1}$", "$K(s)$", "$F_1(s)$", "$F_2(s)$", "$G(s)$", "$C(s)$"),
    ],
    "fig_2_06": [
        *("$r_0$", "$r$", "$e$", r"$u_\mathrm{lin}$", r"$u_\mathrm{d}$", "$u$", r"$u_\mathrm{m}$"),
        *(r"$\tilde{u}$", "$y$", r"$y_\mathrm{d}$", r"$y_\mathrm{lin}$"),
        *(
            r"$\Lambda(s)^{-1}$",
            "$K(s)$",
            "$F_1(s)$",
            "$F_2(s)$",
            "$G(s)$",
            r"$\theta_1(s)$",
            r"$\theta_2(s)$",
        ),
    ],
    "fig_2_07": [
        *("$r$", "$e$", r"$u_\mathrm{lin}$", "$u$", r"$\tilde{u}$"),
        *("$y$", r"$y_\mathrm{d}$", r"$y_\mathrm{lin}$"),
        *("$K(s)$", "$G_A(s)$", "$(1 + F(s))^{-1}$", r"$\tilde{\theta}_1(s)$", r"$\theta_2(s)$"),
    ],
    "fig_2_08": [
        *("5 V sine sweep, 10 to 200 Hz", "response", r"$P_\mathrm{EL}(j\omega)$: magnitude and phase"),
        *("signal\nanalyser", "antenna axis\nwith drive", "$P(s)$", "$W_a(s)$"),
    ],
    "fig_3_01": [
        *("$r$", "$e$", "$u$", "$d$", "$y$", "$C_1(s)$", "$P(s)$", "$H(s)$"),
        r"$\dfrac{K}{s}\,R_0(s)\,e^{-T_d s}$",
    ],
    "fig_3_02": [
        *("$e$", "$u$", "$C_0(s)$", "$C_1(s)$"),
        *(r"$\dfrac{1 - e^{-\hat{T}_d s}}{s}$", r"$\dfrac{\hat{R}_\epsilon(s)^{-1}}{\hat{K}}$"),
    ],
}

SIGNS = {
    "fig_2_01": "+++-",
    "fig_2_05": "++--",
    "fig_2_06": "+++++----",
    "fig_2_07": "+++---",
    "fig_2_08": "",
    "fig_3_01": "+++-",
    "fig_3_02": "+-",
}

each_diagram = pytest.mark.parametrize("name", SIGNALS)


@pytest.fixture
def diagram(name: str) -> Figure:
    return figure_module(name).draw({})


def texts(figure: Figure) -> list[Text]:
    return [text for axes in figure.axes for text in axes.texts]


@each_diagram
def test_every_signal_and_block_is_named(diagram, name):
    labels = [text.get_text() for text in texts(diagram)]
    assert set(SIGNALS[name]) <= set(labels)
    assert len(labels) == len(set(labels) - {"$+$", "$-$"}) + len(SIGNS[name])


@each_diagram
def test_junctions_have_their_signs(diagram, name):
    labels = [text.get_text() for text in texts(diagram)]
    assert "".join(sorted(label.strip("$") for label in labels if label in ("$+$", "$-$"))) == SIGNS[name]


@each_diagram
def test_no_text_overlaps_another(diagram, extents):
    overlapping = [
        (first, second)
        for (first, one), (second, other) in combinations(extents(diagram, texts), 2)
        if one.padded(0.01).overlaps(other)
    ]
    assert overlapping == []


@each_diagram
def test_no_line_junction_or_arrowhead_touches_a_text(diagram, extents):
    lines = [line.get_path() for axes in diagram.axes for line in axes.lines]
    lines += [
        patch.get_patch_transform().transform_path(patch.get_path()) for axes in diagram.axes for patch in axes.patches
    ]
    crossed = [
        label
        for label, box in extents(diagram, texts)
        if any(line.intersects_bbox(box.padded(0.01), filled=False) for line in lines)
    ]
    assert crossed == []


@each_diagram
def test_every_text_and_line_lies_on_the_page(diagram, extents):
    page = np.array([(0, 0), diagram.get_size_inches()])
    corners = [corner for _, box in extents(diagram, texts) for corner in box.get_points()]
    corners += [vertex for axes in diagram.axes for line in axes.lines for vertex in line.get_xydata()]
    assert np.all(np.array(corners) > page[0])
    assert np.all(np.array(corners) < page[1])


@each_diagram
def test_text_is_of_print_size(diagram):
    assert {text.get_fontsize() for text in texts(diagram)} <= {8, 9}


@each_diagram
def test_caption_names_the_figure_of_the_thesis(name):
    _, chapter, number = name.split("_")
    assert f"thesis Fig. {chapter}.{int(number)}" in figure_module(name).caption({})
