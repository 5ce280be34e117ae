"""Figures A.1 to A.3: their lines are the tables' columns, and their captions say the tables' numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from paper_figures.look.style import LINES
from paper_figures.thesis.figures import fig_a_01, fig_a_02, fig_a_03

Tables = dict[str, pd.DataFrame]


def trade_off() -> Tables:
    rows = [(k, T, 0.01 / (1 - k) / T, 55.0) for T in (0.125, 0.5, 2.0) for k in (0.75, 0.875)]
    summary = {
        "run": ["thesis", "least", "corrected"],
        "f": [1.625, 1.375, 0.0425],
        "popov_sector": [np.nan, np.nan, 0.875],
        "recovery_s": [0.25, 0.125, 1.75],
        "lasting_offset": [412.0, 533.0, 0.0],
        "fastest": [62.5, 51.0, 49.0],
    }
    return {
        "trade_off": pd.DataFrame(rows, columns=["sector", "recovery_s", "f", "bandwidth"]),
        "trade_off_summary": pd.DataFrame(summary),
    }


def interpolation() -> Tables:
    omega = np.geomspace(0.1, 1000, 41)
    parts = []
    for k, method in enumerate(("zeros", "lagrange", "poles")):
        works = (omega < 30) if k < 2 else (omega > 300)
        sensitivity = np.where(works | (k < 2), 1.25 + k + omega / 1e3, np.nan)
        parts.append(
            pd.DataFrame({"omega": omega, "method": method, "sensitivity": sensitivity, "works": works.astype(int)})
        )
    ranges = [("zeros", 0.125, 28.5), ("zeros", 512.0, 640.0), ("lagrange", np.nan, np.nan), ("poles", 301.0, 905.0)]
    summary = pd.DataFrame(ranges, columns=["method", "lowest", "highest"]).assign(a=6.5, delay_s=0.0125)
    grid = [(x, y, x - 1.25) for y in (0.01, 0.1, 1.0) for x in (0.5, 1.5, 2.5)]
    return {
        "interpolation": pd.concat(parts, ignore_index=True),
        "interpolation_map": pd.DataFrame(grid, columns=["omega_delay", "a_delay", "margin"]),
        "interpolation_summary": summary,
    }


def robustness() -> Tables:
    omega = np.geomspace(1e-2, 1e4, 200)
    columns = {"omega": omega, "floor": 0.001 * omega}
    for k, name in enumerate(("design_extended", "design_robust")):
        columns[f"robustness_{name}"] = 0.01 * omega / (1 + (omega / 300) ** 2) / (1 + k)
        columns[f"sensitivity_{name}"] = omega / (omega + 5 + k)
    summary = {
        "run": ["design_extended", "design_robust"],
        "peak": [7.75, 0.8125],
        "peak_omega": [123.0, 122.0],
        "modulus": [0.9375, 0.6875],
        "phase_deg": [61.0, 44.0],
        "gain_down": [0.0625, 0.125],
        "gain_up": [19.0, 7.0],
        "delay_least_s": [0.0, 0.0],
        "delay_greatest_s": [0.155, 0.144],
        "tracking_floor": [0.00275, 0.00275],
    }
    return {"robustness": pd.DataFrame(columns), "robustness_summary": pd.DataFrame(summary)}


def test_the_trade_off() -> None:
    tables = trade_off()
    figure = fig_a_01.draw(tables)
    (axes,) = figure.axes
    curves = [line.get_ydata() for line in axes.lines[:2]]
    for k, curve in zip((0.75, 0.875), curves, strict=True):
        np.testing.assert_array_equal(curve, tables["trade_off"]["f"][tables["trade_off"]["sector"] == k])
    points = [(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in axes.lines[2:]]  # type: ignore[index]
    assert points == [(0.25, 1.625), (0.125, 1.375), (1.75, 0.0425)]
    assert [line.get_fillstyle() for line in axes.lines[2:]] == ["none", "none", "full"]
    caption = fig_a_01.caption(tables)
    for said in ("faster than 55 rad/s", "f = 0.0425", "f = 1.62, whose fastest pole, 62.5 rad/s, is NOT", "f = 1.38"):
        assert said in caption
    tables["trade_off_summary"]["fastest"] = 54.0
    assert "54 rad/s, is within that bandwidth" in fig_a_01.caption(tables)


def test_the_designs_of_q() -> None:
    tables = interpolation()
    figure = fig_a_02.draw(tables)
    left, right = figure.axes
    for k, (method, (kind, _)) in enumerate(fig_a_02.KINDS.items()):
        part = tables["interpolation"][tables["interpolation"]["method"] == method]
        thin, works = left.lines[2 * k : 2 * k + 2]
        assert thin.get_linestyle() == works.get_linestyle()
        assert str(thin.get_color()).lower() == LINES[kind]["color"].lower()
        np.testing.assert_array_equal(thin.get_ydata(), part["sensitivity"])
        np.testing.assert_array_equal(works.get_ydata(), part["sensitivity"].where(part["works"] == 1))
    (line,) = (line for line in right.lines if len(line.get_ydata()))  # type: ignore[arg-type]
    assert line.get_ydata()[0] == pytest.approx(6.5 * 0.0125)  # type: ignore[index]
    (stable,) = right.collections
    corners = np.concatenate([path.vertices for path in stable.get_paths()])
    assert corners.min(axis=0).tolist() == pytest.approx([1.25, 0.01])  # where the margin is zero, between the columns
    assert corners.max(axis=0).tolist() == [2.5, 1.0]
    caption = fig_a_02.caption(tables)
    assert "In rad/s: zeros of Q, 0.125 to 28.5 and 512 to 640; Lagrange, nowhere; poles of Q, 301 to 905." in caption
    assert "a = 6.5 rad/s, T_d = 12.5 ms" in caption


def test_the_robustness() -> None:
    tables = robustness()
    figure = fig_a_03.draw(tables)
    left, right = figure.axes
    table = tables["robustness"]
    for k, name in enumerate(fig_a_03.KINDS):
        np.testing.assert_array_equal(left.lines[k].get_ydata(), table[f"robustness_{name}"])
        np.testing.assert_array_equal(right.lines[k].get_ydata(), table[f"sensitivity_{name}"])
    for panel in (left, right):  # the redesign cannot hide the thesis's line
        thesis, redesign = panel.lines[:2]
        assert thesis.get_zorder() > redesign.get_zorder()
        assert thesis.get_linewidth() < redesign.get_linewidth() / 2
    np.testing.assert_array_equal(left.lines[2].get_ydata(), table["floor"])
    caption = fig_a_03.caption(tables)
    for said in (
        "reaches 7.75 at 123 rad/s",
        "redesign reaches 0.812",
        "0.00275",
        "is 0.938 (thesis) and 0.688 (redesign)",
        "0.155 s and 0.144 s",
        "the condition does NOT hold",
    ):
        assert said in caption


def test_a_design_that_is_robust_already_is_said_to_be() -> None:
    tables = robustness()
    tables["robustness_summary"].loc[0, "peak"] = 0.5
    assert "the condition holds" in fig_a_03.caption(tables)
