"""Every row of the ledger is well formed, and its recomputed verdict is the status that it states."""

import ast
from functools import cache
from pathlib import Path

import pandas as pd
import pytest

from experiments.thesis.claims.coverage import quotes_its_number
from experiments.thesis.claims.ledger import SLACK, read_ledger
from experiments.thesis.claims.printed_number import read_number

ROOT = Path(__file__).resolve().parents[2]
ROWS = read_ledger().to_dict("records")
KINDS = {"input", "result", "literature"}
DISAGREES = {"differs", "not_reproducible"}
STATUSES = DISAGREES | {"agrees", "input", "unchecked"}


def test_ids_are_unique(ledger: pd.DataFrame):
    assert ledger["id"].is_unique


RULES = {
    "has an id": lambda row: row["id"],
    "says where": lambda row: row["where"],
    "quotes its number": lambda row: quotes_its_number(row["quote"], row["printed"]),
    "prints a number": lambda row: read_number(row["printed"]).half_unit >= 0,
    "is of a kind": lambda row: row["kind"] in KINDS,
    "has a status": lambda row: row["status"] in STATUSES,
    "is unchecked without a function": lambda row: (row["status"] == "unchecked") == (row["compute"] == ""),
    "says what it touches unless it agrees": lambda row: bool(row["touches"]) != (row["status"] in {"agrees", "input"}),
    "gives a reason unless it agrees": lambda row: row["reason"] or row["status"] in {"agrees", "input"},
    # inputs are transcribed, never reproduced: they can only be contradicted
    "is an input if its status is": lambda row: row["kind"] == "input" or row["status"] != "input",
    "agrees with no input": lambda row: row["kind"] != "input" or row["status"] in {"input", "differs", "unchecked"},
    # a statement holds or does not, and its id says that it is one
    "is named a statement if it is": lambda row: (row["printed"] == "true") == row["id"].startswith("statement."),
    "has evidence unless it agrees": lambda row: bool(row["evidence"]) == (row["status"] in DISAGREES),
}


@pytest.mark.parametrize("rule", RULES)
def test_every_row(rule: str):
    assert [row["id"] for row in ROWS if not RULES[rule](row)] == []


@cache
def named_in(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_evidence_exists():
    tests = {test for row in ROWS for test in row["evidence"].split()}
    split = {test: test.split("::") for test in tests}
    assert [test for test, (_, name) in split.items() if not name.startswith("test_")] == []
    assert [test for test, (file, name) in split.items() if name not in named_in(file)] == []


def test_verdicts_are_the_statuses_in_the_ledger(recomputed: pd.DataFrame):
    wrong = recomputed[recomputed["verdict"] != recomputed["status"]]
    assert wrong[["status", "verdict", "computed", "tolerance"]].to_dict("index") == {}


def test_no_agreement_needs_the_rounding_of_the_inputs(recomputed: pd.DataFrame):
    """The set ``implied`` gives back every printed digit, so that the propagated rounding helps no row."""
    agreeing = recomputed[recomputed["verdict"].isin(["agrees", "input"])]
    printed = agreeing["printed"].map(lambda text: read_number(text).value)
    assert ((agreeing["computed"] - printed).abs() <= agreeing["half_unit"] + SLACK * printed.abs()).all()


def test_both_roundings_of_one_coefficient_agree(recomputed: pd.DataFrame):
    """175^2 = 30625 is half-way between 3.062e4 and 3.063e4, and the thesis prints both."""
    roundings = recomputed.loc[["K1.pole_pair_1.s0", "C_aw.pole_pair_2.s0"]]
    assert set(roundings["printed"]) == {"3.062e4", "3.063e4"}
    assert set(roundings["verdict"]) == {"agrees"}


def test_inputs_are_transcribed_exactly(recomputed: pd.DataFrame):
    """What this project uses is the printed number itself, not one that rounds to it."""
    inputs = recomputed[recomputed["verdict"] == "input"]
    printed = inputs["printed"].map(lambda text: read_number(text).value)
    assert len(inputs) > 30
    assert ((inputs["computed"] - printed).abs() <= SLACK * printed.abs()).all()
