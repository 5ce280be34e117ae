"""Models and designs that several tests share; each is made once a session."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import pytest

from data.thesis import model_named
from design.anti_windup import judge
from design.auditing import audit_design
from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from identification.model.model_file import IdentifiedModel


@pytest.fixture(scope="session", autouse=True)
def searched_once() -> Iterator[None]:
    """What is searched for a W_a alone, whatever the design, is searched once a session for each."""
    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((judge, "corrected"), (judge, "thesis_choice"), (audit_design, "least_f")):
            patch.setattr(module, name, cache(getattr(module, name)))
        yield


@pytest.fixture(scope="session")
def implied() -> IdentifiedModel:
    """The set behind the printed transfer functions."""
    return model_named("implied")


@pytest.fixture(scope="session")
def table() -> IdentifiedModel:
    """Table 2.1 as printed."""
    return model_named("table")


@pytest.fixture(scope="session")
def extended_design(implied: IdentifiedModel) -> Design:
    """Chapter 4 with the printed free parameters."""
    return design_extended(implied, reference_omegas=[1.5], a=4.0, pairs=[(2.0, 1.0)])


@pytest.fixture(scope="session")
def delay_free_design(implied: IdentifiedModel) -> Design:
    """Chapter 2 with the printed period and epsilon."""
    return design_delay_free(implied, period_s=4.0, epsilon=1e-4)
