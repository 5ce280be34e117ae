"""The tables of the reference are those of the schemas and of the keys of axis.toml; --force-regen writes them anew."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from identification.base.axis_file import KEYS, READERS

ROOT = Path(__file__).resolve().parents[2]
BEGIN, END = "<!-- made by tests/hygiene/test_reference_pages.py --force-regen -->", "<!-- end -->"
BAR = r"\vert "  # in the formulas of a table, whose columns a bar would end
WORDS = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false", "null": "null"}

Schema = dict[str, Any]


def kind_of(schema: Schema) -> str:
    """What a member is, in words, with links to the objects of the page."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{name})"
    if "enum" in schema:
        return " or ".join(f"`{word}`" for word in schema["enum"])
    if "const" in schema:
        return f"{schema['const']}"
    if "anyOf" in schema:
        return " or ".join(map(kind_of, schema["anyOf"]))
    types = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    words = [WORDS[each] for each in types if each in WORDS]
    if "array" in types:
        items = kind_of(schema["items"])
        words.insert(0, f"list of {items}" if "](" in items else f"list of {items.removeprefix('list of ')}s")
    if "object" in types:
        of = schema.get("additionalProperties")
        words.insert(0, f"name: {kind_of(of)}" if of else "empty object")
    shape = f" ({schema['x-shape']})" if "x-shape" in schema else ""
    return " or ".join(words) + shape


def table_of(schema: Schema) -> list[str]:
    """A row for each member of an object; examples where there are any."""
    rows = [("member", "what it is", "meaning", "example"), ("---", "---", "---", "---")]
    for name, member in schema["properties"].items():
        optional = "" if name in schema.get("required", ()) else " (optional)"
        unit = f" in {member['x-unit']}" if "x-unit" in member else ""
        example = f"`{json.dumps(member['examples'][0], ensure_ascii=False)}`" if "examples" in member else ""
        rows.append((f"`{name}`{optional}", f"{kind_of(member)}{unit}", member["description"], example))
    columns = 4 if any("examples" in member for member in schema["properties"].values()) else 3
    return [f"| {' | '.join(cell.replace('|', BAR) for cell in row[:columns])} |" for row in rows]


def tables_of(schema: Schema) -> str:
    """A part for the file and for each object in it."""
    parts = [*table_of(schema)]
    for name, definition in schema["$defs"].items():
        parts += ["", f"### {name}", "", definition["description"]]
        for each in (definition, *(form for form in definition.get("oneOf", []) if "properties" in form)):
            parts += ["", *table_of(each)] if "properties" in each else []
        if forms := [form for form in definition.get("oneOf", []) if "$ref" in form]:
            parts += ["", f"It is {' or '.join(map(kind_of, forms))}."]
    return "\n".join(parts)


def keys_of_an_axis() -> str:
    lines = ["| key | what is expected | example | meaning |", "|---|---|---|---|"]
    for name, key in KEYS.items():
        words = " or ".join(f'`"{word}"`' for word in key.kind.split("|"))
        expected = READERS[key.kind][1] if key.kind in READERS else words
        comment = key.comment.replace("|W_a C S|", rf"${BAR}W_a C S {BAR}$")
        lines.append(f"| `{name}` | {expected} | `{key.example}` | {comment} |")
    return "\n".join(lines)


def schema_at(file: str) -> Callable[[], str]:
    return lambda: tables_of(json.loads((ROOT / file).read_text(encoding="utf-8")))


PAGES = {
    "model_json.md": schema_at("identification/model/model.schema.json"),
    "design_json.md": schema_at("design/design.schema.json"),
    "axis_toml.md": keys_of_an_axis,
}


@pytest.mark.parametrize("name", PAGES)
def test_the_tables_of_a_page_are_those_of_the_code(name: str, pytestconfig: pytest.Config) -> None:
    path = ROOT / "docs" / "reference" / name
    before, _, rest = path.read_text(encoding="utf-8").partition(f"{BEGIN}\n")
    found, _, after = rest.partition(f"\n{END}")
    wanted = f"\n{PAGES[name]()}\n"
    if pytestconfig.getoption("force_regen"):
        path.write_text(f"{before}{BEGIN}\n{wanted}\n{END}{after}", encoding="utf-8")
    else:
        assert found == wanted
