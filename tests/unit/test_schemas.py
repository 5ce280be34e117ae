"""The JSON Schemas of model.json and design.json say what their readers and writers do, on the files and on mutants."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from design.chapter_2.design_delay_free import design_delay_free
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design, read_design
from identification.base.errors import InputError
from identification.fit_model import fit
from identification.model.model_file import IdentifiedModel, read_model
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.reports import ModeCheck, SubspaceCheck
from identification.sweeps.response import FrequencyResponse

ROOT = Path(__file__).resolve().parents[2]
MODEL, DESIGN = (
    json.loads((ROOT / file).read_text(encoding="utf-8"))
    for file in ("identification/model/model.schema.json", "design/design.schema.json")
)
OTHER_TYPES = (None, "text", 7.5, True, {})
ABSURD = (1e300, -1e300, 1e-300)

Content = dict[str, Any]
Read = Callable[[Path], IdentifiedModel | Design]


@pytest.fixture(scope="module")
def fitted() -> IdentifiedModel:
    """Of two tests that differ, with a check of the modes of one."""
    omega, rng, tests = np.linspace(5.0, 60.0, 40), np.random.default_rng(1), []
    for zero, pole in ((20.0, 31.0), (20.4, 30.6)):
        plant = PlantModel(2.0, (Mode(zero, 0.05),), (Mode(pole, 0.04),), 0.02)
        noise = 0.002 * (rng.normal(size=40) + 1j * rng.normal(size=40))
        tests.append(
            FrequencyResponse(omega, plant(1j * omega) * (1 + noise), None, f"test of {zero:g}", synthetic=True)
        )
    model = fit(tests, modes=1, real=0, integrators=1, bound_below=0.1)
    assert model.fit is not None
    assert model.fit.scatter is not None
    checks = {tests[0].name: SubspaceCheck(4, 0.01, (ModeCheck("zero", 20.0, 0.05, 20.1, None),))}
    return replace(model, fit=replace(model.fit, checks=checks))


@pytest.fixture(scope="module")
def documents(fitted: IdentifiedModel) -> dict[str, Content]:
    """A document of each kind by its name."""
    bound = fitted.additive_bound
    wider = replace(bound, pole_modes=(*bound.pole_modes, Mode(50.0, 0.5)))
    made = {
        "model": fitted,
        "model of a wider bound": replace(fitted, additive_bound=wider, fit=None, standard_errors=None),
        "extended": design_extended(fitted, [1.5], robust_level=0.5),
        "delay-free": design_delay_free(fitted, [1.5], 1e-4),
    }
    contents = {name: json.loads(each.to_json()) for name, each in made.items()}
    for name in ("extended", "delay-free"):  # some blocks are enough
        blocks = contents[name]["blocks"]
        contents[name]["blocks"] = {each: blocks[each] for each in ("K", "T_so", "Lambda", "G_A") if each in blocks}
    return contents


def objects_of(content: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The paths of the objects of a document; of a list the first entry speaks for all."""
    if isinstance(content, dict):
        yield path
    for key, value in content.items() if isinstance(content, dict) else list(enumerate(content))[:1]:
        if isinstance(value, dict | list):
            yield from objects_of(value, (*path, key))


def at(content: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        content = content[key]
    return content


def mutants(content: Content) -> Iterator[tuple[str, Content]]:
    """Each member dropped, renamed, of other types; one more; numbers out of range. One of the objects of a form."""
    forms = {tuple(at(content, path)): path for path in reversed([*objects_of(content)])}
    for path in forms.values():

        def changed(change: Callable[[Content], object], path: tuple[Any, ...] = path) -> Content:
            other = deepcopy(content)
            change(at(other, path))
            return other

        yield f"{path}: one more", changed(lambda found: found.update(one_more=1.0))
        for key, value in at(content, path).items():
            name = f"{(*path, key)}"
            yield f"{name} dropped", changed(lambda found, key=key: found.pop(key))
            yield f"{name} renamed", changed(lambda found, key=key: found.update({f"{key}_": found.pop(key)}))
            kind = float if isinstance(value, int) and not isinstance(value, bool) else type(value)
            values: list[Any] = [each for each in OTHER_TYPES if type(each) is not kind]
            if isinstance(value, int) and not isinstance(value, bool):
                values.append(value + 0.5)
            elif isinstance(value, float):
                values += ABSURD
                if path[:1] in (("plant",), ("additive_bound",)):
                    values += [0.0, -value]
            for other in values:
                yield f"{name} = {other}", changed(lambda found, key=key, other=other: found.update({key: other}))
                if isinstance(value, list) and value and not isinstance(other, type(value[0])):
                    first = [other, *value[1:]]
                    yield f"{name}[0] = {other}", changed(lambda found, key=key, new=first: found.update({key: new}))


def is_read(content: Content, read: Read, path: Path) -> bool:
    """Whether a reader takes a document."""
    path.write_text(json.dumps(content), encoding="utf-8")
    try:
        read(path)
    except InputError:
        return False
    return True


@pytest.mark.parametrize("name", ["model", "model of a wider bound", "extended", "delay-free"])
def test_the_schema_takes_what_the_reader_takes(name: str, documents: Mapping[str, Content], tmp_path: Path) -> None:
    """And nothing else, of mutants of each member."""
    content, is_model = documents[name], name.startswith("model")
    schema, read = (MODEL, read_model) if is_model else (DESIGN, read_design)
    validator = Draft202012Validator(schema)
    assert validator.is_valid(content)
    assert is_read(content, read, tmp_path / "a.json")
    found = {
        mutant: (validator.is_valid(changed), is_read(changed, read, tmp_path / "a.json"))
        for mutant, changed in mutants(content)
    }
    assert {valid for valid, _ in found.values()} == {True, False}
    assert [mutant for mutant, (valid, taken) in found.items() if valid != taken] == []


@pytest.mark.parametrize("change", [{}, {"sector": None}, {"certificate": [[1.0]]}, {"guarantee": "global"}])
def test_a_sector_takes_the_place_of_a_certificate(change: Content, fitted: IdentifiedModel, tmp_path: Path) -> None:
    content = json.loads(design_extended(fitted, [1.5], guarantee="sector").to_json())
    content["anti_windup"]["corrected"] |= change
    assert Draft202012Validator(DESIGN).is_valid(content) == (not change)
    assert is_read(content, read_design, tmp_path / "a.json") == (not change)


def test_the_schemas_agree_on_what_both_files_hold() -> None:
    shared = MODEL["$defs"].keys() & DESIGN["$defs"].keys()
    assert shared >= {"plant", "additive_bound", "signals"}
    for name in shared:
        assert MODEL["$defs"][name] == DESIGN["$defs"][name]


@pytest.mark.parametrize("schema", [MODEL, DESIGN], ids=["model", "design"])
def test_the_schemas_are_of_the_draft_that_they_name(schema: Content) -> None:
    Draft202012Validator.check_schema(schema)
