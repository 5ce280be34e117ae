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
STATUSES = {"agrees", "differs", "not_reproducible", "input", "unchecked"}


def test_ids_are_unique(ledger: pd.DataFrame):
    assert ledger["id"].is_unique


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["id"])
def test_row_is_well_formed(row: dict[str, str]):
    assert row["id"]
    assert row["where"]
    assert quotes_its_number(row["quote"], row["printed"])
    assert read_number(row["printed"]).half_unit >= 0
    assert row["kind"] in KINDS
    assert row["status"] in STATUSES
    assert (row["status"] == "unchecked") == (row["compute"] == "")
    assert row["reason"] or row["status"] in {"agrees", "input"}
    # inputs are transcribed, never reproduced: they can only be contradicted
    assert (row["kind"] == "input") >= (row["status"] == "input")
    assert row["kind"] != "input" or row["status"] in {"input", "differs", "unchecked"}
    # a statement holds or does not, and its id says that it is one
    assert (row["printed"] == "true") == row["id"].startswith("statement.")


@cache
def named_in(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["id"])
def test_what_does_not_agree_has_evidence_that_exists(row: dict[str, str]):
    evidence = row["evidence"].split()
    assert bool(evidence) == (row["status"] in {"differs", "not_reproducible"})
    for test in evidence:
        file, _, name = test.partition("::")
        assert name.startswith("test_")
        assert name in named_in(file), test


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["id"])
def test_verdict_is_the_status_in_the_ledger(row: dict[str, str], recomputed: pd.DataFrame):
    found = recomputed.loc[row["id"]]
    assert found["verdict"] == row["status"], f"computed {found['computed']}, tolerance {found['tolerance']}"


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
