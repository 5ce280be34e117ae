"""Which numbers of a text are quoted, which are named exceptions, and which are left."""

import json
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from experiments.__main__ import main
from experiments.thesis.claims.coverage import (
    EXCEPTION_COLUMNS,
    coverage,
    coverage_record,
    quotes_its_number,
    quotes_missing_from,
    quotes_sha256,
    read_exceptions,
    read_record,
)
from identification.base.errors import InputError

TEXT = r"""3.4 Results

The gain is 7.5 and the
peak 3.5; see Fig. 5.12 and [3, 14]. With $x_1^{2} = 1 + 4.5 \times 10^{-3} s$ we
have (7.8), a limit of [-10, 10] and 3 modes; $\beta = 1/40$ of \frac{1}{40}.
"""
QUOTES = pd.DataFrame(
    [
        ("a", "The gain is 7.5 and the peak 3.5", "7.5"),
        ("b", r"x_1^{2} = 1 + 4.5 \times 10^{-3} s", "4.5e-3"),
        ("c", "a limit of [-10, 10]", "10"),
        ("d", r"$\beta = 1/40$ of \frac{1}{40}", "1/40"),
    ],
    columns=["id", "quote", "printed"],
)


@pytest.fixture(scope="module")
def exceptions() -> pd.DataFrame:
    return read_exceptions()


def statuses(text: str, ledger: pd.DataFrame, exceptions: pd.DataFrame) -> list[tuple[str, str]]:
    return list(coverage(text, ledger, exceptions)[["number", "status"]].itertuples(index=False, name=None))


def test_every_number_gets_its_status(exceptions: pd.DataFrame):
    assert statuses(TEXT, QUOTES, exceptions) == [
        ("3.4", "heading"),
        ("7.5", "quoted"),
        ("3.5", "left"),  # inside a quote, but no row's number
        ("5.12", "cross-reference"),
        ("3", "citation"),
        ("14", "citation"),
        ("1", "index"),
        ("2", "exponent"),
        ("1", "one of a sum or fraction"),
        *[("4.5", "quoted"), ("10", "quoted"), ("3", "quoted")],  # one number: 4.5 x 10^-3
        ("7.8", "equation number"),
        *[("10", "quoted")] * 2,
        ("3", "left"),
        *[("1", "quoted"), ("40", "quoted")] * 2,
    ]


def test_a_number_counts_only_inside_its_rows_quote(exceptions: pd.DataFrame):
    text = "The gain is 7.5 here. Elsewhere 7.5 stands alone, and 17.5, 7.55 and 7.5.1 are others."
    ledger = pd.DataFrame([("a", "The gain is 7.5", "7.5")], columns=["id", "quote", "printed"])
    assert [status for _, status in statuses(text, ledger, exceptions)] == ["quoted", *["left"] * 4]
    ledger.loc[0, "quote"] = text
    assert [status for _, status in statuses(text, ledger, exceptions)] == ["quoted", "quoted", "left", "left", "left"]


@pytest.mark.parametrize(
    ("text", "status"),
    [
        ("$1 + s$", "one of a sum or fraction"),
        ("1 + s", "left"),
        ("$3 + s$", "left"),
        (r"$\lim_{s \rightarrow 0}$", "zero of a condition"),
        (r"$2\zeta s$", "factor of two"),
        ("$Q(s) = 1$", "equal to one"),
        ("$F_1$", "index"),
        ("$s^2$", "exponent"),
        # what a claim may look like
        *[(claim, "left") for claim in ("$2$ m", "$1 s$", "$K = 2$", "$n = 1$", r"$0 \%$", "from 0", "X_5", "$2 V$")],
        (r"$2 \text{ m}$", "left"),
        ("$s^7$", "left"),
        ("a stray $ here\n\n1 + 1", "left"),
    ],
)
def test_what_counts_as_an_exception(text: str, status: str, exceptions: pd.DataFrame):
    assert {found for _, found in statuses(text, QUOTES[:0], exceptions)} == {status}


def test_lines_and_contexts(exceptions: pd.DataFrame):
    found = coverage(TEXT, QUOTES, exceptions)
    left = found[found["status"] == "left"]
    assert list(left["line"]) == [4, 5]
    assert "peak 3.5; see" in left["context"].iloc[0]


def test_a_quote_may_break_lines_but_must_be_there():
    assert quotes_missing_from(TEXT, QUOTES) == []
    assert quotes_missing_from(TEXT.replace("the\npeak", "its\npeak"), QUOTES) == ["a"]


@pytest.mark.parametrize(
    ("quote", "printed", "holds"),
    [
        (r"5.687 \times 10^{15} (s", "5.687e15", True),
        (r"3.062 \times 10^4)", "3.062e4", True),
        (r"5.687 \times 10^{15} (s", "5.687e16", False),
        (r"- 1.02 \times 10^{-10}s", "-1.02e-10", True),
        (r"\frac{1}{40}", "1/40", True),
        (r"\pi/2)", "pi/2", True),
        ("values between 0 and 1", "0..1", True),
        ("values between 0 and 2", "0..1", False),
        ("has no overshoot", "no", True),
        ("has an overshoot", "no", False),
        ("whatever", "true", True),
        ("175.5", "175", False),
        ("0.175", "175", False),
    ],
)
def test_a_quote_holds_its_number(quote: str, printed: str, holds: bool):
    assert quotes_its_number(quote, printed) is holds


def test_the_kept_count_is_for_these_quotes_and_leaves_nothing(ledger: pd.DataFrame, exceptions: pd.DataFrame):
    """Else: `python -m experiments thesis coverage TEXT --record data/thesis/coverage.json`."""
    record = read_record()
    assert record["ledger_sha256"] == quotes_sha256(ledger, exceptions)
    assert "left" not in record["statuses"]
    assert sum(record["statuses"].values()) == record["numbers"] > 1000
    assert set(record["statuses"]) == {"quoted", *exceptions["name"]}


def test_the_record_of_a_text(exceptions: pd.DataFrame):
    covered = coverage(TEXT, QUOTES, exceptions)
    record = coverage_record(TEXT, covered, QUOTES, exceptions)
    assert record["numbers"] == len(covered) == 20
    assert record["statuses"]["left"] == 2
    other = QUOTES.assign(printed=["7.6", *QUOTES["printed"][1:]])
    assert quotes_sha256(other, exceptions) != record["ledger_sha256"]


@pytest.mark.parametrize(
    ("content", "part"),
    [
        ("name,pattern\n", "the columns are name, pattern"),
        (",".join(EXCEPTION_COLUMNS) + "\na,line,x,y\n", "line 2: scope is 'line'"),
        (",".join(EXCEPTION_COLUMNS) + "\na,text,(,y\n", "line 2: '(' is not a regular expression"),
        (",".join(EXCEPTION_COLUMNS) + "\nquoted,text,x,y\n", "line 2: an exception is named quoted"),
    ],
)
def test_bad_exceptions_are_refused(content: str, part: str, tmp_path: Path):
    path = tmp_path / "exceptions.csv"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_exceptions(path)
    assert part in str(refused.value)


@pytest.mark.parametrize(
    ("content", "part"),
    [("{", "line 1: "), ("[]", "expected an object"), ("{}", "the members are none; expected text_sha")],
)
def test_bad_records_are_refused(content: str, part: str, tmp_path: Path):
    path = tmp_path / "coverage.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=part):
        read_record(path)


def test_command_lists_what_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("experiments.thesis.claims.ledger.read_ledger", lambda: QUOTES)
    text, record = tmp_path / "text.md", tmp_path / "record.json"
    text.write_text(TEXT, encoding="utf-8")
    result = CliRunner().invoke(main, ["thesis", "coverage", str(text), "--record", str(record)])
    assert result.exit_code == 1
    assert "line 4: 3.5 is quoted by no claim" in result.output
    assert json.loads(record.read_text(encoding="utf-8"))["statuses"]["left"] == 2
    text.write_text("The gain is 7.5 and the peak 3.5", encoding="utf-8")
    assert (
        "b: its quote does not stand in the text" in CliRunner().invoke(main, ["thesis", "coverage", str(text)]).output
    )
    clean = TEXT.replace("peak 3.5", "peak").replace("3 modes", "modes")
    text.write_text(clean, encoding="utf-8")
    monkeypatch.setattr(
        "experiments.thesis.claims.ledger.read_ledger",
        lambda: QUOTES.replace({"quote": {" peak 3.5": " peak"}}, regex=True),
    )
    assert CliRunner().invoke(main, ["thesis", "coverage", str(text)]).exit_code == 0


def test_command_refuses_a_missing_text(tmp_path: Path):
    result = CliRunner().invoke(main, ["thesis", "coverage", str(tmp_path / "absent.md")])
    assert result.exit_code == 2
    assert "no such file" in result.output
