"""JSON Schemas as dataclasses: an object with a `title` is a class of that name, its properties are the fields."""

from __future__ import annotations

import dataclasses
import json
import keyword
import pathlib
from typing import Any, NamedTuple

from diastole.record import Record

#: Commands whose documents have classes; the document's own class has the schema's title.
USED = ("simulate", "inspect", "bin", "runs", "compare", "solve", "fit", "explain", "track")
folder = pathlib.Path(__file__).parent / "schema"


class Member(NamedTuple):
    name: str  # in the document
    kind: str  # as an annotation
    required: bool

    @property
    def field(self) -> str:
        return self.name + "_" if keyword.iskeyword(self.name) else self.name


class Shape(NamedTuple):
    about: str
    members: list[Member]


def _kind(schema: dict[str, Any], shapes: dict[str, Shape]) -> str:
    """The annotation; titled objects on the way are put into `shapes`."""
    if "anyOf" in schema:
        return _union([_kind(each, shapes) for each in schema["anyOf"]])
    kinds = schema.get("type")
    if isinstance(kinds, list):
        return _union([_kind({**schema, "type": kind}, shapes) for kind in kinds])
    if kinds == "array":
        return f"list[{_kind(schema['items'], shapes)}]"
    if kinds == "object":
        if "title" in schema:
            _add(schema, shapes)
            return str(schema["title"])
        of_values = schema.get("additionalProperties")
        return f"dict[str, {_kind(of_values, shapes)}]" if isinstance(of_values, dict) else "dict[str, Any]"
    return {"boolean": "bool", "integer": "int", "number": "float", "string": "str", "null": "None"}.get(str(kinds), "Any")


def _union(kinds: list[str]) -> str:
    return " | ".join(sorted(dict.fromkeys(kinds), key=lambda kind: kind == "None"))


def _add(schema: dict[str, Any], shapes: dict[str, Shape]) -> None:
    name, required = schema["title"], set(schema.get("required", ()))
    before = shapes.get(name)
    if before is None:
        shapes[name] = Shape("", [])  # keeps its place before those that it refers to
    members = [Member(key, _kind(value, shapes), key in required) for key, value in schema["properties"].items()]
    members.sort(key=lambda member: not member.required)
    if before is not None and before.members and before.members != members:
        raise TypeError(f"two objects of different members have the title {name}")
    shapes[name] = Shape(schema.get("description", ""), members)


def shapes() -> dict[str, Shape]:
    """Of all documents of the commands above, by their names."""
    found: dict[str, Shape] = {}
    for command in USED:
        _add(json.loads((folder / f"{command}.schema.json").read_text()), found)
    return found


def stub() -> str:
    """What type checkers read: results.pyi."""
    text = '"""Made of docs/schema by `tools/json_schema python`."""\n\nfrom dataclasses import dataclass\nfrom typing import Any\n\nfrom diastole.record import Record\n'
    for name, shape in shapes().items():
        text += f"\n@dataclass(frozen=True)\nclass {name}(Record):\n" + (f'    """{shape.about}"""\n\n' if shape.about else "")
        for member in shape.members:
            text += f"    {member.field}: {member.kind}" + ("\n" if member.required else " | None = ...\n" if "None" not in member.kind else " = ...\n")
    return text


def made(module: str) -> dict[str, type]:
    """The dataclasses, which belong to this module."""
    classes: dict[str, type] = {}
    for name, shape in shapes().items():
        fields: list[Any] = []
        for member in shape.members:
            kind = member.kind if member.required or "None" in member.kind else f"{member.kind} | None"
            about = dataclasses.field(metadata={"name": member.name}) if member.required else dataclasses.field(default=None, metadata={"name": member.name})
            fields.append((member.field, kind, about))
        classes[name] = dataclasses.make_dataclass(name, fields, bases=(Record,), frozen=True, namespace={"__doc__": shape.about or name, "__module__": module})
    return classes
