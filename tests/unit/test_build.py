"""A build with stand-ins for the commands: what is run, what a refusal stops, and what is left alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest
from click.testing import CliRunner

import antiwindup.build
from antiwindup.__main__ import main as antiwindup_command
from antiwindup.build import Build, Crash
from antiwindup.refit_steps import FIGURES, refit_steps
from antiwindup.steps import Asked, Step
from antiwindup.thesis_steps import report_steps, thesis_steps
from identification.base.errors import InputError
from identification.base.files import note
from identification.base.folder_lock import locked_folder

OF_DESIGN = {
    *("design.json", "results/campaign.parquet", "results/campaign.csv", "results/campaign_distance.csv"),
    *("results/campaign_summary.csv", "results/compare.csv", "results/compare_runs.csv", "results/tracking.csv"),
    *("results/tracking_summary.csv", "results/rates.csv", "results/limits_extended.csv"),
    *("results/limits_extended_summary.csv",),
    *(f"figures/{name}.{kind}" for name in FIGURES for kind in ("pdf", "svg", "png", "txt")),
}
"""What a refit makes with the extended design or with what was made with it."""

Refit = Callable[..., Build]


class StandIn:
    """An ended process: it wrote its own name and what it read, as the command would; or refused, or crashed."""

    def __init__(self, step: Step, log: Path, journal: Path, behaves: str) -> None:
        self.sentinel, writing = os.pipe()
        os.close(writing)
        self.exitcode = {"crashes": 1, "refuses": 2}.get(behaves, 0)
        texts = {"crashes": "Traceback of it", "refuses": f"Error: {step.name} will not\n"}
        log.write_text(texts.get(behaves, f"{step.name} done\n"), encoding="utf-8")
        read = "".join(path.read_text(encoding="utf-8") for path in (*step.needs, *step.uses) if path.is_file())
        for path in step.outputs if not behaves else ():
            path.write_text(f"{step.name} {sha256(read.encode()).hexdigest()}\n", encoding="utf-8")
            note(journal, {path: path})

    def terminate(self) -> None:
        pass

    def join(self) -> None:
        os.close(self.sentinel)


@pytest.fixture
def behaviour(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Name of a step -> how it ends, if not well."""
    return {}


@pytest.fixture
def code(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """First words of a command -> its code, if it is another than at first."""
    return {}


@pytest.fixture
def refit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, behaviour: dict[str, str], code: dict[str, str]
) -> Iterator[Refit]:
    """Build ``tmp_path / "mine"`` from the sweep a.csv, or from others."""
    steps: list[Step] = []

    def start(command: Sequence[str], log: Path, journal: Path) -> StandIn:
        (step,) = [step for step in steps if step.command == command]
        return StandIn(step, log, journal, behaviour.get(step.name, ""))

    monkeypatch.setattr(antiwindup.build, "start", start)
    monkeypatch.setattr(antiwindup.build, "load_ahead", lambda: None)
    monkeypatch.setattr(os, "fsync", lambda _: None)
    monkeypatch.setattr(
        antiwindup.build, "code_of", lambda command: "".join(code[word] for word in command if word in code)
    )
    (tmp_path / "a.csv").write_text("a", encoding="utf-8")

    def run(
        goal: str = "refit",
        force: bool = False,
        only: Sequence[str] = (),
        inputs: Sequence[Path] = (),
        **changes: object,
    ) -> Build:
        asked = Asked(tmp_path / "mine", None, (), (tmp_path / "a.csv",))
        asked = replace(asked, **changes)  # type: ignore[arg-type]
        first = refit_steps(asked) if goal == "refit" else thesis_steps(asked)
        steps[:] = first if goal == "refit" else [*first, *report_steps(asked, first)]
        wanted = [step for step in steps if step.name in only] or (steps if goal == "report" else first)
        build = Build(asked.folder, steps, inputs or asked.sweep_files, wanted, goal == "refit", 4, force)
        told: list[int] = []
        build.run(lambda ended, running: told.append(ended if running else -1))
        assert told == sorted({*told})
        assert not told or 0 <= told[0] <= told[-1] < build.runs
        return build

    return run


def built(tmp_path: Path) -> dict[str, str]:
    """Every file below mine with its text, but for the manifest."""
    mine = tmp_path / "mine"
    files = {path.relative_to(mine).as_posix(): path for path in mine.rglob("*") if path.is_file()}
    return {name: path.read_text(encoding="utf-8") for name, path in files.items() if name != "manifest.json"}


def test_all_is_made_and_then_nothing_is_left_to_do(refit: Refit, tmp_path: Path) -> None:
    first = refit()
    names = set(built(tmp_path))
    assert {"model.json", "axis.toml", "design_delay_free.json", "summary.pdf", "summary.txt", *OF_DESIGN} <= names
    assert not any("thesis" in word for step in first.steps for word in step.command)
    assert not any("refused" in name or "partial" in name or "lock" in name for name in names)
    assert first.printed["fit"] == "fit done\n"
    assert refit().printed == {}
    assert set(refit(fit=("--modes", "1")).printed) == {"fit"}  # the stand-in gives the same model
    (tmp_path / "a.csv").write_text("b", encoding="utf-8")
    assert set(refit(fit=("--modes", "1")).printed) == set(first.printed)


def test_what_is_run_is_what_changed_and_what_hangs_on_it(refit: Refit, code: dict[str, str], tmp_path: Path) -> None:
    everything = refit("report")
    assert {"claims", "report", "pid", "conditions", "fig_2_01"} <= set(everything.printed)
    code["fig_4_01"] = "another"
    assert set(refit("figures").printed) == {"fig_4_01"}  # which gives the same bytes, so that the report is kept
    assert "report/index.html" in built(tmp_path)
    assert set(refit("figures", only=["fig_4_01"], limit=5.0).printed) == {"extended"}
    assert {"delay_free", "sampled", "campaign"} <= set(refit("figures", limit=5.0).printed)


def test_a_stale_report_does_not_stay_beside_another_fit(refit: Refit, tmp_path: Path) -> None:
    refit("report")
    (tmp_path / "a.csv").write_text("b", encoding="utf-8")
    refit("figures")
    assert "report/index.html" not in built(tmp_path)
    assert "claims.csv" in built(tmp_path)


def test_another_kind_of_build_takes_away_what_is_not_of_it(refit: Refit, tmp_path: Path) -> None:
    refit("figures")
    refit("refit")
    assert not {"results/pid.csv", "figures/fig_2_01.pdf"} & set(built(tmp_path))


def test_a_refused_design_takes_only_what_hangs_on_it(refit: Refit, behaviour: dict[str, str], tmp_path: Path) -> None:
    refit()
    everything = built(tmp_path)
    behaviour["design"] = "refuses"
    (tmp_path / "a.csv").write_text("b", encoding="utf-8")
    refused = refit().refused
    assert refused == {"design": "design will not"}
    now = built(tmp_path)
    assert set(everything) - set(now) == OF_DESIGN
    assert now["design.refused.txt"] == "design will not\n"
    again = refit()
    assert (again.refused, again.printed) == (refused, {})
    behaviour.clear()
    (tmp_path / "a.csv").write_text("a", encoding="utf-8")
    refit()
    assert built(tmp_path) == everything


def test_a_refused_experiment_leaves_its_design(refit: Refit, behaviour: dict[str, str], tmp_path: Path) -> None:
    behaviour["limits"] = behaviour["campaign"] = "refuses"
    refit()
    names = set(built(tmp_path))
    assert {"design.json", "results/limits_extended.refused.txt", "results/compare.csv", "summary.pdf"} <= names
    assert "results/campaign.refused.txt" in names
    assert not names & {"results/limits_extended.csv", "results/campaign.csv"}
    behaviour["design"] = "refuses"
    (tmp_path / "a.csv").write_text("b", encoding="utf-8")
    refit()
    assert "results/limits_extended.refused.txt" not in built(tmp_path)


def test_a_crash_is_no_refusal(refit: Refit, behaviour: dict[str, str], tmp_path: Path) -> None:
    behaviour["design delay free"] = "crashes"
    with pytest.raises(Crash, match="Traceback of it"):
        refit()
    assert "summary.pdf" not in built(tmp_path)
    behaviour.clear()
    refit()
    assert "summary.pdf" in built(tmp_path)


def test_a_refused_fit_stops_everything_and_nothing_old_stays(
    refit: Refit, behaviour: dict[str, str], tmp_path: Path
) -> None:
    refit("report")
    behaviour["fit"] = "refuses"
    with pytest.raises(InputError, match=r"^fit will not$"):
        refit("refit", fit=("--modes", "1"))
    assert set(built(tmp_path)) == set()


@pytest.fixture
def begun(refit: Refit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, set[str]]]:
    """The last word but one of each command that is started, and the files that are there by then."""
    found: list[tuple[str, set[str]]] = []
    start = antiwindup.build.start

    def noted(command: Sequence[str], log: Path, journal: Path) -> object:
        found.append((command[1], {name for name in built(tmp_path) if "partial" not in name}))
        return start(command, log, journal)

    monkeypatch.setattr(antiwindup.build, "start", noted)
    return found


def test_the_page_comes_first_and_again_with_what_is_done(
    refit: Refit, begun: list[tuple[str, set[str]]], tmp_path: Path
) -> None:
    refit()
    pages = [there for name, there in begun if name == "summary"]
    assert [name for name, _ in begun][:2] == ["fit", "summary"]
    assert [{"design.json", "results/tracking.csv", "results/campaign.csv"} & there for there in pages] == [
        set(),
        {"design.json", "results/tracking.csv"},
        {"design.json", "results/tracking.csv", "results/campaign.csv"},
    ]
    begun.clear()
    refit()
    assert begun == []


def test_a_first_page_does_not_stand_beside_what_was_made_of_other_sweeps(
    refit: Refit, begun: list[tuple[str, set[str]]], tmp_path: Path
) -> None:
    refit()
    begun.clear()
    (tmp_path / "a.csv").write_text("b", encoding="utf-8")
    refit()
    first = next(there for name, there in begun if name == "summary")
    assert not {"design.json", "axis.toml", "results/campaign.csv", "figures/bode.pdf"} & first
    changed = built(tmp_path)
    (tmp_path / "mine").rename(tmp_path / "before")
    refit()
    assert built(tmp_path) == changed


@pytest.mark.parametrize("stopped", ["bode", "tracking", "campaign"])
def test_a_build_that_was_stopped_between_two_pages_goes_on(
    refit: Refit, begun: list[tuple[str, set[str]]], behaviour: dict[str, str], tmp_path: Path, stopped: str
) -> None:
    behaviour[stopped] = "crashes"
    with pytest.raises(Crash):
        refit()
    behaviour.clear()
    begun.clear()
    refit()
    ours = built(tmp_path)
    assert "fit" not in {name for name, _ in begun}
    (tmp_path / "mine").rename(tmp_path / "before")
    refit()
    assert built(tmp_path) == ours


def test_figures_fail_when_a_design_refuses(refit: Refit, behaviour: dict[str, str], tmp_path: Path) -> None:
    behaviour["design extended"] = "refuses"
    with pytest.raises(InputError, match="design extended will not"):
        refit("figures")
    assert not any("refused" in name for name in built(tmp_path))


@pytest.mark.parametrize("goal", ["refit", "report"])
def test_nothing_of_the_users_is_replaced_or_removed(
    refit: Refit, behaviour: dict[str, str], tmp_path: Path, goal: str
) -> None:
    mine = tmp_path / "mine"
    own = [
        "design_notes.md",
        "design_drawings/part.step",
        "results/compare_mine.csv",
        "figures/fig_2_01.bak",
        "report/x",
    ]
    for name in (*own, ".partial-notes.txt"):
        (mine / name).parent.mkdir(parents=True, exist_ok=True)
        (mine / name).write_text("mine", encoding="utf-8")
    refit(goal)
    behaviour["fit"] = "refuses"
    (tmp_path / "a.csv").write_text("b", encoding="utf-8")
    with pytest.raises(InputError):
        refit(goal)
    assert set(built(tmp_path)) >= {*own, ".partial-notes.txt"}
    assert all((mine / name).read_text(encoding="utf-8") == "mine" for name in own)


@pytest.mark.parametrize("name", ["model.json", "results/compare.csv", "figures/bode.svg", "compare.refused.txt"])
def test_a_place_that_is_taken_is_refused_before_anything_is_done(refit: Refit, tmp_path: Path, name: str) -> None:
    place = tmp_path / "mine" / ("results/" + name if "refused" in name else name)
    place.parent.mkdir(parents=True)
    place.write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"exists already.*--force"):
        refit()
    assert len(built(tmp_path)) == 1
    assert place.read_text(encoding="utf-8") == "mine"
    refit(force=True)
    assert "summary.pdf" in built(tmp_path)


def test_a_file_that_was_changed_is_refused_and_outlives_every_build(
    refit: Refit, behaviour: dict[str, str], tmp_path: Path
) -> None:
    refit()
    table = tmp_path / "mine" / "results" / "tracking.csv"
    table.write_text("corrected by hand", encoding="utf-8")
    with pytest.raises(InputError, match=r"tracking\.csv: was changed since it was written"):
        refit()
    asked = Asked(tmp_path / "mine", None, (), (tmp_path / "a.csv",))
    (tmp_path / "mine" / "figures" / "bode.pdf").write_text("also", encoding="utf-8")
    fit = refit_steps(asked)[:1]
    Build(asked.folder, fit, [], fit, goes_on=True, jobs=1).run(lambda *_: None)  # a build without tables
    assert table.read_text(encoding="utf-8") == "corrected by hand"
    assert "figures/bode.pdf" in built(tmp_path)
    assert "results/tracking_summary.csv" not in built(tmp_path)


def test_a_write_protected_output_is_refused_before_anything_is_done(refit: Refit, tmp_path: Path) -> None:
    refit()
    (tmp_path / "mine" / "summary.txt").chmod(0o444)
    (tmp_path / "a.csv").write_text("b", encoding="utf-8")
    before = built(tmp_path)
    with pytest.raises(InputError, match=r"summary\.txt: is write-protected"):
        refit()
    assert built(tmp_path) == before
    refit(force=True)
    assert built(tmp_path)["summary.txt"] != before["summary.txt"]


@pytest.mark.parametrize("name", ["../outside.txt", "/outside.txt", "results/../../outside.txt"])
def test_a_manifest_that_leads_out_of_the_folder_is_refused(refit: Refit, tmp_path: Path, name: str) -> None:
    (tmp_path / "outside.txt").write_text("mine", encoding="utf-8")
    (tmp_path / "mine").mkdir()
    listed = {"schema": 1, "files": {name: {"source": "", "content": None}}}
    (tmp_path / "mine" / "manifest.json").write_text(json.dumps(listed), encoding="utf-8")
    with pytest.raises(InputError, match=r"manifest\.json: '.*' lies outside the folder"):
        refit()
    assert (tmp_path / "outside.txt").read_text(encoding="utf-8") == "mine"


def test_a_file_that_was_begun_by_another_kind_of_build_is_left(refit: Refit, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    listed = {"schema": 1, "files": {"notes.md": {"source": "", "content": None}}}
    (tmp_path / "mine" / "manifest.json").write_text(json.dumps(listed), encoding="utf-8")
    (tmp_path / "mine" / "notes.md").write_text("mine", encoding="utf-8")
    refit()
    assert built(tmp_path)["notes.md"] == "mine"


def test_a_file_in_the_place_of_a_folder_is_refused_before_anything_is_done(refit: Refit, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "results").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="results: no such folder"):
        refit()
    assert built(tmp_path) == {"results": "mine"}


def test_what_a_killed_build_had_begun_is_replaced_if_it_is_ours(refit: Refit, tmp_path: Path) -> None:
    refit()
    mine, ours = tmp_path / "mine", built(tmp_path)
    listed = json.loads((mine / "manifest.json").read_text(encoding="utf-8"))
    for name in ("model.json", "design.json"):
        listed["files"][name]["content"] = None
    (mine / "manifest.json").write_text(json.dumps(listed), encoding="utf-8")
    note(mine / ".antiwindup.journal", {mine / name: mine / name for name in ("model.json", "design.json")})
    with (mine / ".antiwindup.journal").open("a", encoding="utf-8") as journal:
        journal.write('["cut off by the ki')
    (mine / "design.json").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"design\.json: exists already and is not an output of this program"):
        refit()
    assert built(tmp_path)["design.json"] == "mine"
    (mine / "design.json").unlink()
    moved = tmp_path / "moved"
    mine.rename(moved)
    mine.symlink_to(moved)
    assert {"fit", "design"} <= set(refit().printed)
    assert built(tmp_path) == ours


@pytest.mark.parametrize("name", ["model.json", "responses.npz"])
def test_an_input_that_is_an_output_is_refused(refit: Refit, tmp_path: Path, name: str) -> None:
    refit()
    before = built(tmp_path)
    with pytest.raises(InputError, match=rf"{name}: is an output in .* too; expected another folder"):
        refit("figures", inputs=[tmp_path / "mine" / name], model=str(tmp_path / "mine" / "model.json"))
    assert built(tmp_path) == before


def test_a_link_in_the_place_of_an_output_is_not_followed(refit: Refit, tmp_path: Path) -> None:
    refit()
    figure, own = tmp_path / "mine" / "figures" / "bode.pdf", tmp_path / "own.pdf"
    figure.rename(own)
    for target in (own, tmp_path / "nowhere"):
        figure.unlink(missing_ok=True)
        figure.symlink_to(target)
        (tmp_path / "a.csv").write_text("b", encoding="utf-8")
        before = own.read_bytes()
        with pytest.raises(InputError, match=r"bode\.pdf: exists already"):
            refit()
        assert own.read_bytes() == before
        assert not (tmp_path / "nowhere").exists()


def test_a_file_that_cannot_be_removed_stays_ours(
    refit: Refit, behaviour: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refit()
    everything = built(tmp_path)
    unlink = Path.unlink

    def barred(path: Path, missing_ok: bool = False) -> None:
        if path.name == "bode.svg":
            raise PermissionError(13, "Permission denied")
        unlink(path, missing_ok)

    behaviour["fit"] = "refuses"
    (tmp_path / "a.csv").write_text("b", encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", barred)
        with pytest.raises(InputError, match=r"bode\.svg: cannot be removed \(Permission denied\)"):
            refit()
    behaviour.clear()
    (tmp_path / "a.csv").write_text("a", encoding="utf-8")
    refit()
    assert built(tmp_path) == everything


def test_nothing_of_another_model_stays_beside_what_was_asked_for(refit: Refit, tmp_path: Path) -> None:
    refit("figures", model="implied", only=["fig_2_10", "fig_4_01"])
    refit("figures", model="table", limit=7.0, only=["fig_2_10"])
    assert not {"figures/fig_4_01.pdf", "results/extended.csv"} & set(built(tmp_path))
    assert {"figures/fig_2_10.pdf", "design_extended.json"} <= set(built(tmp_path))
    refit("figures", model="implied", only=["fig_2_01"])
    assert set(built(tmp_path)) == {f"figures/fig_2_01.{kind}" for kind in ("pdf", "svg", "png", "txt")}


def precious(path: Path) -> None:
    path.write_text("precious notes", encoding="utf-8")


@pytest.mark.parametrize(
    "make",
    [
        precious,
        lambda path: path.write_text('{"a": 1, "b": 2}\n', encoding="utf-8"),
        lambda path: path.write_text("[" * 100_000, encoding="utf-8"),
        lambda path: path.symlink_to(path.parent.parent / "a.csv"),
        lambda path: path.hardlink_to(path.parent.parent / "a.csv"),
        lambda path: path.mkdir(),
    ],
)
def test_what_is_no_journal_is_refused_and_left(refit: Refit, tmp_path: Path, make: Callable[[Path], object]) -> None:
    journal = tmp_path / "mine" / ".antiwindup.journal"
    journal.parent.mkdir()
    make(journal)
    before = journal.lstat()
    with pytest.raises(InputError, match=r"\.antiwindup\.journal"):
        refit()
    assert (journal.lstat().st_ino, journal.lstat().st_size) == (before.st_ino, before.st_size)
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == "a"


def test_what_somebody_puts_into_a_place_while_a_build_runs_is_refused_and_left(
    refit: Refit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figure = tmp_path / "mine" / "results" / "compare.csv"

    def code_of(command: Sequence[str]) -> str:
        if "extended" in command and not figure.exists():
            figure.parent.mkdir(exist_ok=True)
            precious(figure)
        return ""

    monkeypatch.setattr(antiwindup.build, "code_of", code_of)
    with pytest.raises(InputError, match=r"compare\.csv: exists already"):
        refit()
    assert figure.read_text(encoding="utf-8") == "precious notes"


def test_an_input_that_changes_while_a_build_runs_is_noticed(
    refit: Refit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = tmp_path / "a.csv"

    def code_of(command: Sequence[str]) -> str:
        if "extended" in command and sweep.read_text(encoding="utf-8") == "a":
            sweep.write_text("bb", encoding="utf-8")
        return ""

    with monkeypatch.context() as patch:
        patch.setattr(antiwindup.build, "code_of", code_of)
        with pytest.raises(InputError, match=r"a\.csv: was changed while the build ran; give the same command again"):
            refit()
    refit()
    changed = built(tmp_path)
    sweep.write_text("a", encoding="utf-8")
    assert "fit" in refit().printed
    assert built(tmp_path)["model.json"] != changed["model.json"]


def test_two_builds_of_one_folder(refit: Refit, tmp_path: Path) -> None:
    with locked_folder(tmp_path / "mine"), pytest.raises(InputError, match=r"process \d+ on"):
        refit()
    refit()


def test_a_refused_build_leaves_no_folder(refit: Refit, behaviour: dict[str, str], tmp_path: Path) -> None:
    behaviour["fit"] = "refuses"
    with pytest.raises(InputError):
        refit()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv"]


SWEEP = Path(__file__).resolve().parents[2] / "data" / "elevation" / "synthetic_test_1_frf.csv"


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["refit", str(SWEEP), "--output", ""], "--output is ''; expected a folder that holds nothing but the outputs"),
        (["refit", str(SWEEP), "--output", "/"], "--output is '/'; expected a folder"),
        (["refit", str(SWEEP), "--output", "root"], "--output is 'root'; expected a folder"),  # a link to /
        (["refit", str(SWEEP), "--output", "a\nb"], r"'a\nb': holds a line break"),
        (["refit", "a\nb.csv", "--output", "mine"], r"'a\nb.csv': holds a line break"),
        (["refit", "nowhere.csv", "--output", "mine"], "nowhere.csv: no such file"),
        (["refit", ".", "--output", "mine"], ".: holds no file that ends in .csv"),
        (["refit", str(SWEEP), "--output", "file"], "file: cannot be made (File exists)"),
        (["refit", str(SWEEP), "--output", "mine", "--limit", "nan"], "--limit is [nan]; expected [low, high]"),
        (["figures", str(SWEEP), "--output", "mine", "--model", "nowhere.json"], "nowhere.json: no such file"),
        (["report", str(SWEEP), "--output", "mine", "--model", "nothing"], "nothing"),
        (["figures", str(SWEEP), "--output", "mine", "--only", "fig_9"], "--only is 'fig_9'; expected one of fig_2_01"),
    ],
    ids=str,
)
def test_a_build_is_refused_before_its_folder_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], part: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "root").symlink_to("/")
    before = sorted(tmp_path.iterdir())
    result = CliRunner().invoke(antiwindup_command, arguments)
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert part in result.stderr
    assert sorted(tmp_path.iterdir()) == before


def test_a_build_draws_and_draws_nothing_twice(tmp_path: Path) -> None:
    """With its processes, into a folder with an odd name."""
    output = tmp_path / os.fsdecode(b"my '$(folder)' \xff")
    drawn = ["figures", str(SWEEP), "--model", "implied", "--only", "fig_2_01", "--output", str(output)]
    command = [sys.executable, "-m", "antiwindup", *drawn]
    jupyter = os.environ | {"MPLBACKEND": "module://matplotlib_inline.backend_inline"}
    for steps in ("1 step was", "0 steps were"):
        done = subprocess.run(command, cwd=SWEEP.parents[2], env=jupyter, capture_output=True, check=False)
        assert done.returncode == 0, done.stderr
        assert done.stderr == b""
        assert done.stdout.startswith(f"{steps} run, 0 refused -> ".encode())
    figures = sorted(path.name for path in (output / "figures").iterdir())
    assert figures == [f"fig_2_01.{kind}" for kind in ("pdf", "png", "svg", "txt")]
    assert sorted(path.name for path in output.iterdir()) == ["figures", "manifest.json"]


def test_the_options_of_the_fit_are_those_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fits: list[tuple[str, ...]] = []
    monkeypatch.setattr(Build, "run", lambda build, tell: fits.append(build.steps[0].command))
    asked = ["--modes", "1/2", "--real", "auto", "--bound-order", "3", "--loss", "soft-l1"]
    for given in ([], asked):
        result = CliRunner().invoke(
            antiwindup_command, ["refit", str(SWEEP), "--output", str(tmp_path / "mine"), *given]
        )
        assert result.exit_code == 0, result.output
        output = ["--output", str(tmp_path / "mine" / "model.json"), "--responses"]
        assert list(fits[-1]) == [
            *("identification", "fit", *given, *output, str(tmp_path / "mine" / "responses.npz"), "--", str(SWEEP))
        ]
