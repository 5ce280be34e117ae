"""Models and designs that several tests share; each is made once a session."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator
from functools import cache
from math import tau
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:  # what the fixtures need they import, since pytest-xdist's first process needs none of it
    from design.design_file import Design
    from identification.model.model_file import IdentifiedModel

LONGEST = (
    "hygiene/test_site.py",  # builds the documentation
    "claims/test_ledger.py",  # compiles the engine, while another worker fits
    "unit/test_first_contact.py",
    "unit/test_fit.py",
    "unit/test_sweep.py",
    "snapshots/test_figure_data.py",
    "figures/test_explore_in_browser.py",
    "unit/test_campaign.py",
    "unit/test_console.py",
    "unit/test_certificates.py",
    "unit/test_uncertainty.py",
    "figures/test_report_in_browser.py",
    "figures/test_data_figures.py",
    "unit/test_closed_loop_accuracy.py",
    "hygiene/test_code_files.py",
    "properties/test_referee.py",
    "unit/test_audit.py",
    "unit/test_anti_windup.py",
    "figures/test_summary.py",
    "unit/test_robustness.py",
    "hygiene/test_wheel.py",
    "properties/test_units_of_tables.py",
    "unit/test_interrupts.py",
    "unit/test_build.py",
    "unit/test_bound_beyond.py",
    "unit/test_workers.py",
    "unit/test_fuzz.py",
    "snapshots/test_mutations.py",
    "figures/test_report.py",
    "properties/test_fit_random_plants.py",
    "unit/test_identification_cli.py",
    "unit/test_run_plot.py",
    "unit/test_subspace.py",
    "unit/test_pick.py",
    "unit/test_sampled.py",
    "unit/test_stable_intervals.py",
    "unit/test_sector_promise.py",
    "unit/test_loop_plots.py",
    "unit/test_sizes.py",
    "unit/test_unprinted_conditions.py",
    "unit/test_schemas.py",
)
"""Those of five seconds or more."""


os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # else each of the hundreds of processes compiles all modules again
sys.dont_write_bytecode = False
# A shell's background job ignores Ctrl-C, and so would every command that a test starts.
signal.signal(signal.SIGINT, signal.default_int_handler)
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
    """What is searched for a W_a alone, and the margins of a loop, are searched once a session for each."""
    from design.anti_windup import judge
    from design.auditing import audit_design
    from design.stability.margins import margins_of
    from experiments.runs import guarantee
    from experiments.thesis.studies import robustness
    from paper_figures.look import loop_curves

    margins = cache(margins_of)
    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((judge, "corrected"), (judge, "thesis_choice"), (audit_design, "least_f")):
            patch.setattr(module, name, cache(getattr(module, name)))
        for module in (audit_design, guarantee, robustness, loop_curves):
            patch.setattr(module, "margins_of", margins)
        yield


@pytest.fixture(scope="session", autouse=True)
def written_as_the_schemas_say() -> Iterator[None]:
    """Every model.json and design.json that a test writes in its own process is valid by its schema."""
    from json import loads

    from jsonschema import Draft202012Validator

    from design.design_file import Design
    from identification.model.model_file import IdentifiedModel

    root = Path(__file__).resolve().parents[1]
    schemas = {IdentifiedModel: "identification/model/model.schema.json", Design: "design/design.schema.json"}
    with pytest.MonkeyPatch.context() as patch:
        for kind, file in schemas.items():
            validator = Draft202012Validator(loads((root / file).read_text(encoding="utf-8")))

            def to_json(
                self: IdentifiedModel | Design,
                write: Callable[[Any], str] = kind.to_json,
                validate: Callable[[object], None] = validator.validate,
            ) -> str:
                text = write(self)
                validate(loads(text))
                return text

            patch.setattr(kind, "to_json", to_json)
        yield


@pytest.fixture(scope="session")
def implied() -> IdentifiedModel:
    """The set behind the printed transfer functions."""
    from data.thesis import model_named

    return model_named("implied")


@pytest.fixture(scope="session")
def table() -> IdentifiedModel:
    """Table 2.1 as printed."""
    from data.thesis import model_named

    return model_named("table")


@pytest.fixture(scope="session")
def extended_design(implied: IdentifiedModel) -> Design:
    """Chapter 4 with the printed free parameters."""
    from design.chapters_3_4.design_extended import design_extended

    return design_extended(implied, reference_omegas=[1.5], a=4.0, pairs=[(2.0, 1.0)])


@pytest.fixture(scope="session")
def delay_free_design(implied: IdentifiedModel) -> Design:
    """Chapter 2 with the printed period and epsilon."""
    from design.chapter_2.design_delay_free import design_delay_free

    return design_delay_free(implied, [tau / 4.0], 1e-4)
