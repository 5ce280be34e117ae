"""A small plant with a dead time, its bound, and both designs of it: what the tests of other units scale."""

from __future__ import annotations

import pytest
from other_units import small_delay_free, small_extended

from design.design_file import Design
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel


@pytest.fixture(scope="session")
def small_model() -> IdentifiedModel:
    """An integrator with one anti-resonance, one resonance and a dead time."""
    plant = PlantModel(2.0, (Mode(3.0, 0.05),), (Mode(4.0, 0.05),), 0.2)
    return IdentifiedModel(plant, AdditiveBound.printed_form(0.1, 1.0, 3.5, 0.2))


@pytest.fixture(scope="session")
def small_designs(small_model: IdentifiedModel) -> dict[str, Design]:
    """Both designs, by their kind."""
    return {"extended": small_extended(small_model, 1.0), "delay-free": small_delay_free(small_model, 1.0)}
