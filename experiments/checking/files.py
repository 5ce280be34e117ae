"""What a check found as files that other programs read: JUnit's XML for a CI server, Markdown for a job's summary."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from experiments.checking.answers import Outcome, answers
from experiments.checking.check_model import ModelCheck
from experiments.checking.words import describe, first_sentence, tables
from identification.base.errors import printable

SUITE = "antiwindup check"


def junit(found: ModelCheck) -> str:
    """A test case for each question about each sweep: what does not hold is a failure, what is unknown is skipped."""
    given = answers(found)
    counts = {
        "tests": len(given),
        "failures": sum(each.outcome.fails for each in given),
        "errors": 0,
        "skipped": sum(each.outcome is Outcome.OPEN for each in given),
    }
    numbers = {name: str(count) for name, count in counts.items()}
    root = Element("testsuites", {"name": SUITE, **{k: numbers[k] for k in ("tests", "failures", "errors")}})
    suite = SubElement(root, "testsuite", {"name": SUITE, **numbers})
    for each in given:
        case = SubElement(
            suite, "testcase", {"name": printable(f"{each.sweep}: {each.question}"), "classname": "check"}
        )
        sentence = printable(each.sentence)
        if each.outcome.fails:
            SubElement(case, "failure", {"message": sentence, "type": each.question}).text = sentence
        elif each.outcome is Outcome.OPEN:
            SubElement(case, "skipped", {"message": sentence})
        else:
            SubElement(case, "system-out").text = sentence
    SubElement(suite, "system-out").text = printable(first_sentence(found))
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def markdown(found: ModelCheck) -> str:
    """The first sentence, the answers as a table, and the parameters of each sweep as one."""
    words = {outcome: f"**{outcome.value.lower()}**" for outcome in Outcome if outcome.fails}
    given = [
        (_escaped(each.sweep), each.question, words.get(each.outcome, each.outcome.value), _escaped(each.sentence))
        for each in answers(found)
    ]
    lines = [f"**{_escaped(first_sentence(found))}.**", "", *_table(("sweep", "question", "answer", "why"), given)]
    for sweep in found.sweeps:
        lines += ["", _escaped(describe(sweep))]
        for head, *body in tables(found, sweep):
            lines += ["", *_table(head, body)]
    return "\n".join(lines) + "\n"


def _table(head: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *body)]


def _escaped(text: str) -> str:
    """A text that Markdown shows as it is, on one line of a table."""
    return re.sub(r"([\\`*_{}\[\]<>#|~])", r"\\\1", printable(text))
