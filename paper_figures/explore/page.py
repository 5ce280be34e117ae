"""The page: sliders, pictures and words, one document a visit; what is moved is computed beside the server's loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.models import Button, Column, CustomJS, CustomJSTickFormatter, Div, RangeSlider, Select, Slider
from jinja2 import Template

from design.choices import GUARANTEES
from experiments.engine.simulate import Run
from identification.base.errors import InputError
from identification.base.files import write_whole
from paper_figures.explore.compute import Explorer, Judged, Linear
from paper_figures.explore.newest import Newest
from paper_figures.explore.pictures import Pictures
from paper_figures.explore.ranges import Range
from paper_figures.explore.state import State
from paper_figures.explore.words import (
    design_rows,
    margin_rows,
    paragraphs,
    run_text,
    stability_text,
    table,
    true_plant_text,
    without_tex,
)

QUIET_S = 0.3  # without a new value, before what takes longer than a run is computed
REFUSALS = (InputError, ArithmeticError, np.linalg.LinAlgError)
FOUR_DIGITS = "return String(parseFloat(tick.toPrecision(4)))"
ADDRESS = """
clearTimeout(window.explore_address)
window.explore_address = setTimeout(() => history.replaceState(null, "", "?" + cb_obj.tags[0]), 200)
"""
TEMPLATE = Path(__file__).with_name("page.html.j2")
TABLE = """
:host { font-size: 14px; color: #000; width: 100%; }
table { border-collapse: collapse; } p { margin: .35em 0; overflow-wrap: anywhere; }
th, td { text-align: left; font-weight: normal; vertical-align: top; padding: .12em .9em .12em 0; }
th[scope=row] { color: #444; white-space: nowrap; }
"""


class Page:
    """One visit of the page.

    Parameters
    ----------
    document
        To fill.
    explorer
        Computes what is shown.
    state
        What the address asks for.
    sliders
        See :func:`paper_figures.explore.ranges.ranges`.
    design, output
        The file that was read, and the one that "save" writes.
    refused
        Why what the address asks for is not shown; else empty.
    """

    def __init__(
        self,
        document: Document,
        explorer: Explorer,
        state: State,
        sliders: list[Range],
        design: Path,
        output: Path,
        refused: str = "",
    ) -> None:
        self.document, self.explorer, self.state = document, explorer, state
        self.design, self.output = design, output
        self.pictures = Pictures(explorer.file.signals)
        self.drawing, self.judging, self.saving = Newest(self._draw), Newest(self._judge), Newest(self._save)
        self.refused = refused
        self.said = _words("said", polite=True)
        self.facts, self.margins = _words("facts"), _words("margins")
        self.promised, self.saved = _words("promised"), _words("saved", polite=True)
        button = Button(label=f"save as {output.name}", name="save", sizing_mode="stretch_width")
        button.on_click(lambda: self.saving.ask(self.state))
        moved = [self._slider(each) for each in sliders]
        chosen = Select(title="guarantee", value=state.choices.guarantee, options=list(GUARANTEES), name="guarantee")
        chosen.sizing_mode = "stretch_width"
        chosen.on_change("value", lambda _, __, value: self._change({}, value))
        self.column = Column(
            *moved, chosen, button, self.saved, name="sliders", sizing_mode="stretch_width", tags=[state.query]
        )
        self.column.js_on_change("tags", CustomJS(code=ADDRESS))
        audit = Column(self.promised, self.margins, self.facts, name="audit", sizing_mode="stretch_width")
        for root in (self.column, self.said, *self.pictures.all, audit):
            document.add_root(root)
        document.title = f"{design.name}: {explorer.file.kind} design"
        document.template = Template(TEMPLATE.read_text(encoding="utf-8"))
        self.drawing.ask(state)

    def _slider(self, given: Range) -> Slider | RangeSlider:
        """The widget of a range, which changes its numbers of the state."""
        settings: dict[str, Any] = {
            "title": without_tex(given.title),
            "start": given.low,
            "end": given.high,
            "step": given.step,
            "format": CustomJSTickFormatter(code=FOUR_DIGITS),
            "name": given.name if given.index is None else f"{given.name}-{given.index}",
            "sizing_mode": "stretch_width",
            "tooltips": False,  # the title has the value
        }
        values, at = self.state.numbers[given.name], given.index
        if at is None:
            pair = RangeSlider(value=values, **settings)
            pair.on_change("value", lambda _, __, ends: self._change({given.name: ends}))
            return pair
        one = Slider(value=values[at], **settings)

        def moved(_attribute: str, _old: float, value: float) -> None:
            values = self.state.numbers[given.name]
            self._change({given.name: (*values[:at], value, *values[at + 1 :])})

        one.on_change("value", moved)
        return one

    def _change(self, numbers: dict[str, tuple[float, ...]], guarantee: str | None = None) -> None:
        try:
            self.state, self.refused = self.state.changed(numbers, guarantee), ""
        except InputError as error:
            self.said.text = paragraphs(f"{error}.")
            return
        self.column.tags = [self.state.query]
        self.drawing.ask(self.state)

    async def _draw(self, state: State) -> None:
        """Compute and show what a state asks for; what is refused is said, and the picture before it stays."""
        drawn = await asyncio.to_thread(_attempt, partial(_drawn, self.explorer, state))
        self.document.add_next_tick_callback(partial(self._show, state, drawn))
        self.judging.ask(state)

    def _show(self, state: State, drawn: tuple[Linear, Run] | str) -> None:
        true = true_plant_text(state.true, self.explorer.start.true)
        if isinstance(drawn, str):
            self.said.text = paragraphs(f"Refused, so that the pictures are those before: {drawn}.", true)
            return
        linear, run = drawn
        self.pictures.show_linear(linear)
        self.pictures.show_run(run, state.limits)
        self.said.text = paragraphs(self.refused, true, stability_text(linear), run_text(run))

    async def _judge(self, state: State) -> None:
        """What takes longer than a run, once nothing has moved for a while."""
        await asyncio.sleep(QUIET_S)
        if state is self.state:
            judged = await asyncio.to_thread(_attempt, partial(self.explorer.judged, state))
            self.document.add_next_tick_callback(partial(self._show_judged, state, judged))

    def _show_judged(self, state: State, judged: Judged | str) -> None:
        if state is not self.state or isinstance(judged, str):
            return
        self.promised.text = paragraphs(f"{judged.promised}.")
        self.margins.text = table(margin_rows(judged), has_head=True)
        self.facts.text = table(design_rows(self.explorer.designed(state.choices)))

    async def _save(self, state: State) -> None:
        said = await asyncio.to_thread(_attempt, partial(self._saved, state))
        self.document.add_next_tick_callback(partial(self.saved.update, text=paragraphs(said)))

    def _saved(self, state: State) -> str:
        write_whole({self.output: self.explorer.saved(state.choices)}, inputs=[self.design])
        return f"Saved: {self.output}"


def _drawn(explorer: Explorer, state: State) -> tuple[Linear, Run]:
    return explorer.linear(state.choices, state.true), explorer.run(state)


def _attempt(compute: Callable[[], Any]) -> Any:
    """What was computed, or the sentence with which it was refused."""
    try:
        return compute()
    except REFUSALS as error:
        return str(error)


def _words(name: str, polite: bool = False) -> Div:
    attributes = {"aria-live": "polite"} if polite else {}
    return Div(
        name=name,
        html_attributes=attributes,
        stylesheets=[TABLE],
        sizing_mode="stretch_width",
        disable_math=True,
    )
