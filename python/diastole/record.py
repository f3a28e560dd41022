"""Documents as dataclasses: what results.py is made of."""

from __future__ import annotations

import dataclasses
import types
import typing
from typing import Any, TypeVar

T = TypeVar("T", bound="Record")
_hints: dict[type, dict[str, Any]] = {}


def _read(kind: Any, value: Any, place: str) -> Any:
    """`value` as JSON has it, as `kind`; raises TypeError that names the place."""
    if kind is Any:
        return value
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        if value is None and type(None) in arguments:
            return None
        for each in arguments:
            if each is not type(None):
                try:
                    return _read(each, value, place)
                except TypeError:
                    continue
        raise TypeError(f"{place}: {value!r} is not {kind}")
    if origin is list:
        if not isinstance(value, list):
            raise TypeError(f"{place}: {value!r} is no list")
        return [_read(arguments[0], each, f"{place}[{i}]") for i, each in enumerate(value)]
    if origin is dict:
        if not isinstance(value, dict):
            raise TypeError(f"{place}: {value!r} is no object")
        return {key: _read(arguments[1], each, f"{place}.{key}") for key, each in value.items()}
    if dataclasses.is_dataclass(kind):
        return typing.cast("type[Record]", kind).from_json(value, place)
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise TypeError(f"{place}: {value!r} is not {kind.__name__}")
    return value


class Record:
    """A dataclass whose fields are a JSON object's members. Members that this version does not know are left out."""

    @classmethod
    def from_json(cls: type[T], document: Any, place: str = "") -> T:
        if not isinstance(document, dict):
            raise TypeError(f"{place or cls.__name__}: {document!r} is no object")
        if cls not in _hints:
            _hints[cls] = typing.get_type_hints(cls)
        fields: dict[str, Any] = {}
        for field in dataclasses.fields(cls):
            name = field.metadata.get("name", field.name)
            if name in document:
                fields[field.name] = _read(_hints[cls][field.name], document[name], f"{place or cls.__name__}.{name}")
            elif field.default is dataclasses.MISSING:
                raise TypeError(f"{place or cls.__name__} lacks {name}")
        return cls(**fields)

    def _repr_html_(self) -> str:
        from diastole import pictures

        return pictures.of(self)
