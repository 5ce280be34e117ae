"""Models and designs that several tests share; each is made once a session."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from functools import cache
from math import tau
from pathlib import Path

import pytest

from data.thesis import model_named
from design.anti_windup import judge
from design.auditing import audit_design
from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design
from identification.model.model_file import IdentifiedModel

LONGEST = (
    "claims/test_ledger.py",  # compiles the engine, while another worker fits
    "unit/test_fit.py",
    "unit/test_first_contact.py",
    "unit/test_campaign.py",
    "figures/test_data_figures.py",
    "unit/test_console.py",
    "hygiene/test_imports.py",
    "hygiene/test_code_files.py",
    "unit/test_sweep.py",
    "unit/test_audit.py",
    "unit/test_stable_intervals.py",
    "properties/test_fit_random_plants.py",
    "unit/test_unprinted_conditions.py",
    "unit/test_uncertainty.py",
    "snapshots/test_figure_data.py",
    "unit/test_closed_loop_accuracy.py",
    "hygiene/test_wheel.py",
    "unit/test_fuzz.py",
    "unit/test_certificates.py",
    "figures/test_report_in_browser.py",
    "unit/test_robustness.py",
    "unit/test_anti_windup.py",
    "unit/test_physical_limits.py",
    "unit/test_sizes.py",
    "properties/test_units_of_tables.py",
    "unit/test_build.py",
)


gc.disable()  # while modules are imported and tests collected: all that is made then stays


def pytest_collection_finish() -> None:
    """What is there now is looked at by no collection of the garbage that tests leave."""
    gc.freeze()
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The files that take longest come first, so that no worker is left with one at the end."""
    places = {Path(__file__).parent / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: places.get(item.path, len(LONGEST)))


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
    return design_delay_free(implied, [tau / 4.0], 1e-4)
