"""Small files of every kind as the commands write and read them; all that looks like a measurement is synthetic."""

from __future__ import annotations

import io
import warnings
from functools import cache
from math import tau
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
import pandas as pd
import pyarrow
import pyuff
from pyarrow import parquet
from scipy.io import savemat

from data.thesis import model_named
from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from experiments.campaign.distributions import RUNS
from experiments.campaign.seal import SEAL, Seal
from identification.fit_model import fit_model
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.structure import Wanted
from identification.sweeps.kept_responses import write_responses
from identification.sweeps.read_sweeps import read_sweeps

PLANT = PlantModel(2.0, (Mode(20.0, 0.05),), (Mode(25.0, 0.04),), 0.004)
LINES = 40
FUNCTION = {
    **{"type": 58, "func_type": 4, "id1": "SYNTHETIC", "load_case_id": 0, "abscissa_spacing": 0},
    **{"rsp_ent_name": "NONE", "rsp_node": 1, "rsp_dir": 1, "ref_ent_name": "NONE", "ref_node": 1, "ref_dir": 1},
    **{"orddenom_spec_data_type": 0, "abscissa_axis_units_lab": "Hz"},
}
TABLES = Path(__file__).resolve().parents[2] / "tests/snapshots/test_figure_data"


@cache
def sweeps() -> dict[str, bytes]:
    """The same response as CSV, MAT, universal file and .npz; two raw records."""
    rng = np.random.default_rng(1)
    omega = np.geomspace(5.0, 400.0, LINES)
    noise = 0.02 * (rng.standard_normal(LINES) + 1j * rng.standard_normal(LINES))
    response = PLANT(1j * omega) * (1 + noise)
    table = pd.DataFrame({"omega": omega, "real": response.real, "imag": response.imag, "coherence": 0.99})
    time_s = np.arange(256) / 128
    record = pd.DataFrame({"time_s": time_s, "input": np.sin(20 * time_s**2), "output": np.cos(20 * time_s**2)})
    hertz = np.arange(1.0, 13.0)
    with TemporaryDirectory() as name:
        folder = Path(name)
        for stem, each in (("sweep", table), ("record", record)):
            text = "# SYNTHETIC\n" + each.to_csv(index=False, float_format="%.9g", lineterminator="\n")
            (folder / f"{stem}.csv").write_text(text, encoding="utf-8")
        savemat(folder / "sweep.mat", {"omega": omega, "response": response})
        savemat(folder / "record.mat", dict(record.items()), format="4")
        savemat(folder / "squeezed.mat", {"omega": omega, "response": response}, do_compression=True)
        savemat(folder / "fields.mat", {"data": {"omega": omega, "response": response, "note": "further"}})
        with h5py.File(folder / "hdf5.mat", "w") as file:
            file.update({"data/omega": omega, "data/response": response})
        for number, binary in enumerate((0, 1)):
            written = FUNCTION | {"binary": binary, "x": hertz, "data": PLANT(2j * np.pi * hertz)}
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves a file open when it writes binary data
                pyuff.UFF(str(folder / f"sweep_{number}.uff")).write_sets([written], mode="add")
        write_responses(folder / "sweep.npz", read_sweeps(folder / "sweep.csv"))
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@cache
def models() -> dict[str, bytes]:
    """Two models, one of them fitted to sweep.csv."""
    with TemporaryDirectory() as name:
        path = Path(name) / "sweep.csv"
        path.write_bytes(sweeps()[path.name])
        fitted = fit_model(read_sweeps(path), Wanted(1, (1, 1), (0, 0)))
    return {"model.json": fitted.model.to_json().encode(), "implied.json": model_named("implied").to_json().encode()}


@cache
def designs() -> dict[str, bytes]:
    """A design of each kind, and one with a roll-off."""
    implied = model_named("implied")
    return {
        "design_extended.json": design_extended(implied, [1.5], 4.0, [(2.0, 1.0)]).to_json().encode(),
        "design_robust.json": design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], robust_level=0.9).to_json().encode(),
        "design_delay_free.json": design_delay_free(implied, [tau / 4.0], 1e-4).to_json().encode(),
    }


@cache
def tables() -> dict[str, bytes]:
    """The tables that figures are drawn of, as the snapshots of the tests hold them."""
    return {path.name: path.read_bytes() for path in sorted(TABLES.glob("*.csv"))}


@cache
def campaigns() -> dict[str, bytes]:
    """A campaign of eight plants."""
    table = campaign_table()
    return {"campaign.parquet": as_parquet(table), "raw.parquet": as_parquet(table, compression="none")}


def campaign_table(count: int = 8) -> pd.DataFrame:
    """Its rows, three a plant."""
    k = np.arange(count)
    rows = [
        pd.DataFrame(
            {
                "plant": k,
                "distance": (k + 0.5) / count,
                "linear_stable": k > 1,
                "anti_windup": run,
                "diverged": k == 0,
                "guaranteed_sector": 0.75 * (run == "corrected"),
                "covered": (k % 4 == 0) & (run == "corrected"),
                "peak_error": np.where(k == 0, np.nan, 50.0 + k),
                "steady_error": np.where(k == 0, np.nan, 10.0 ** (-k / 4)),
                "recovery_s": np.where(k < 3, np.nan, 5.0 + k),
            }
        )
        for run in RUNS
    ]
    return pd.concat(rows, ignore_index=True)


def as_parquet(table: pd.DataFrame, **options: str) -> bytes:
    """The file of a campaign, sealed whatever its rows are."""
    facts = {"plants": "8", "seed": "7", "horizon_s": "25"}
    facts |= {"lower_limit": "-12.5", "limit": "12.5", "rate_limit": "inf"}
    content = pyarrow.Table.from_pandas(table, preserve_index=False).replace_schema_metadata(facts)
    seal = Seal(content.schema)
    for batch in content.to_batches():
        seal.update(batch)
    content = content.replace_schema_metadata(facts | {SEAL: str(seal)})
    written = io.BytesIO()
    parquet.write_table(content, written, **options)
    return written.getvalue()
