"""Every test that a page of docs/ names exists, and the errata explain every claim that does not agree."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from experiments.thesis.claims.ledger import read_ledger

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("page", "least"),
    [
        ("anti_windup.md", 8),
        ("outside_the_class.md", 7),
        ("campaigns.md", 4),
        ("closed_loop.md", 8),
        ("errata.md", 30),
        ("unprinted_conditions.md", 3),
    ],
)
def test_every_test_that_the_page_names_exists(page: str, least: int) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", text)
    assert len(named) >= least
    for file, name in named:
        assert f"def {name}(" in (ROOT / file).read_text(encoding="utf-8"), f"{file}::{name}"


def test_the_errata_explain_every_claim_that_does_not_agree() -> None:
    """Each in one entry, with a test that the ledger names too."""
    ledger = read_ledger().set_index("id")
    entries = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8").split("\n### ")[1:]
    explained: list[str] = []
    for entry in entries:
        text, _, rows = entry.partition("- *Rows:*")
        names = re.findall(r"`([\w.#]+)`", rows.partition("\n\n")[0])
        assert names, entry.splitlines()[0]
        evidence = set(re.findall(r"`(tests/[\w/]+\.py::\w+)`", text))
        assert not [name for name in names if not evidence & set(ledger.loc[name, "evidence"].split())]
        explained += names
    wanted = ledger.index[ledger["status"].isin(["differs", "not_reproducible"])]
    assert sorted(explained) == sorted(wanted)
