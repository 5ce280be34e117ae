"""The plant and the bound: each factor against its formula, the JSON they are kept in, and what is refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from design.blocks.block import bound_block, plant_block
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel, read_model
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.plant_json import bound_from_dict, bound_to_dict, plant_from_dict, plant_to_dict

S = 1j * np.geomspace(0.1, 100, 50)
PLANT = PlantModel(
    -3.0, (Mode(2.0, 0.1),), (Mode(5.0, 1.5),), 0.02, integrators=2, real_zeros=(7.0,), real_poles=(0.5,)
)


def test_every_factor() -> None:
    zeros = (1 + 0.1 * S + (S / 2) ** 2) * (1 + S / 7)
    poles = S**2 * (1 + 0.6 * S + (S / 5) ** 2) * (1 + S / 0.5)
    np.testing.assert_allclose(PLANT(S), -3 * zeros / poles * np.exp(-0.02 * S), rtol=1e-13)
    np.testing.assert_allclose(plant_block(PLANT)(S), PLANT(S), rtol=1e-12)
    assert PLANT.relative_degree == 2


def test_the_printed_form_of_the_bound() -> None:
    bound = AdditiveBound.printed_form(0.3, 20.0, 70.0, 0.02)
    np.testing.assert_allclose(bound(S), 0.3 * (1 + S / 20) / (1 + 0.04 * S / 70 + (S / 70) ** 2), rtol=1e-13)
    assert (bound.order, bound.corner, bound.resonance) == (2, 20.0, Mode(70.0, 0.02))


def test_a_bound_of_order_three() -> None:
    bound = AdditiveBound(0.3, (Mode(4.0, 0.2),), (Mode(9.0, 0.1),), (), (30.0,))
    value = 0.3 * (1 + 0.1 * S + (S / 4) ** 2) / (1 + 0.2 * S / 9 + (S / 9) ** 2) / (1 + S / 30)
    np.testing.assert_allclose(bound(S), value, rtol=1e-13)
    np.testing.assert_allclose(bound_block(bound)(S), value, rtol=1e-12)
    assert (bound.order, bound.corner, bound.resonance) == (3, 4.0, Mode(9.0, 0.1))


def test_json_there_and_back() -> None:
    for bound in (AdditiveBound.printed_form(1.0, 2.0, 3.0, 0.1), AdditiveBound(1.0, (), (), (), (4.0,))):
        assert bound_from_dict(json.loads(json.dumps(bound_to_dict(bound)))) == bound
    assert plant_from_dict(json.loads(json.dumps(plant_to_dict(PLANT)))) == PLANT
    older = {key: plant_to_dict(PLANT)[key] for key in ("gain", "zero_modes", "delay_s")}
    older["pole_modes"] = [{"omega": 5.0, "zeta": 1.5}]
    assert plant_from_dict(older) == PlantModel(-3.0, (Mode(2.0, 0.1),), (Mode(5.0, 1.5),), 0.02)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"integrators": 3}, "integrators is 3; expected an integer from -2 to 2"),
        ({"integrators": True}, "'integrators' is True"),
        ({"real_zeros": 3.0}, "'real_zeros' is 3.0; expected a list of numbers"),
        ({"real_poles": [0.0]}, "real_poles is 0; expected any other number"),
        ({"real_poles": ["2"]}, "'real_poles' is '2'; expected a number"),
        ({"integrators": 0, "pole_modes": []}, "3 zeros and 1 poles; expected no more zeros than poles"),
        ({"gain": 0}, "gain is 0"),
    ],
)
def test_what_is_no_plant(change: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        plant_from_dict(plant_to_dict(PLANT) | change)


def test_a_bound_needs_a_pole() -> None:
    with pytest.raises(InputError, match="expected one pole or more"):
        AdditiveBound(1.0, (), ())


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"fit": "x"}, "'fit' is 'x'; expected an object (of 'fit', which may be left out)"),
        ({"fit": {"source": "identification fit"}}, "'intervals_95' is None; expected an object (of 'fit', which"),
        ({"standard_errors": [1.0]}, "'standard_errors' is [1.0]; expected an object (of 'standard_errors', which"),
        ({"schema": True}, "schema is True; expected 1"),
    ],
)
def test_a_model_is_read_whole_or_refused(change: dict[str, Any], sentence: str, tmp_path: Path) -> None:
    path, bound = tmp_path / "model.json", AdditiveBound.printed_form(1.0, 2.0, 3.0, 0.1)
    model = IdentifiedModel(PLANT, bound, tuple(float(k) for k in range(len(PLANT.parameters))))
    path.write_text(model.to_json(), encoding="utf-8")
    assert read_model(path) == model
    path.write_text(json.dumps(json.loads(model.to_json()) | change), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(f"{path}: {sentence}")):
        read_model(path)


def test_standard_errors_are_of_the_plants_shape(tmp_path: Path) -> None:
    path, bound = tmp_path / "model.json", AdditiveBound.printed_form(1.0, 2.0, 3.0, 0.1)
    content = json.loads(IdentifiedModel(PLANT, bound, (1.0,) * len(PLANT.parameters)).to_json())
    del content["standard_errors"]["zero_modes"][0]
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match="the numbers of modes and real roots are"):
        read_model(path)
    del content["standard_errors"]
    path.write_text(json.dumps(content), encoding="utf-8")
    assert read_model(path) == IdentifiedModel(PLANT, bound)


def test_parameters_are_named() -> None:
    assert [parameter.name for parameter in PLANT.parameters][:3] == ["gain", "zero_omega_1", "zero_zeta_1"]
    assert PLANT.parameters[1].label == "zero mode 1, omega [rad/s]"
    assert (PLANT.parameters[-1].name, PLANT.parameters[-1].label) == ("delay_s", "delay [s]")
