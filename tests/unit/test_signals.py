"""Names and units of a plant's input and output, from the fit's options to design.json."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import read_design
from identification.base.errors import InputError
from identification.model.model_file import IdentifiedModel, read_model
from identification.model.signals import LONGEST, Signals

MOTOR = Signals("motor current", "A", "angle", "rad")


def test_the_labels_name_the_unit_where_it_is_known() -> None:
    assert (MOTOR.input, MOTOR.output, MOTOR.gain_unit) == ("motor current [A]", "angle [rad]", "rad/A")
    assert (Signals().input, Signals().output, Signals().gain_unit) == ("input", "output", "")
    assert Signals(input_unit="N m", output_unit="m/s^2").gain_unit == "m/s^2/(N m)"
    assert Signals(input_unit="V").gain_unit == "1/V"
    assert Signals(output_unit="m").gain_unit == "m"
    duty = Signals("duty cycle", "1", "voltage", "V")
    assert (duty.input, duty.gain_unit, duty.input_unit) == ("duty cycle", "V", "")
    assert Signals(input_unit="A", output_unit="1").gain_unit == "1/A"


@pytest.mark.parametrize(
    ("field", "value"),
    [("input_name", ""), ("output_name", " y"), ("input_unit", "A\n"), ("output_unit", "m" * (LONGEST + 1))],
)
def test_a_name_that_does_not_fit_on_an_axis_is_refused(field: str, value: str) -> None:
    with pytest.raises(InputError, match=field.replace("_", "-")):
        Signals(**{field: value})


def test_model_and_designs_keep_them(implied: IdentifiedModel, tmp_path: Path) -> None:
    model, design = tmp_path / "model.json", tmp_path / "design.json"
    model.write_text(replace(implied, signals=MOTOR).to_json())
    for made in (design_extended(read_model(model), [1.5]), design_delay_free(read_model(model), [1.5], 1e-4)):
        design.write_text(made.to_json())
        assert read_design(design).signals == MOTOR
