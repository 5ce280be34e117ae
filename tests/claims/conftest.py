"""The ledger and its recomputation, once a session."""

import pandas as pd
import pytest

from experiments.thesis.claims.ledger import read_ledger, recompute
from identification.base.files import write_whole


@pytest.fixture(scope="session")
def ledger() -> pd.DataFrame:
    return read_ledger()


@pytest.fixture(scope="session")
def judged(ledger: pd.DataFrame, tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> pd.DataFrame:
    """What one worker of a parallel session has recomputed, the others read."""
    if worker_id == "master":
        return recompute(ledger)
    shared = tmp_path_factory.getbasetemp().parent / "judged.pickle"
    if not shared.exists():
        write_whole({shared: recompute(ledger).to_pickle})
    return pd.read_pickle(shared)


@pytest.fixture(scope="session")
def recomputed(judged: pd.DataFrame) -> pd.DataFrame:
    return judged.set_index("id")
