"""Runs as they are drawn: limits, when they are exceeded, units, and the files that commands write."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.axes import Axes

from antiwindup.code_files import files_of_command
from design.__main__ import main as design_main
from design.design_file import Design
from experiments.__main__ import main as experiments_main
from experiments.drive.sampled_loop import SampledRun
from experiments.engine.simulate import Run
from experiments.runs.references import sinusoid
from experiments.runs.simulate_design import simulate_design
from identification.__main__ import main as identification_main
from identification.model.signals import Signals
from paper_figures.look.audit_sheet import plot_audit
from paper_figures.look.plot_run import plot_run
from paper_figures.look.stretches import saturated_stretches
from paper_figures.look.style import figure_writer

LIMITS = (-9.0, 12.0)
REFERENCE = sinusoid(50.0, 1.5, np.pi / 2)


def shaded(panel: Axes) -> np.ndarray:
    """(n, 2): beginnings and ends of what is shaded."""
    bars = [path.get_extents() for collection in panel.collections for path in collection.get_paths()]
    return np.array([(bar.x0, bar.x1) for bar in bars])


@pytest.fixture(scope="module")
def runs(extended_design: Design) -> dict[str, Run]:
    return {
        name: simulate_design(extended_design, LIMITS, REFERENCE, name, until_s=8.0, samples=81)
        for name in ("none", "corrected")
    }


def test_stretches_are_those_of_a_run_that_is_looked_at_everywhere(
    extended_design: Design, runs: dict[str, Run]
) -> None:
    """The drawn run has 10 samples a second and chatters at 45 Hz: only its located crossings can say it."""
    for name, run in runs.items():
        fine = simulate_design(extended_design, LIMITS, REFERENCE, name, until_s=8.0, samples=160_001)
        beyond = (fine.control < LIMITS[0]) | (fine.control > LIMITS[1])
        found = saturated_stretches(run, LIMITS)
        assert len(found) > 3
        inside = np.zeros(beyond.shape, dtype=bool)
        for start, end in found:
            inside |= (fine.time_s >= start) & (fine.time_s < end)
        assert np.mean(inside != beyond) < 1e-5


def test_slewing_alone_is_no_saturation(extended_design: Design) -> None:
    at = {"until_s": 4.0, "samples": 4001, "rate_limit": 150.0}
    run = simulate_design(extended_design, LIMITS, REFERENCE, **at)
    assert np.any(np.abs(run.modes) > 1)
    beyond = (run.control < LIMITS[0]) | (run.control > LIMITS[1])
    found = saturated_stretches(run, LIMITS)
    inside = np.any([(run.time_s >= start) & (run.time_s < end) for start, end in found], axis=0)
    assert np.mean(inside != beyond) < 1e-3


def test_a_computers_control_is_held_until_its_next_sample() -> None:
    time_s = np.arange(9) / 4
    control = np.array([0.0, 2.0, 3.0, 0.5, -3.0, 0.0, 0.0, 0.0, 4.0])
    run = SampledRun(time_s, 0 * time_s, 0 * time_s, 0 * time_s, control, np.clip(control, -1, 1))
    assert saturated_stretches(run, (-1.0, 1.0)).tolist() == [[0.25, 0.75], [1.0, 1.25]]
    panel = plot_run(run, 1.0).axes[-1]
    assert shaded(panel).tolist() == [[0.25, 0.75], [1.0, 1.25]]
    assert not shaded(plot_run(run).axes[-1]).size


def test_what_is_drawn_can_be_seen() -> None:
    """A stretch of one sample in 2000 is wide enough; a control that fills the panel is pale and its swings counted."""
    time_s = np.arange(2001) / 2000
    rest = time_s, 0 * time_s, 0 * time_s, 0 * time_s
    control = np.where(time_s == 0, 5.0, 0.0)
    panel = plot_run(SampledRun(*rest, control, np.clip(control, -1, 1)), 1).axes[2]
    assert shaded(panel) == pytest.approx(np.array([[0.0, 0.005]]))
    assert "beyond them, at least 0.5 % wide" in [text.get_text() for text in panel.get_legend().get_texts()]
    control = 1e6 * (-1.0) ** np.arange(2001)
    panel = plot_run(SampledRun(*rest, control, np.clip(control, -1, 1)), 1).axes[2]
    assert "from limit to limit 2000 times" in [text.get_text() for text in panel.texts]


def test_panels_have_names_units_limits_and_every_run(runs: dict[str, Run]) -> None:
    signals = Signals("motor $ current", "A", "arm angle", "rad")
    output, error, none, corrected = plot_run(runs, LIMITS, signals).axes
    labels = [panel.get_ylabel() for panel in (output, error, none, corrected)]
    assert labels == ["arm angle [rad]", "error [rad]", r"motor \$ current [A]", r"motor \$ current [A]"]
    assert corrected.get_xlabel() == "Time [s]"
    keys = [text.get_text() for text in output.get_legend().get_texts()]
    assert keys == ["reference $r$", "$y$, without anti-windup", "$y$, corrected anti-windup"]
    for panel, run in ((none, runs["none"]), (corrected, runs["corrected"])):
        level = [line.get_ydata()[0] for line in panel.lines if len(line.get_ydata()) == 2]
        assert level == list(LIMITS)
        control = next(line for line in panel.lines if str(line.get_label()).startswith("control"))
        np.testing.assert_array_equal(control.get_ydata(), run.control)
        low, high = panel.get_ylim()
        assert low < LIMITS[0] < LIMITS[1] < high
    assert plot_run(runs["none"]).axes[0].get_ylabel() == "output"


def command_line(kind: str, folder: Path, design: Design, figure: str) -> tuple[Callable[..., object], list[str]]:
    """A command, and its words."""
    made = folder / "design.json"
    made.write_text(design.to_json(), encoding="utf-8")
    run = [str(made), "--amplitude", "50", "--limit", "12", "--anti-windup", "corrected", "--until", "1"]
    output = ["--output", str(folder / "out"), "--figure", str(folder / figure)]
    if kind == "audit":
        return design_main, ["audit", str(made), *output[2:]]
    if kind == "fit":
        sweep, omega = folder / "sweep.csv", np.linspace(10.0, 100.0, 60)
        response = 2 / (1 + 0.1j * omega / 40 - (omega / 40) ** 2)
        rows = [f"{w:.9g},{p.real:.9g},{p.imag:.9g}" for w, p in zip(omega, response, strict=True)]
        sweep.write_text("\n".join(["omega,real,imag", *rows]), encoding="utf-8")
        return identification_main, ["fit", str(sweep), *output, "--modes", "0/1", "--integrators", "0", "--real", "0"]
    step = ["--sample-time", "0.01"] if kind == "simulate" else ["--rate", "1000", "--method", "tustin"]
    return experiments_main, [kind, *run, *step, *output]


@pytest.mark.parametrize(("kind", "figure"), [("fit", "f.png"), ("simulate", "f.PDF"), ("sampled", "f.svg")])
def test_a_command_draws_the_same_bytes_twice(kind: str, figure: str, tmp_path: Path, extended_design: Design) -> None:
    main, words = command_line(kind, tmp_path, extended_design, figure)
    written = []
    for _ in range(2):
        result = CliRunner().invoke(main, words)
        assert result.exit_code == 0, result.output
        written.append((tmp_path / figure).read_bytes())
    assert written[0] == written[1]
    assert written[0].startswith({"png": b"\x89PNG", "svg": b"<?xml", "PDF": b"%PDF"}[figure[2:]])


def test_an_audit_draws_its_sheet(tmp_path: Path, extended_design: Design) -> None:
    main, words = command_line("audit", tmp_path, extended_design, "f.svg")
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    figure_writer(plot_audit(extended_design))(tmp_path / "again.svg")
    assert (tmp_path / "f.svg").read_bytes() == (tmp_path / "again.svg").read_bytes()


@pytest.mark.parametrize("kind", ["fit", "audit", "simulate", "sampled"])
def test_what_is_no_figure_is_refused_before_anything_is_written(
    kind: str, tmp_path: Path, extended_design: Design
) -> None:
    main, words = command_line(kind, tmp_path, extended_design, "f.jpg")
    before = sorted(tmp_path.iterdir())
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 2
    assert "ends in '.jpg'; expected .pdf, .svg or .png" in " ".join(result.output.split())
    assert sorted(tmp_path.iterdir()) == before


def test_a_build_hangs_on_what_draws_only_where_it_draws() -> None:
    words = ("identification", "fit", "a.csv", "--output", "m.json")
    assert not any(file.startswith("paper_figures/") for file in files_of_command(words))
    assert "paper_figures/look/bode.py" in files_of_command((*words, "--figure", "f.pdf"))
