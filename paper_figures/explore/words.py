"""What the page says of a state: which plant is the true one, the audit as a table, the run in numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from html import escape

import numpy as np

from design.design_file import Design
from design.stability.characteristic_roots import unstable_roots
from design.stability.margins import Margins
from experiments.engine.simulate import Run
from experiments.runs.metrics import last_saturation
from identification.base.digits import percent
from paper_figures.explore.compute import Judged, Linear, saturated
from paper_figures.explore.state import TruePlant

TEX = re.compile(r"\$\$|\\\(|\\\[")
Rows = Sequence[Sequence[str]]

MARGINS: dict[str, Callable[[Margins], str]] = {
    "modulus margin": lambda found: f"{found.modulus.value:.3g}",
    "gain factors": lambda found: f"{found.gain_down.value:.3g} to {found.gain_up.value:.3g}",
    "phase margin": lambda found: f"{min(found.phase_deg.value, 180.0):.3g} deg",
    "dead time, at most": lambda found: f"{found.delay_greatest_s.value:.3g} s",
    "|W_a C S|, at most": lambda found: f"{found.W_a_C_S.value:.3g}",
}


def true_plant_text(true: TruePlant, model: TruePlant) -> str:
    """Which plant is in the loop, and that nothing is measured."""
    if true == model:
        said = "the design's own model"
    else:
        changes = []
        if true.gain != model.gain:
            changes.append(f"its gain times {true.gain:.4g}")
        if true.mode_frequency != model.mode_frequency:
            changes.append(f"the frequencies of its modes times {true.mode_frequency:.4g}")
        if true.delay_s != model.delay_s:
            changes.append(f"a dead time of {true.delay_s:.4g} s instead of {model.delay_s:.4g} s")
        said = f"the design's model with {' and '.join(changes)}"
    return f"True plant: {said}. All is computed, nothing measured."


def run_text(run: Run) -> str:
    """The run in one sentence."""
    steady = int(np.isfinite(run.control).sum())
    if steady < len(run.control):
        return f"The run diverges near t = {run.time_s[steady]:.4g} s."
    if not len(run.events_s) and np.array_equal(run.control, run.saturated_control):
        return "The control stays within the limits."
    last, outside = last_saturation(run), saturated(run)
    share = float((outside[:, 1] - outside[:, 0]).sum() / run.time_s[-1])
    end = "saturated to the end" if np.isnan(last) else f"last saturated at {last:.4g} s"
    return f"The control is beyond the limits for {percent(share)} % of the run, {end}."


def stability_text(linear: Linear) -> str:
    """Whether the loop around the true plant is stable without limits."""
    if not linear.unstable:
        return ""
    return f"The loop without limits is UNSTABLE: {unstable_roots(linear.unstable)}."


def design_rows(design: Design) -> Rows:
    """What the design and its anti-windup are, name and value."""
    own, judged = design.corrected, design.corrected.judgement
    said = f"f = {judged.f:.3g}, recovery {judged.recovery_s:.3g} s, no pole beyond {own.bandwidth:.3g} rad/s"
    return [("anti-windup", said), ("guarantee", f"{own.guarantee}: {own.guarantee_said}")]


def margin_rows(judged: Judged) -> Rows:
    """The margins of the loop with the model and with the true plant; the first row is the head."""
    rows: list[tuple[str, ...]] = [("", "model", "true plant")]
    for name, said in MARGINS.items():
        both = (judged.model, judged.true)
        rows.append((name, *(said(found) if isinstance(found, Margins) else "none" for found in both)))
    return rows


def table(rows: Rows, has_head: bool = False) -> str:
    """Rows as HTML."""
    lines = []
    for number, row in enumerate(rows):
        cells = [f"<th scope=row>{escape(row[0])}</th>"]
        kind = "th scope=col" if has_head and number == 0 else "td"
        cells += [f"<{kind}>{escape(cell)}</{kind[:2]}>" for cell in row[1:]]
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return f"<table>{''.join(lines)}</table>"


def paragraphs(*sentences: str) -> str:
    """Sentences as HTML, those that are empty left out."""
    return "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences if sentence)


def without_tex(text: str) -> str:
    """A name that Bokeh, which sets as HTML what holds a sign of TeX, takes as it is."""
    return TEX.sub(lambda found: "\u200b".join(found[0]), text)
