"""How a verdict comes about: digits, rounding of the inputs, NaN, and what is refused; and the command line."""

import math
import re
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from experiments.__main__ import main
from experiments.thesis.claims.equations_page import EQUATIONS
from experiments.thesis.claims.inputs import Inputs, rounded_inputs
from experiments.thesis.claims.ledger import COLUMNS, FUNCTION, LEDGER, read_ledger, recompute
from experiments.thesis.claims.printed_number import PrintedNumber, read_number
from identification.base.errors import InputError

THETA2 = "experiments.thesis.claims.checks.transfer_functions:theta2"
GAMMA_OPT = "experiments.thesis.claims.checks.parameters:gamma_opt"


def one_row(printed: str, compute: str = THETA2, row_id: str = "theta2.gain") -> pd.DataFrame:
    row = dict.fromkeys(COLUMNS, "") | {"id": row_id, "printed": printed, "compute": compute}
    return pd.DataFrame([row])


@pytest.mark.parametrize(
    ("text", "value", "half_unit"),
    [
        ("7.1", 7.1, 0.05),
        ("175", 175.0, 0.5),
        ("5.687e15", 5.687e15, 5e11),
        ("3.062e4", 30620.0, 5.0),
        ("8.1e-3", 8.1e-3, 5e-5),
        ("-1.02e-10", -1.02e-10, 5e-13),
        ("1/40", 0.025, 0.0),
        ("no", 0.0, 0.5),
        ("two", 2.0, 0.0),
        ("true", 1.0, 0.0),
        ("pi/2", math.pi / 2, 0.0),
        ("0..1", 0.5, 0.5),
    ],
)
def test_digits(text: str, value: float, half_unit: float):
    assert read_number(text) == PrintedNumber(value, pytest.approx(half_unit, rel=1e-12))


@pytest.mark.parametrize("text", ["", "about 4", "nan", "inf", "1/0", "1/x", "pi/0", "pi/x", "1..", "..2"])
def test_text_that_is_no_number_is_refused(text: str):
    with pytest.raises(InputError, match="is not a number"):
        read_number(text)


def test_rounded_inputs_have_the_digits_of_the_data(ledger: pd.DataFrame):
    inputs = rounded_inputs(ledger)
    assert inputs["implied.gain"] == PrintedNumber(7.105, pytest.approx(0.0005))
    assert inputs["implied.pole_modes.0.omega"] == PrintedNumber(282.0, 0.5)
    assert inputs["printed.theta2.gain"] == PrintedNumber(19.659, pytest.approx(0.0005))


def test_inputs_rounding_counts_only_outside_the_printed_digits():
    """19.659 comes out as 19.65906; K = 7.105 and the frequencies, known to half a unit, allow 0.226 around it."""
    within = recompute(one_row("19.659")).iloc[0]
    assert within["verdict"] == "agrees"
    assert within["tolerance"] == pytest.approx(0.0005, rel=1e-4)
    rounded = recompute(one_row("19.700")).iloc[0]
    assert rounded["verdict"] == "agrees"
    # d ln gain = dK/K + 2 d omega/omega over the four modes
    by_hand = 19.65906 * (0.0005 / 7.105 + 2 * 0.5 * (1 / 175 + 1 / 930 + 1 / 282 + 1 / 960))
    assert rounded["tolerance"] == pytest.approx(0.0005 + by_hand, rel=0.01)
    # what Table 2.1 gives is further away than that
    assert recompute(one_row("20.065")).iloc[0]["verdict"] == "differs"


def test_nan_is_not_reproducible():
    row = recompute(one_row("0.0684", GAMMA_OPT, "delay_free.gamma_opt")).iloc[0]
    assert math.isnan(row["computed"])
    assert row["verdict"] == "not_reproducible"


def test_without_compute_a_row_is_unchecked():
    row = recompute(one_row("7.1", "")).iloc[0]
    assert row["verdict"] == "unchecked"
    assert math.isnan(row["computed"])


def test_an_input_is_transcribed_and_not_reproduced():
    transcribed = "experiments.thesis.claims.inputs:transcribed"
    row = one_row("7.1", transcribed, "table_2_1.K").assign(kind="input")
    assert recompute(row).iloc[0]["verdict"] == "input"
    assert recompute(row.assign(printed="7.2")).iloc[0]["verdict"] == "differs"


def test_what_is_printed_twice_is_computed_once():
    rows = pd.concat([one_row("19.659"), one_row("20", row_id="theta2.gain#2")], ignore_index=True)
    judged = recompute(rows)
    assert list(judged["verdict"]) == ["agrees", "agrees"]
    assert judged["computed"].nunique() == 1


def test_a_statement_gets_no_tolerance(monkeypatch: pytest.MonkeyPatch):
    """Whatever the rounding of the inputs would do to it."""

    def statement(inputs: Inputs) -> dict[str, float]:
        return {"statement.x": float(inputs["implied.gain"] > 7.105)}

    monkeypatch.setattr("experiments.thesis.claims.checks.parameters.gamma_opt", statement)
    assert recompute(one_row("true", GAMMA_OPT, "statement.x")).iloc[0]["verdict"] == "differs"
    monkeypatch.setattr("experiments.thesis.claims.checks.parameters.gamma_opt", lambda inputs: {"statement.x": 1.0})
    assert recompute(one_row("true", GAMMA_OPT, "statement.x")).iloc[0]["verdict"] == "agrees"


@pytest.mark.parametrize("name", ["experiments.thesis.claims.checks.parameters:nothing", "no_such_module:f", "theta2"])
def test_unknown_function_is_refused(name: str):
    with pytest.raises(InputError, match="cannot be imported"):
        recompute(one_row("1", name))


def test_unknown_id_is_refused():
    with pytest.raises(InputError, match=r"expected 'theta2\.phase'"):
        recompute(one_row("1", row_id="theta2.phase"))


def test_ledger_with_other_columns_is_refused(tmp_path: Path):
    path = tmp_path / "claims.csv"
    path.write_text("id,printed\n", encoding="utf-8")
    with pytest.raises(InputError, match="the columns are id, printed"):
        read_ledger(path)
    with pytest.raises(InputError, match="no such file"):
        read_ledger(tmp_path / "absent.csv")


@pytest.mark.parametrize(
    ("lines", "part"),
    [
        ([""], "the columns are none"),
        ([",".join(COLUMNS)], "holds a header and no rows"),
        ([",".join(COLUMNS), "a,b"], "line 2: 2 cells; expected 11"),
        ([",".join(COLUMNS), 'a,"b'], "line 2: unexpected end of data"),
        ([",".join(COLUMNS), "a,,,1,,,,,,,", "a,,,1,,,,,,,"], "the id a occurs twice"),
        (
            [",".join(COLUMNS), "a,,,1,,,os:getcwd,,,,"],
            "compute of a is 'os:getcwd'; expected experiments.module:function",
        ),
    ],
)
def test_ledgers_that_are_none_are_refused(lines: list[str], part: str, tmp_path: Path):
    path = tmp_path / "claims.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_ledger(path)
    assert part in str(refused.value)


@pytest.mark.parametrize(
    ("name", "named"),
    [
        (THETA2, True),
        ("experiments.runs:peak", True),
        ("experiments:peak", False),
        ("experiments.runs.:peak", False),
        ("experiments.runs:", False),
        ("design.blocks.ball:peak", False),
        ("experiments/runs:peak", False),
    ],
)
def test_compute_names_a_function_of_a_module_of_this_room(name: str, named: bool):
    assert bool(re.fullmatch(FUNCTION, name)) == named


@pytest.mark.parametrize(
    ("command", "option", "target"),
    [("coverage", "--record", LEDGER), ("claims", "--page", LEDGER), ("equations", "--page", EQUATIONS)],
)
def test_no_command_writes_over_what_it_reads(
    command: str, option: str, target: Path, small_ledger: Path, tmp_path: Path
):
    before = target.read_bytes()
    text = tmp_path / "text.md"
    text.write_text("7.5\n", encoding="utf-8")
    arguments = {"coverage": [str(text)], "claims": ["--output", str(tmp_path)], "equations": []}[command]
    link = tmp_path / "link"
    link.symlink_to(target)
    for path in (target, link):
        result = CliRunner().invoke(main, ["thesis", command, *arguments, option, str(path)])
        assert result.exit_code == 2
        assert "is an input too" in result.output
    assert target.read_bytes() == before
    assert {path.name for path in tmp_path.iterdir()} == {"text.md", "link"}


def test_two_outputs_of_one_path_are_refused(small_ledger: Path):
    path = small_ledger / ".." / small_ledger.name / "claims.csv"
    result = CliRunner().invoke(main, ["thesis", "claims", "--output", str(small_ledger), "--page", str(path)])
    assert result.exit_code == 2
    assert "two of these outputs are the same file" in result.output
    assert not list(small_ledger.iterdir())


@pytest.fixture
def small_ledger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    table = pd.concat([one_row("19.659").assign(status="agrees"), one_row("7.1", "", "K").assign(status="unchecked")])
    monkeypatch.setattr("experiments.thesis.claims.ledger.read_ledger", lambda: table.reset_index(drop=True))
    return tmp_path


def test_command_writes_the_table_and_prints_counts(small_ledger: Path):
    result = CliRunner().invoke(main, ["thesis", "claims", "--output", str(small_ledger)])
    assert result.exit_code == 0
    assert [line.split() for line in result.output.splitlines()[1:]] == [["agrees", "1"], ["unchecked", "1"]]
    written = pd.read_csv(small_ledger / "claims.csv")
    assert tuple(written.columns) == (*COLUMNS, "computed", "half_unit", "tolerance", "verdict")
    assert written["computed"].iloc[0] == pytest.approx(19.65906, abs=1e-5)


def test_command_names_the_rows_whose_status_is_out_of_date(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(
        "experiments.thesis.claims.ledger.read_ledger", lambda: one_row("19.659").assign(status="differs")
    )
    result = CliRunner().invoke(main, ["thesis", "claims", "--output", str(tmp_path)])
    assert result.exit_code == 0
    assert "theta2.gain: the ledger says differs, recomputed it agrees" in result.output


def test_command_refuses_a_missing_folder(small_ledger: Path):
    result = CliRunner().invoke(main, ["thesis", "claims", "--output", str(small_ledger / "absent")])
    assert result.exit_code == 2
    assert "no such folder" in result.output


def test_command_writes_the_page_and_the_table_or_neither(small_ledger: Path):
    page = small_ledger / "CLAIMS.md"
    result = CliRunner().invoke(main, ["thesis", "claims", "--output", str(small_ledger), "--page", str(page)])
    assert result.exit_code == 0
    assert "| `theta2.gain` | 19.659 | 19.659 |" in page.read_text(encoding="utf-8")
    (small_ledger / "claims.csv").unlink()
    nowhere = small_ledger / "absent" / "CLAIMS.md"
    result = CliRunner().invoke(main, ["thesis", "claims", "--output", str(small_ledger), "--page", str(nowhere)])
    assert result.exit_code == 2
    assert not (small_ledger / "claims.csv").exists()
