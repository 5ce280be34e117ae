"""What the report says -> one page of HTML that needs nothing else, and its file."""

from __future__ import annotations

import gzip
import re
from base64 import b64encode
from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from identification.base.errors import InputError, printable, printable_lines
from identification.base.files import write_whole
from paper_figures.thesis.report.content import Content
from paper_figures.thesis.report.inputs import LEDGER
from paper_figures.thesis.report.ledger import colour

HERE = Path(__file__).parent
TEMPLATE = "report.html.j2"
NUMERIC = ("printed", "computed", "tolerance")


def report_html(content: Content) -> str:
    """Return the page; the same content gives the same bytes.

    Parameters
    ----------
    content
        All that it says. Each of its tables is embedded once, compressed, and every link to it unpacks that.
    """
    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: printable_lines(value) if type(value) is str else value,  # no HTML holds what is not
    )
    environment.filters.update(packed=_packed, breakable=_breakable, size=file_size, colour=colour)
    return environment.get_template(TEMPLATE).render(
        content=content,
        columns=LEDGER,
        numeric=NUMERIC,
        css=Markup((HERE / "report.css").read_text(encoding="utf-8")),  # ours, and no user's text in it
        js=Markup((HERE / "report.js").read_text(encoding="utf-8")),
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


def _packed(text: str) -> str:
    """The text as UTF-8, compressed, in letters and digits: half its size, and nothing in it is read as HTML."""
    return b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode()
