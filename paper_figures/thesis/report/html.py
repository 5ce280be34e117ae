"""What the report says -> one page of HTML that needs nothing else, and its file."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from identification.base.errors import InputError, printable, printable_lines
from identification.base.files import write_whole
from paper_figures.look.style import LINES
from paper_figures.thesis.report.content import Content
from paper_figures.thesis.report.inputs import LEDGER
from paper_figures.thesis.report.ledger import colour
from paper_figures.thesis.report.typeset import typeset

HERE = Path(__file__).parent
TEMPLATE = "report.html.j2"
SCRIPTS = ("report.js", "zoom.js")
NUMERIC = ("printed", "computed", "tolerance")
FOLDED = ("quote", "reason", "evidence")
"""Columns of the ledger that stand folded in its last one."""

LOOKS = {
    run: str(LINES[kind]["color"])
    for run, kind in (
        *(("reference", "reference"), ("none", "without anti-windup"), ("thesis", "thesis anti-windup")),
        *(("corrected", "corrected anti-windup"), ("back-calculation", "back-calculation")),
        *(("conditioning", "conditioning"), ("observer", "observer"), ("static", "static")),
        *(("internal-model", "internal model"), ("weston-postlethwaite", "Weston and Postlethwaite")),
    )
}
"""The colour of each run of a table over time, as the figures have it."""


def report_html(content: Content) -> str:
    """Return the page; the same content gives the same bytes.

    Parameters
    ----------
    content
        All that it says. The page holds each of its tables and pictures once, compressed; its script unpacks them.
    """
    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: printable_lines(value) if type(value) is str else value,  # no HTML holds what is not
    )
    environment.filters.update(breakable=_breakable, size=file_size, colour=colour, typeset=typeset)
    return environment.get_template(TEMPLATE).render(
        content=content,
        columns=[column for column in LEDGER if column not in FOLDED],
        folded=FOLDED,
        numeric=NUMERIC,
        css=Markup((HERE / "report.css").read_text(encoding="utf-8")),  # ours, and no user's text in it
        js=Markup("".join((HERE / name).read_text(encoding="utf-8") for name in SCRIPTS)),
        lines=Markup(json.dumps(LOOKS)),
    )


def write_report(content: Content, build: Path, inputs: Iterable[Path]) -> Path:
    """Write the page to BUILD/report/index.html, which must not be one of the inputs, and return its path.

    Raises
    ------
    InputError
        The folder cannot be made or written to.
    """
    page = report_html(content)
    path = build / "report" / "index.html"
    try:
        path.parent.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{path.parent}: cannot be made ({error.strerror})") from None
    write_whole({path: page}, inputs)
    return path


def file_size(text: str) -> str:
    """The size of a text as a file, in words."""
    count = len(text.encode("utf-8"))
    for unit, size in (("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.2g} {unit}" if count < 10 * size else f"{count / size:.0f} {unit}"
    return f"{count} bytes"


def _breakable(name: str) -> Markup:
    """A name that a line may break in after a dot, a colon, a stroke or an underscore."""
    return Markup("<wbr>").join(escape(part) for part in re.split(r"(?<=[.:/_])", printable(name)))
