"""The file of a campaign and its parts: one writer, no damaged part, nothing of another campaign, nothing left."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from pyarrow import parquet

from design.design_file import Design
from experiments.__main__ import main
from experiments.campaign import checkpoint, run_campaign
from experiments.campaign.checkpoint import CampaignFile
from experiments.campaign.run_plants import Campaign, Chunk, Columns
from experiments.thesis.printed_choices import thesis_reference
from identification.base.errors import InputError

PLANTS = 7


def made_up(campaign: Campaign, chunk: Chunk) -> Columns:
    """Rows that hang on the seed and the plant alone, and take no time."""
    first, last = chunk
    count = 3 * (last - first)
    rows: Columns = {"plant": list(np.repeat(range(first, last), 3)), "anti_windup": ["none", "thesis", "corrected"]}
    rows["anti_windup"] *= last - first
    random = [np.random.default_rng([campaign.seed, plant]).uniform(size=(3, 4)) for plant in range(first, last)]
    rows |= dict(zip(("distance", "peak_error", "steady_error", "recovery_s"), np.concatenate(random).T, strict=True))
    rows |= dict.fromkeys(("linear_stable", "diverged", "covered"), [False] * count)
    return rows | {"guaranteed_sector": [0.0] * count}


def one_after_another(
    work: Callable[[Chunk], Columns], chunks: list[Chunk], _: object
) -> Iterator[tuple[int, Columns]]:
    return ((number, work(chunk)) for number, chunk in enumerate(chunks))


@pytest.fixture
def campaign(extended_design: Design) -> Campaign:
    reference = thesis_reference("extended", extended_design.reference_omegas)
    return Campaign(extended_design, "of a test", 1, reference, (-12.0, 12.0), 5)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_campaign, "run_chunk", made_up)
    monkeypatch.setattr(run_campaign, "spread", one_after_another)
    monkeypatch.setattr(checkpoint, "CHUNK", 2)


@pytest.fixture
def design(extended_design: Design, tmp_path: Path) -> Path:
    path = tmp_path / "design.json"
    path.write_text(extended_design.to_json(), encoding="utf-8")
    return path


def run(design: Path, seed: int, output: Path) -> Result:
    arguments = ["--plants", str(PLANTS), "--seed", str(seed), "--limit", "12", "--amplitude", "50"]
    return CliRunner().invoke(main, ["campaign", str(design), *arguments, "--output", str(output)])


def kept(output: Path, campaign: Campaign, design: Path) -> CampaignFile:
    file = CampaignFile(output, campaign, PLANTS, design)
    for chunk in file.missing:
        file.keep(chunk, made_up(campaign, chunk))
    return file


@pytest.mark.parametrize("other_seed", [1, 2])
def test_of_two_campaigns_into_one_file_the_second_ends_at_once(
    other_seed: int, design: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(design, 1, tmp_path / "alone.parquet").exit_code == 0
    output, seconds = tmp_path / "both.parquet", []
    (tmp_path / "link.parquet").symlink_to(output)

    def meanwhile(*asked: Any) -> Iterator[tuple[int, Columns]]:
        for answer in one_after_another(*asked):
            seconds.append(run(design, other_seed, tmp_path / "link.parquet"))
            yield answer

    monkeypatch.setattr(run_campaign, "spread", meanwhile)
    first = run(design, 1, output)
    assert first.exit_code == 0, first.output
    assert first.stderr == ""
    assert len(seconds) == 4
    for second in seconds:
        assert second.exit_code == 2
        assert f"link.parquet: process {os.getpid()} on " in second.stderr
        assert len(second.stderr.splitlines()) == 1
    assert output.read_bytes() == (tmp_path / "alone.parquet").read_bytes()
    names = ["alone.parquet", "both.parquet", "design.json", "link.parquet"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names


def test_a_part_with_any_bit_changed_runs_again(campaign: Campaign, design: Path, tmp_path: Path) -> None:
    file = kept(tmp_path / "damaged.parquet", campaign, design)
    part = min(file.folder.glob("part-*"))
    whole, rng = part.read_bytes(), np.random.default_rng(2)
    for place in rng.integers(len(whole), size=40):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << rng.integers(8)
        part.write_bytes(damaged)
        assert CampaignFile(file.output, campaign, PLANTS, design).missing == [(0, 2)]
    with pytest.raises(InputError, match="was changed during the run; give the same command"):
        file.finish()
    assert not file.output.exists()
    again, alone = kept(file.output, campaign, design), kept(tmp_path / "alone.parquet", campaign, design)
    again.finish()
    alone.finish()
    assert again.output.read_bytes() == alone.output.read_bytes()
    assert not again.folder.exists()


def test_the_parts_of_a_large_campaign_are_fewer_and_larger(campaign: Campaign, design: Path, tmp_path: Path) -> None:
    missing = CampaignFile(tmp_path / "large.parquet", campaign, 10**6 + 1, design).missing
    assert [missing[0], missing[-1]] == [(0, 250), (10**6, 10**6 + 1)]
    assert len(missing) == 4001


def test_a_part_of_another_campaign_is_none_of_this(campaign: Campaign, design: Path, tmp_path: Path) -> None:
    """Its name and number are as good; it stays where it is, and is named."""
    other = kept(tmp_path / "other.parquet", replace(campaign, seed=2), design)
    foreign = min(other.folder.glob("part-*"))
    file = kept(tmp_path / "mine.parquet", campaign, design)
    min(file.folder.glob("part-*")).unlink()
    foreign.rename(file.folder / foreign.name)
    again = CampaignFile(file.output, campaign, PLANTS, design)
    assert again.missing == [(0, 2)]
    kept(file.output, campaign, design).finish()
    rows = parquet.read_table(BytesIO(file.output.read_bytes())).to_pydict()
    expected = made_up(campaign, (0, PLANTS))
    assert {name: rows[name] for name in expected} == {name: list(values) for name, values in expected.items()}
    assert [path.name for path in file.folder.iterdir()] == [foreign.name]


def test_what_is_no_part_of_the_campaign_stays_and_is_named(design: Path, tmp_path: Path) -> None:
    output = tmp_path / "mine.parquet"
    output.with_name("mine.parquet.parts").mkdir()
    foreign = tmp_path / "mine.parquet.parts" / ".partial-0123abcd-1-1.parquet"  # of another machine
    foreign.write_text("half", encoding="utf-8")
    result = run(design, 1, output)
    assert result.exit_code == 0
    assert f"{foreign.parent} is kept, since it holds {foreign.name}" in result.stderr
    assert [path.name for path in foreign.parent.iterdir()] == [foreign.name]


def test_a_folder_that_cannot_hold_parts_is_refused_before_anything_runs(
    design: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(run_campaign, "spread", never)
    (tmp_path / "file.parquet.parts").touch()
    (tmp_path / "folder.parquet").mkdir()
    for name, sentence in {
        "file.parquet": "file.parquet.parts: cannot be written; expected a folder",
        "folder.parquet": "is a directory",
        "design.json": "is an input too",
        "design.json/mine.parquet": "mine.parquet: cannot be written",
        "nowhere/mine.parquet": "mine.parquet: cannot be written (No such file or directory)",
    }.items():
        before = sorted(tmp_path.rglob("*"))
        result = run(design, 1, tmp_path / name)
        assert result.exit_code == 2
        assert sentence in result.stderr
        assert sorted(tmp_path.rglob("*")) == before


def test_the_parts_of_another_campaign_go_on_request_and_nothing_else_does(
    campaign: Campaign, design: Path, tmp_path: Path
) -> None:
    other = kept(tmp_path / "c.parquet", replace(campaign, seed=2), design)
    whole, damaged, notes = *sorted(other.folder.glob("part-*"))[:2], other.folder / "notes.md"
    damaged.write_bytes(b"another's")
    notes.write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"another campaign, seed 2 and not 1; .* or --anew to remove them"):
        CampaignFile(other.output, campaign, PLANTS, design)
    assert whole.exists()
    CampaignFile(other.output, campaign, PLANTS, design, anew=True)
    assert {path.name for path in other.folder.iterdir()} == {damaged.name, notes.name}
    assert notes.read_text(encoding="utf-8") == "mine"


def test_a_file_may_have_a_name_that_is_not_utf_8(campaign: Campaign, design: Path, tmp_path: Path) -> None:
    file = kept(tmp_path / os.fsdecode(b"\xff.parquet"), campaign, design)
    file.finish()
    assert file.output.stat().st_size > 0
