"""The ledger and its recomputation, once a session."""

import pandas as pd
import pytest

from experiments.thesis.claims.ledger import read_ledger, recompute


@pytest.fixture(scope="session")
def ledger() -> pd.DataFrame:
    return read_ledger()


@pytest.fixture(scope="session")
def judged(ledger: pd.DataFrame) -> pd.DataFrame:
    return recompute(ledger)


@pytest.fixture(scope="session")
def recomputed(judged: pd.DataFrame) -> pd.DataFrame:
    return judged.set_index("id")
