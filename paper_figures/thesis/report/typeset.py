"""A quote of the thesis -> text with its formulas as MathML, which browsers typeset without a script."""

from __future__ import annotations

import re
from functools import cache
from xml.etree import ElementTree

from latex2mathml.converter import convert
from markupsafe import Markup, escape

from identification.base.errors import printable_lines

CHILDREN = {"mfrac": 2, "msup": 2, "msub": 2, "msubsup": 3, "munder": 2, "mover": 2, "munderover": 3, "mroot": 2}
"""Elements of MathML that need so many children."""

ELEMENTS = {"math", "mrow", "mi", "mn", "mo", "mtext", "mspace", "msqrt", "mstyle", "mpadded", "mtable", "mtr", "mtd"}
"""The other elements that a formula may have."""

NAMESPACE = "http://www.w3.org/1998/Math/MathML"
BETWEEN = re.compile(r"\\[a-zA-Z]+(?:\{[^{}]*\})?(?:[_^](?:\{[^{}]*\}|[^\s{}]))?|\w+[_^]\{[^{}]*\}")
"""What a sentence may hold of LaTeX outside of the dollar signs."""


@cache
def typeset(quote: str) -> Markup:
    """Return a quote as HTML: what stands between dollar signs, or a whole formula, as MathML.

    What is no formula, or has a command that the converter does not know, stays as it is in print.
    """
    if "$" in quote:
        parts = quote.split("$")
        inside = [_formula(part, "inline") if k % 2 else _sentence(part) for k, part in enumerate(parts)]
        return Markup("").join(inside)
    return _formula(quote, "block") if is_formula(quote) else _sentence(quote)


def is_formula(quote: str) -> bool:
    """Whether a quote without dollar signs is a formula: it has a command of LaTeX, and no words outside of texts."""
    without = re.sub(r"\\text\{[^{}]*\}|\\[a-zA-Z]+", "", quote)
    return "\\" in quote and not re.search(r"[a-zA-Z]{4,}", without)


def _sentence(text: str) -> Markup:
    """Prose, in which single symbols may be LaTeX."""
    parts, end = [], 0
    for found in BETWEEN.finditer(text):
        parts += [escape(text[end : found.start()]), _formula(found.group(), "inline")]
        end = found.end()
    return Markup("").join([*parts, escape(text[end:])])


def _formula(latex: str, display: str) -> Markup:
    """MathML of a formula, with its source as its text for those who cannot see; or the source itself."""
    source = printable_lines(latex)
    try:
        text = convert(source.replace("&=", "="), display=display)
        tree = ElementTree.fromstring(text)
    except Exception:  # the converter raises errors of many classes, and writes what is no XML
        return Markup("<code>{}</code>").format(source)
    for element in tree.iter():
        name = element.tag.removeprefix(f"{{{NAMESPACE}}}")
        unknown = name not in ELEMENTS and len(element) != CHILDREN.get(name)
        if unknown or "\\" in (element.text or ""):
            return Markup("<code>{}</code>").format(source)
    _, _, inside = re.sub("&#x([0-9A-F]+);", lambda code: escape(chr(int(code[1], 16))), text).partition(">")
    return Markup('<math display="{}" alttext="{}">{}').format(display, source, Markup(inside))
