"""The distributions of a campaign against known ones, whatever the order and the pieces of the file; bad files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow
import pytest
from click.testing import CliRunner
from pyarrow import parquet

from experiments.__main__ import main
from experiments.campaign import distributions as module
from experiments.campaign.distributions import campaign_tables
from experiments.campaign.seal import SEAL, Seal
from identification.base.errors import InputError

FACTS = {"plants": "40", "seed": "7", "lower_limit": "-10", "limit": "12.5", "rate_limit": "300", "horizon_s": "25"}
NEVER = {"peak_error": np.nan, "steady_error": np.nan, "recovery_s": np.nan}


def plants(count: int = 40) -> pd.DataFrame:
    """Plant k at distance (k + 1/2)/count; every eighth diverges with none, and with the thesis's nothing recovers."""
    k = np.arange(count)
    common = {"plant": k, "distance": (k + 0.5) / count, "linear_stable": k < 3 * count // 4}
    table = []
    for order, run in enumerate(module.RUNS):
        rows = pd.DataFrame(common | {"anti_windup": run, "diverged": (k % 8 == 7) & (run == "none")})
        rows["guaranteed_sector"] = 0.75 if run == "corrected" else 0.0
        rows["covered"] = (k % 4 == 0) & (run == "corrected")
        rows["peak_error"] = 50.0 + (order + 1) * k
        rows["steady_error"] = 10.0 ** (-k / 4.0)
        rows["recovery_s"] = 5.0 + k / 8 if run != "thesis" else np.nan
        rows.loc[rows["diverged"], list(NEVER)] = np.nan
        table.append(rows)
    return pd.concat(table).sort_values(["plant", "anti_windup"]).reset_index(drop=True)


def written(path: Path, table: pd.DataFrame, facts: dict[str, str] | None = None, **options: int) -> Path:
    content = pyarrow.Table.from_pandas(table, preserve_index=False)
    content = content.replace_schema_metadata(FACTS if facts is None else facts)
    seal = Seal(content.schema)
    for batch in content.to_batches():
        seal.update(batch)
    content = content.replace_schema_metadata((content.schema.metadata or {}) | {SEAL: str(seal)})
    parquet.write_table(content, path, **options)
    return path


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    return written(tmp_path / "campaign.parquet", plants())


def of(table: pd.DataFrame, run: str) -> pd.DataFrame:
    return table[table["run"] == run].reset_index(drop=True)


def test_the_distributions_are_those_of_all_plants(campaign: Path) -> None:
    table = campaign_tables(campaign)["campaign"]
    assert list(table) == ["run", "share", "peak_error", "steady_error", "recovery_s"]
    share = np.arange(1, 201) / 200
    which = np.repeat(np.arange(40), 5)  # 200 shares of 40 plants
    corrected, thesis, none = (of(table, run) for run in ("corrected", "thesis", "none"))
    for rows in (corrected, thesis, none):
        np.testing.assert_array_equal(rows["share"], share)
    np.testing.assert_array_equal(corrected["peak_error"], 50.0 + 3 * which)
    np.testing.assert_array_equal(corrected["steady_error"], 10.0 ** (-np.arange(40) / 4.0)[::-1][which])
    np.testing.assert_array_equal(corrected["recovery_s"], 5.0 + which / 8)
    assert thesis["recovery_s"].isna().all()
    assert thesis["peak_error"].notna().all()
    # five of forty diverge: the greatest eighth
    np.testing.assert_array_equal(none["peak_error"].notna(), share <= 35 / 40)
    kept = np.array([k for k in range(40) if k % 8 != 7])
    np.testing.assert_array_equal(none["peak_error"][:175], 50.0 + kept[which[:175]])


def test_the_shares_over_the_distance(campaign: Path) -> None:
    table = campaign_tables(campaign)["campaign_distance"]
    none, thesis = of(table, "none"), of(table, "thesis")
    np.testing.assert_allclose(none["from"], np.arange(10) / 10)
    np.testing.assert_allclose(none["to"], np.arange(1, 11) / 10)
    assert (table["plants"] == 4).all()
    np.testing.assert_array_equal(none["linear_stable"], [1, 1, 1, 1, 1, 1, 1, 0.5, 0, 0])
    np.testing.assert_array_equal(none["diverged"], [0, 0.25] * 5)
    np.testing.assert_array_equal(none["recovered"], [1, 0.75] * 5)
    np.testing.assert_array_equal(none["least_peak_error"], 50.0 + 4 * np.arange(10))
    np.testing.assert_array_equal(
        none["greatest_peak_error"], np.where(np.arange(10) % 2, np.nan, none["least_peak_error"] + 3)
    )
    np.testing.assert_array_equal(thesis["greatest_peak_error"], 50.0 + 2 * (4 * np.arange(10) + 3))
    assert (thesis[["diverged", "recovered"]] == 0).all(axis=None)


def test_the_summary(campaign: Path) -> None:
    table = campaign_tables(campaign)["campaign_summary"].set_index("run")
    assert list(table.index) == list(module.RUNS)
    for name, value in FACTS.items():
        assert (table[name] == float(value)).all()
    assert (table["linear_stable"] == 0.75).all()
    assert list(table["diverged"]) == [0.125, 0, 0]
    assert list(table["recovered"]) == [0.875, 0, 1]
    assert list(table["covered"]) == [0, 0, 0.25]
    assert list(table["guaranteed_sector"]) == [0, 0, 0.75]
    corrected = table.loc["corrected"]
    # the 2nd, 20th and 38th of 40
    assert [corrected[f"peak_error_{n}"] for n in (5, 50, 95)] == [53, 107, 161]
    assert [corrected[f"steady_error_{n}"] for n in (5, 50, 95)] == pytest.approx(
        [10 ** (-k / 4.0) for k in (38, 20, 2)]
    )
    assert [corrected[f"recovery_{n}_s"] for n in (5, 50, 95)] == [5 + k / 8 for k in (1, 19, 37)]
    assert np.isnan(table.loc["none", "peak_error_95"])
    assert np.isnan(table.loc["thesis", "recovery_5_s"])
    # of those that diverge the nearest to the model; else the largest steady error
    assert list(table["worst_plant"]) == [7, 0, 0]


def test_neither_the_order_of_the_rows_nor_their_pieces_matter(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "ROWS", 7)
    mixed = written(tmp_path / "mixed.parquet", plants().sample(frac=1, random_state=3), row_group_size=11)
    found, expected = campaign_tables(mixed), campaign_tables(campaign)
    for name, table in expected.items():
        pd.testing.assert_frame_equal(found[name], table)


@pytest.mark.parametrize("count", [1, 3, 333])
def test_quantiles_are_those_of_sorting(count: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(count)
    table = plants(count)
    table["peak_error"] = rng.lognormal(0, 20, len(table)).round(2)  # many decades, and many zeros
    table["diverged"] = False
    table["steady_error"] = 1.0
    found = campaign_tables(written(tmp_path / "any.parquet", table, FACTS | {"plants": str(count)}))
    for run in module.RUNS:
        values = np.sort(table["peak_error"][table["anti_windup"] == run])
        which = [-(-k * count // 200) - 1 for k in range(1, 201)]
        np.testing.assert_array_equal(of(found["campaign"], run)["peak_error"], values[which])
        assert (of(found["campaign"], run)["steady_error"] == 1.0).all()
    np.testing.assert_array_equal(
        found["campaign_distance"]["diverged"].isna(), found["campaign_distance"]["plants"] == 0
    )


def changed(column: str, value: object) -> pd.DataFrame:
    table = plants()
    table[column] = table[column].astype(object)
    table.loc[17, column] = value
    return table.infer_objects()


BAD = {
    "no column recovery_s": lambda: plants().drop(columns="recovery_s"),
    "39 rows with anti_windup corrected; expected one for each of 40 plants": lambda: plants().iloc[1:],
    "0 rows with anti_windup none": lambda: plants().iloc[:0],
    "an anti_windup is 'mine'; expected none, thesis, corrected": lambda: changed("anti_windup", "mine"),
    "a distance is not between 0 and 1": lambda: changed("distance", 1.25),
    "no column covered": lambda: plants().drop(columns="covered"),
    "an anti_windup has several values of guaranteed_sector; expected one": lambda: changed("guaranteed_sector", 0.5),
    "linear_stable has an empty cell": lambda: changed("linear_stable", None),
    "plant has an empty cell": lambda: changed("plant", None),
    "peak_error of plant 5 is nan; expected 0 or more, or a run that diverges": lambda: changed("peak_error", np.nan),
    "steady_error of plant 5 is -1;": lambda: changed("steady_error", -1.0),
    "recovery_s of plant 5 is -1;": lambda: changed("recovery_s", -1.0),
    "cannot be read": lambda: plants().assign(peak_error="high"),
}


def refusal(campaign: Path, folder: Path) -> str:
    result = CliRunner().invoke(main, ["campaign-tables", str(campaign), "--output", str(folder)])
    assert result.exit_code == 2
    assert list(folder.glob("*.csv")) == []
    (line,) = result.output.strip().splitlines()
    return line


@pytest.mark.parametrize("sentence", BAD)
def test_what_no_campaign_writes_is_refused(sentence: str, tmp_path: Path) -> None:
    path = written(tmp_path / "bad.parquet", BAD[sentence]())
    assert f"{path}: " in refusal(path, tmp_path)
    assert sentence in refusal(path, tmp_path)


@pytest.mark.parametrize(
    ("facts", "sentence"),
    [
        ({}, "its metadata give no plants"),
        (FACTS | {"limit": "high"}, "its metadata give no limit"),
        (FACTS | {"plants": "0"}, "no plants; expected at least one"),
        (FACTS | {"limit": "nan"}, "its limit is nan"),
    ],
)
def test_metadata_that_are_missing_are_refused(facts: dict[str, str], sentence: str, tmp_path: Path) -> None:
    assert sentence in refusal(written(tmp_path / "bad.parquet", plants(), facts), tmp_path)


def test_a_column_that_is_there_twice_is_refused(campaign: Path, tmp_path: Path) -> None:
    table = parquet.read_table(campaign)
    path = tmp_path / "twice.parquet"
    parquet.write_table(table.append_column("plant", table["plant"]), path)
    assert "holds the column plant 2 times" in refusal(path, tmp_path)


def test_what_is_no_parquet_file_is_refused(campaign: Path, tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "nowhere.parquet", tmp_path)
    half = tmp_path / "half.parquet"
    half.write_bytes(campaign.read_bytes()[:-100])
    assert "cannot be read (" in refusal(half, tmp_path)
    half.write_bytes(b"plant,distance\n")
    assert "cannot be read (" in refusal(half, tmp_path)


def test_a_damaged_file_gives_no_other_numbers(tmp_path: Path) -> None:
    """Bytes at random places, rows and metadata among them, each changed in one bit."""
    path = written(tmp_path / "campaign.parquet", plants())
    whole, expected = path.read_bytes(), campaign_tables(path)
    rng, refusals = np.random.default_rng(1), []
    for place in rng.integers(len(whole), size=80):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            found = campaign_tables(path)
        except InputError as error:
            refusals.append(str(error))
            continue
        for name, table in expected.items():
            pd.testing.assert_frame_equal(found[name], table, check_exact=True)
    assert len(refusals) > 40
    assert all(sentence.startswith(f"{path}: ") and "\n" not in sentence for sentence in refusals)


@pytest.mark.parametrize("column", ["steady_error", "plant", "covered", "anti_windup"])
def test_a_number_that_is_changed_breaks_the_seal(column: str, tmp_path: Path) -> None:
    table = parquet.read_table(written(tmp_path / "campaign.parquet", plants()))
    values = table[column].to_pylist()
    values[0], values[7] = values[7], values[0]
    place = table.schema.names.index(column)
    parquet.write_table(table.set_column(place, column, pyarrow.array(values)), tmp_path / "changed.parquet")
    assert "was changed after the campaign" in refusal(tmp_path / "changed.parquet", tmp_path)


@pytest.mark.parametrize("facts", [{"seed": "8"}, {SEAL: "0"}, {"design": "mine.json"}])
def test_what_is_said_of_the_rows_is_sealed_too(facts: dict[str, str], tmp_path: Path) -> None:
    table = parquet.read_table(written(tmp_path / "campaign.parquet", plants()))
    said = {name.decode(): text for name, text in table.schema.metadata.items()} | facts
    parquet.write_table(table.replace_schema_metadata(said), tmp_path / "changed.parquet")
    assert "was changed after the campaign" in refusal(tmp_path / "changed.parquet", tmp_path)


def test_the_command_writes_the_tables(campaign: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["campaign-tables", str(campaign), "--output", str(tmp_path)])
    assert result.exit_code == 0, result.output
    for name, table in campaign_tables(campaign).items():
        pd.testing.assert_frame_equal(pd.read_csv(tmp_path / f"{name}.csv"), table, check_dtype=False)
