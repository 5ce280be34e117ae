"""The ledger and its recomputation, once a session."""

import pandas as pd
import pytest

from design.contract import Design
from design.extended import design_extended
from experiments.claims import read_ledger, recompute
from identification.model import IdentifiedModel, read_model
from identification.thesis import printed


@pytest.fixture(scope="session")
def ledger() -> pd.DataFrame:
    return read_ledger()


@pytest.fixture(scope="session")
def recomputed(ledger: pd.DataFrame) -> pd.DataFrame:
    return recompute(ledger).set_index("id")


@pytest.fixture(scope="session")
def implied() -> IdentifiedModel:
    return read_model("implied")


@pytest.fixture(scope="session")
def extended_design(implied: IdentifiedModel) -> Design:
    chosen = printed()["extended"]
    return design_extended(implied, [chosen["reference"]["omega"]], chosen["a"], [(chosen["e"], chosen["f"])])
