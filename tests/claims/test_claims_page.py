"""docs/thesis/claims.md: counts, then what is unchecked, then what differs, then what agrees."""

import re
from pathlib import Path

import pandas as pd
import pytest

from experiments.thesis.claims.coverage import read_record
from experiments.thesis.claims.page import claims_page
from identification.base.errors import InputError

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def page(judged: pd.DataFrame) -> str:
    return claims_page(judged, read_record(), True)


def test_the_page_in_the_repository_is_current(page: str):
    """After a change of the ledger: `make claims`."""
    assert (ROOT / "docs/thesis/claims.md").read_text(encoding="utf-8") == page


def test_the_sections_stand_in_their_order_with_their_counts(page: str, judged: pd.DataFrame):
    titles = re.findall(r"^## (.*) \((\d+)\)$", page, flags=re.MULTILINE)
    assert [title for title, _ in titles] == [
        "Unchecked",
        "What differs",
        "What cannot be reproduced",
        "What agrees",
        "Inputs, transcribed",
    ]
    assert sum(int(count) for _, count in titles) == len(judged)
    assert (
        f"| **all** | {sum(judged['printed'] != 'true')} | {sum(judged['printed'] == 'true')} | {len(judged)} |" in page
    )


def test_the_readme_gives_the_same_counts(judged: pd.DataFrame):
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    counts = pd.crosstab(judged["printed"].eq("true"), judged["verdict"])
    for is_statement, beginning in ((False, "Of the numbers in the text,"), (True, "that can be tested,")):
        agree, differ, lost = counts.loc[is_statement, ["agrees", "differs", "not_reproducible"]]
        assert f"{beginning} {agree} agree, {differ} differ and {lost} cannot be reproduced" in readme


def test_every_row_stands_once(page: str, judged: pd.DataFrame):
    ids = re.findall(r"^\| `([^`]+)` \|", page, flags=re.MULTILINE)
    assert sorted(ids) == sorted(judged["id"])


def test_what_differs_stands_with_reason_and_links_to_its_evidence(page: str, judged: pd.DataFrame):
    for row in judged[judged["verdict"].isin(["differs", "not_reproducible"])].itertuples():
        line = next(line for line in page.splitlines() if line.startswith(f"| `{row.id}` |"))
        assert str(row.reason).replace("|", r"\|") in line
        for test in str(row.evidence).split():
            file, name = test.split("::")
            assert f"[{name}](../../{file})" in line
            assert (ROOT / file).is_file()


def test_a_verdict_without_a_section_is_refused(judged: pd.DataFrame):
    with pytest.raises(InputError, match="has the verdict perhaps"):
        claims_page(judged.assign(verdict="perhaps"), read_record(), True)


def test_a_count_of_other_quotes_is_not_given(judged: pd.DataFrame):
    page = claims_page(judged, read_record(), False)
    assert "have changed since" in page
    assert "are quoted by a row" not in page
