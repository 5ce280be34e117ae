"""The campaign: stability against counted roots, rows against single runs, and one file whatever happens on the way."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from click.testing import CliRunner, Result
from pyarrow import parquet

from benchmarks import scaling_study
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from design.stability.characteristic_roots import roots_right_of
from design.stability.margins import delay_loop
from experiments.__main__ import main
from experiments.campaign import checkpoint
from experiments.campaign.draw_plants import PlantsWithin
from experiments.campaign.linear_stability import PerturbedLoop
from experiments.campaign.run_plants import Campaign, run_chunk
from experiments.engine.simulate import simulate
from experiments.runs.design_loop import design_loop
from experiments.runs.guarantee import guarantee_within
from experiments.thesis.printed_choices import thesis_reference
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

ROOT = Path(__file__).resolve().parents[2]
PLANTS, LIMIT = 16, 12.0
ARGUMENTS = ["--plants", str(PLANTS), "--seed", "1", "--limit", str(LIMIT), "--amplitude", "50"]


def far_from(plant: PlantModel, random: np.random.Generator) -> PlantModel:
    """A plant that no bound of use would cover, with the same integrator."""

    def moved(modes: tuple[Mode, ...]) -> tuple[Mode, ...]:
        return tuple(
            Mode(mode.omega * np.exp(0.4 * random.normal()), mode.zeta * np.exp(random.normal())) for mode in modes
        )

    corner = np.exp(random.uniform(0, 7))
    return replace(
        plant,
        zero_modes=moved(plant.zero_modes),
        pole_modes=moved(plant.pole_modes),
        delay_s=plant.delay_s + random.exponential(0.05),
        real_zeros=(corner,),
        real_poles=(corner * np.exp(random.normal()),),
    )


@pytest.mark.parametrize("name", ["extended_design", "delay_free_design"])
def test_the_winding_number_counts_the_unstable_roots(name: str, request: pytest.FixtureRequest) -> None:
    design: Design = request.getfixturevalue(name)
    random, loop = np.random.default_rng(3), PerturbedLoop(design)
    found = []
    for _ in range(40):
        true = far_from(design.loop_plant, random)
        found.append(loop.unstable_roots(true))
        assert found[-1] == roots_right_of(delay_loop(design, true), 0.0)
    assert len(set(found)) >= 4
    assert min(found) == 0
    assert loop.unstable_roots(design.loop_plant) == 0


@pytest.mark.parametrize(
    "plant",
    [
        PlantModel(5.0, (), (Mode(60.0, 0.05),), 0.01, 2, (-40.0,), (80.0,)),
        PlantModel(5.0, (Mode(50.0, -0.1),), (Mode(30.0, 0.1),), 0.02, 0, (), (3.0, 9.0)),
        PlantModel(5.0, (), (), 0.02, 1, (-20.0,), (10.0, 30.0)),
        PlantModel(50.0, (), (Mode(10.0, 0.3),), 0.01, -1),
    ],
)
def test_the_unstable_roots_of_loops_of_every_kind(plant: PlantModel) -> None:
    """Around plants with two integrators, none or a zero at s = 0, and zeros in the right half plane."""
    bound = AdditiveBound(0.1 * abs(complex(plant(20j))), (), (), (), (100.0,))
    design = design_extended(IdentifiedModel(plant, bound), [4.0])
    random, loop, drawn = np.random.default_rng(2), PerturbedLoop(design), PlantsWithin(plant, bound)
    found = []
    for index in range(12):
        true = drawn.draw(1, index).plant
        if index > 1:  # far outside
            true = replace(true, delay_s=true.delay_s + random.exponential(0.2))
        found.append(loop.unstable_roots(true))
        assert found[-1] == roots_right_of(delay_loop(design, true), 0.0)
    assert len(set(found)) > 1
    assert min(found) == 0


def test_an_unstable_linear_loop_is_one_in_time(extended_design: Design) -> None:
    """Without limits it grows; a dead time beyond the audit's margin of 129.4 ms."""
    loop, plant = PerturbedLoop(extended_design), extended_design.loop_plant
    reference = thesis_reference("extended", extended_design.reference_omegas)
    for delay_s, unstable in ((0.125, False), (0.135, True)):
        true = replace(plant, delay_s=delay_s)
        assert (loop.unstable_roots(true) > 0) == unstable
        run = simulate(
            design_loop(extended_design, reference, None, true), (-np.inf, np.inf), np.linspace(0.0, 60.0, 3001)
        )
        late, later = (np.abs(run.outputs["error"][part]).max() for part in (slice(1000, 2000), slice(2000, None)))
        assert (later > late) == unstable


def test_another_integrator_or_unstable_pole_is_refused(extended_design: Design) -> None:
    loop, plant = PerturbedLoop(extended_design), extended_design.loop_plant
    for true, words in (
        (replace(plant, gain=1.01 * plant.gain), "integrators differ"),
        (replace(plant, integrators=2), "integrators differ"),
        (replace(plant, real_poles=(-3.0,)), "has 1 poles in the right half plane, the model 0"),
    ):
        with pytest.raises(InputError, match=words):
            loop.unstable_roots(true)


@pytest.fixture(scope="module")
def campaign(extended_design: Design) -> Campaign:
    reference = thesis_reference("extended", extended_design.reference_omegas)
    return Campaign(extended_design, "of a test", 1, reference, (-LIMIT, LIMIT), 5)


def test_rows_are_those_of_single_runs(campaign: Campaign, extended_design: Design) -> None:
    columns = run_chunk(campaign, (3, 4))
    plant = PlantsWithin(extended_design.loop_plant, extended_design.additive_bound).draw(1, 3)
    assert columns["plant"] == [3, 3, 3]
    assert columns["anti_windup"] == ["none", "thesis", "corrected"]
    assert columns["distance"] == [plant.distance] * 3
    assert columns["delay_s"] == [plant.plant.delay_s] * 3
    assert columns["pole_zeta_2"] == [plant.plant.pole_modes[1].zeta] * 3
    stable = roots_right_of(delay_loop(extended_design, plant.plant), 0.0) == 0
    assert columns["linear_stable"] == [stable] * 3
    period = 2 * np.pi / 1.5
    time_s = np.linspace(0.0, 5 * period, 2501)
    assert campaign.horizon_s == pytest.approx(5 * period)
    for promised in ("guaranteed_sector", "covered"):
        assert columns[promised] == [0] * 3  # |W_a C S| reaches 8.84
    assert columns["needed_sector"] == columns["largest_control"] == [None] * 3
    for row, name in enumerate(columns["anti_windup"]):
        kind = None if name == "none" else extended_design.compensator(name)
        loop = design_loop(extended_design, campaign.reference, kind, plant.plant)
        run = simulate(loop, (-LIMIT, LIMIT), time_s)
        error = np.abs(run.outputs["error"])
        assert columns["peak_error"][row] == pytest.approx(error[time_s >= 0.249 * period].max(), rel=1e-9)
        assert columns["steady_error"][row] == pytest.approx(error[time_s >= 3.999 * period].max(), rel=1e-9)
        assert columns["events"][row] == len(run.events_s)
        recovery = columns["recovery_s"][row]
        if recovery is None:
            assert columns["steady_error"][row] > 0.5
        else:
            assert error[time_s >= recovery].max() <= 0.5 < error[time_s < recovery][-1]


def test_a_plant_is_the_same_in_every_chunk(campaign: Campaign) -> None:
    together, apart = run_chunk(campaign, (4, 6)), [run_chunk(campaign, (index, index + 1)) for index in (5, 4)]
    assert together == {name: apart[1][name] + apart[0][name] for name in together}


def test_a_run_that_diverges_is_a_result(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    from experiments.campaign import run_plants as module

    def diverges(*_: object, **_named: object) -> None:
        raise module.DivergenceError(1.0)

    monkeypatch.setattr(module, "simulate", diverges)
    columns = run_chunk(campaign, (0, 1))
    assert columns["diverged"] == [True] * 3
    for name in ("peak_error", "steady_error", "recovery_s", "last_saturation_s", "events", "needed_sector"):
        assert columns[name] == [None] * 3
    assert columns["covered"] == [False] * 3


@pytest.mark.parametrize("limit", [20.0, 90.0])
def test_a_guarantee_within_the_bound_covers_the_runs_that_need_less(table: IdentifiedModel, limit: float) -> None:
    design = design_extended(table, [1.5], 4.0, [(2.0, 1.0)])
    kind, reference = design.compensator("corrected"), thesis_reference("extended", (1.5,))
    columns = run_chunk(Campaign(design, f"robust {limit}", 1, reference, (-limit, limit), 5), (0, 2))
    assert columns["guaranteed_sector"] == [0, 0, guarantee_within(design, kind).sector] * 2
    for index, row in ((0, 2), (1, 5)):
        plant = PlantsWithin(design.loop_plant, design.additive_bound).draw(1, index).plant
        loop = design_loop(design, thesis_reference("extended", (1.5,)), kind, plant)
        time_s = np.linspace(0.0, 5.0, 200001)
        control = simulate(replace(loop, outputs={}), (-limit, limit), time_s).control
        inverse = 1 / complex(plant(1.5j))
        steady = 50 * abs(inverse) * np.cos(1.5 * time_s + np.angle(inverse))
        left_out = control - np.clip(control, -limit, limit)
        beyond = left_out != 0
        secant = np.max(left_out[beyond] / (control[beyond] - steady[beyond]))
        assert columns["needed_sector"][row] == pytest.approx(secant, rel=1e-4)
        assert columns["largest_control"][row] == pytest.approx(np.abs(control).max(), rel=1e-4)
        assert columns["covered"][row] == (limit == 90.0) == (secant < columns["guaranteed_sector"][row])
    assert columns["covered"][:2] == [False, False]


def test_a_chapter_2_design_runs_too(delay_free_design: Design) -> None:
    """No dead time in its loop: that of the true plant may only grow."""
    reference = thesis_reference("delay-free", delay_free_design.reference_omegas)
    campaign = Campaign(delay_free_design, "another", 2, reference, (-10.0, 10.0), 6)
    columns = run_chunk(campaign, (1, 2))
    assert columns["delay_s"][0] >= 0
    assert columns["zero_omega_1"][0] != delay_free_design.plant.zero_modes[0].omega
    assert campaign.horizon_s == pytest.approx(24.0)


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkpoint, "CHUNK", 2)


@pytest.fixture(scope="module")
def folder(extended_design: Design, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign")
    (folder / "design.json").write_text(extended_design.to_json(), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def whole(folder: Path) -> bytes:
    """The file of a campaign that ran here without interruption."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checkpoint, "CHUNK", 2)
        result = run(folder, "whole.parquet")
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("No guarantee holds for all plants within W_a\n16 plants within W_a ->")
    assert [line.split()[0] for line in result.stdout.splitlines()[-3:]] == ["none", "thesis", "corrected"]
    return (folder / "whole.parquet").read_bytes()


def run(folder: Path, output: str, *arguments: str) -> Result:
    command = ["campaign", str(folder / "design.json"), *ARGUMENTS, "--output", str(folder / output), *arguments]
    return CliRunner().invoke(main, command)


def in_a_process(folder: Path, output: str, *arguments: str) -> list[str]:
    """The command that :func:`run` runs, with small chunks."""
    code = (
        "from experiments.campaign import checkpoint; checkpoint.CHUNK = 2; "
        "from experiments.__main__ import main; main()"
    )
    command = ["campaign", str(folder / "design.json"), *ARGUMENTS, "--output", str(folder / output), *arguments]
    return [sys.executable, "-c", code, *command]


def wait_for_parts(folder: Path, count: int) -> None:
    deadline = time.monotonic() + 300
    while len(list(folder.glob("part-*.parquet"))) < count and time.monotonic() < deadline:
        time.sleep(0.01)


def test_the_file(folder: Path, whole: bytes, extended_design: Design) -> None:
    file = parquet.ParquetFile(folder / "whole.parquet")
    table = file.read().to_pandas()
    assert list(table["plant"]) == [index for index in range(PLANTS) for _ in range(3)]
    assert set(table["distance"].between(0, 1)) == {True}
    said = {key.decode(): value.decode() for key, value in file.schema_arrow.metadata.items()}
    assert said["plants"] == str(PLANTS)
    assert said["limit"] == str(LIMIT)
    assert said["design"] == "design.json"
    assert "not measured" in said["synthetic"]
    assert float(said["horizon_s"]) == pytest.approx(6 * 2 * np.pi / 1.5)  # the loop takes that long to settle
    assert not (folder / "whole.parquet.parts").exists()


@pytest.fixture(scope="module")
def cluster() -> Iterator[scaling_study.Cluster]:
    """A scheduler and two workers, of Dask's own commands; the tests below lose them one after the other."""
    with scaling_study.cluster(2) as started:
        yield started


@pytest.mark.usefixtures("small_chunks")
def test_a_cluster_that_loses_a_worker_writes_the_same_file(
    folder: Path, whole: bytes, cluster: scaling_study.Cluster
) -> None:
    parts = folder / "cluster.parquet.parts"

    def lose_one() -> None:
        wait_for_parts(parts, 2)
        lost.append(len(list(parts.glob("part-*.parquet"))))
        cluster.workers[0].kill()

    lost: list[int] = []
    thread = Thread(target=lose_one)
    thread.start()
    result = run(folder, "cluster.parquet", "--scheduler", cluster.address)
    thread.join()
    assert result.exit_code == 0, result.output
    assert 2 <= lost[0] < PLANTS // 2 - 1
    assert (folder / "cluster.parquet").read_bytes() == whole


@pytest.mark.usefixtures("small_chunks")
def test_what_a_scheduler_that_dies_leaves_goes_on_without_it(
    folder: Path, whole: bytes, cluster: scaling_study.Cluster
) -> None:
    parts = folder / "left.parquet.parts"

    def lose_it() -> None:
        wait_for_parts(parts, 2)
        cluster.scheduler.kill()

    thread = Thread(target=lose_it)
    thread.start()
    command = in_a_process(folder, "left.parquet", "--scheduler", cluster.address)
    left = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    thread.join()
    assert left.returncode == 2
    (sentence,) = left.stderr.splitlines()
    assert "the cluster gave up (" in sentence
    assert sentence.endswith("; the same command continues from there")
    there = 2 * len(list(parts.glob("part-*.parquet")))
    assert 4 <= there < PLANTS

    refused = run(folder, "left.parquet", "--seed", "2")
    assert refused.exit_code == 2
    assert "parts of another campaign, seed 1 and not 2; give the same command as then" in refused.stderr
    manifest = parts / "manifest.json"
    known = manifest.read_text(encoding="utf-8")
    facts = json.loads(known)
    manifest.write_text(json.dumps(facts | {"versions": facts["versions"] | {"numpy": "1.0"}}), encoding="utf-8")
    refused = run(folder, "left.parquet")
    assert refused.exit_code == 2
    assert f"versions numpy 1.0 and not numpy {np.__version__};" in refused.stderr
    manifest.write_text(known, encoding="utf-8")
    assert 2 * len(list(parts.glob("part-*.parquet"))) == there

    result = run(folder, "left.parquet")
    assert result.exit_code == 0, result.output
    assert f"{there} of {PLANTS} plants were there already" in result.stdout
    assert (folder / "left.parquet").read_bytes() == whole
    assert not parts.exists()


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["--plants", "0"], "--plants is 0"),
        (["--seed", "-1"], "--seed -1"),
        (["--limit", "-3"], "--limit is -3"),
        (["--scheduler", "nonsense"], "--scheduler nonsense: no Dask scheduler answers there"),
        (["--scheduler", "foo://host:1"], "no Dask scheduler answers there"),
        (
            ["--output", "nowhere/campaign.parquet"],
            "nowhere/campaign.parquet: cannot be written (No such file or directory)",
        ),
    ],
)
def test_refusals(folder: Path, arguments: list[str], part: str) -> None:
    before = sorted(path.name for path in folder.iterdir())
    result = run(folder, "refused.parquet", *arguments)
    assert result.exit_code == 2, result.output
    assert part in result.stderr
    assert sorted(path.name for path in folder.iterdir()) == before


def test_a_design_is_not_written_over_and_a_strangers_folder_not_touched(folder: Path) -> None:
    result = run(folder, "design.json")
    assert result.exit_code == 2
    assert "is an input too" in result.stderr
    stranger = folder / "mine.parquet.parts"
    stranger.mkdir()
    (stranger / "letter.txt").write_text("dear", encoding="utf-8")
    result = run(folder, "mine.parquet")
    assert result.exit_code == 2
    assert "is not the folder of a campaign" in result.stderr
    assert [path.name for path in stranger.iterdir()] == ["letter.txt"]
