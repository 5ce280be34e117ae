"""The judged ledger -> docs/thesis/claims.md: counts, what is unchecked, what differs and why, what agrees."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from identification.base.errors import InputError

TITLES = {
    "unchecked": "Unchecked",
    "differs": "What differs",
    "not_reproducible": "What cannot be reproduced",
    "agrees": "What agrees",
    "input": "Inputs, transcribed",
}
HEAD = """# The thesis's claims, judged

This page lists every number that the thesis's text prints, and every statement of it that can be tested, beside
what we compute. `make claims` makes it from `data/thesis/claims.csv`. `make test` fails when a verdict in that
ledger is not the computed one, in either direction.

A number agrees when the computed one lies within half a unit of its last printed digit. Where the rounding of the
printed inputs can move it farther, it agrees within that. A statement counts as printed *true*. We test a formula
by evaluating both sides, on chapter 2's loop with our weights and with others, since the thesis prints none. Inputs
are what the thesis chose or measured. We compare them with what this project uses; they count as transcribed, never
as reproduced.

The plant is the set `implied`. We read its nine parameters off the printed theta_2, so that the agreement of
theta_2 proves nothing. The agreement of theta_1, K_1, both G_A, C_aw and (4.8) does: the same parameters give them
back, except for omega_d1 of (4.8). C_0, F, K_0 and Table 4.2 follow from a, e, f, omega and T_d alone."""

NOT_COUNTED = """The ledger's quotes or the exceptions have changed since the numbers of the thesis's text were counted:
`python -m experiments thesis coverage TEXT --record data/thesis/coverage.json` counts again."""


def claims_page(judged: pd.DataFrame, record: Mapping[str, Any], counted: bool) -> str:
    """The page as Markdown.

    Parameters
    ----------
    judged
        As :func:`experiments.thesis.claims.ledger.recompute` returns it.
    record
        As :func:`experiments.thesis.claims.coverage.coverage_record` returns it.
    counted
        Whether that is for the quotes and exceptions as they are now.

    Raises
    ------
    InputError
        A row has a verdict that the page has no section for.
    """
    unknown = set(judged["verdict"]) - set(TITLES)
    if unknown:
        raise InputError(f"the ledger has the verdict {', '.join(sorted(unknown))}; expected {', '.join(TITLES)}")
    parts = [HEAD, _counts(judged), _covered(record) if counted else NOT_COUNTED]
    for verdict, title in TITLES.items():
        rows = judged[judged["verdict"] == verdict]
        body = _with_reasons(rows) if verdict not in ("agrees", "input") else _by_quote(rows)
        parts += [f"## {title} ({len(rows)})", *body]
    return "\n\n".join(parts) + "\n"


def _counts(judged: pd.DataFrame) -> str:
    statement = judged["printed"] == "true"
    rows = [
        [title.lower(), sum(of & ~statement), sum(of & statement), sum(of)]
        for verdict, title in TITLES.items()
        for of in [judged["verdict"] == verdict]
    ]
    total = ["**all**", sum(~statement), sum(statement), len(judged)]
    return _table(["", "numbers", "statements", "together"], [*rows, total])


def _covered(record: Mapping[str, Any]) -> str:
    statuses = dict(record["statuses"])
    quoted, left = statuses.pop("quoted", 0), statuses.pop("left", 0)
    named = ", ".join(f"{count} {name}" for name, count in statuses.items())
    return (
        f"The thesis's text has {record['numbers']} numbers. Rows of this page quote {quoted} of them. "
        f"`data/thesis/exceptions.csv` explains why others need no row: {named}. {left} are left. The text is not "
        "shipped; `python -m experiments thesis coverage TEXT` counts again in yours (ours has the SHA-256 "
        f"`{record['text_sha256'][:16]}...`)."
    )


def _with_reasons(rows: pd.DataFrame) -> Iterator[str]:
    cells = [
        [
            f"`{row.id}`",
            f"{row.where}: {_code(str(row.quote))}",
            row.printed,
            _computed(row),
            row.reason,
            " ".join(_link(test) for test in str(row.evidence).split()),
        ]
        for row in rows.itertuples()
    ]
    yield _table(["id", "print", "printed", "computed", "why", "evidence"], cells)


def _by_quote(rows: pd.DataFrame) -> Iterator[str]:
    for (where, quote), group in rows.groupby(["where", "quote"], sort=False):
        cells = [
            [f"`{row.id}`", f"{row.printed} {row.unit}".strip(), _computed(row), _room(row), row.reason]
            for row in group.itertuples()
        ]
        yield f"{where}: {_code(str(quote))}"
        yield _table(["id", "printed", "computed", "may differ by", "remark"], cells)


def _computed(row: Any) -> str:
    if pd.isna(row.computed):
        return ""
    if row.printed == "true":
        return "holds" if row.computed == 1 else "does not hold"
    return f"{row.computed:.5g}"


def _room(row: Any) -> str:
    return "" if row.half_unit == 0 else f"{row.tolerance:.2g}"


def _link(test: str) -> str:
    file, _, name = test.partition("::")
    return f"[{name}](../../{file})"


def _code(text: str) -> str:
    return f"`{text}`"


def _table(head: list[str], rows: list[list[Any]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", r"\|") for cell in line) + " |" for line in lines)
