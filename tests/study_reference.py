"""The language of a study as the documentation prints it: every section, key, value, default and meaning."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from types import ModuleType
from typing import Any

from sweep.base.types import Section
from sweep.features import parts
from sweep.study.editors import Json, study_schema

_SCHEMA = study_schema()
_REF = "#/$defs/"
_STUDY = "A study"
_HEAD = ["| key | value | default | meaning |", "| --- | --- | --- | --- |"]
_COPY = "WithEach"
"""Ends the names of copies that the schema holds for editors alone."""
_TYPES = {
    "integer": "whole number",
    "number": "number",
    "string": "text",
    "boolean": "true or false",
    "null": "nothing",
}


def study_reference() -> list[str]:
    """Markdown: a table of keys for each section, the study itself first, then the keys of each feature."""
    sections = {name: s for name, s in _SCHEMA["$defs"].items() if not name.endswith(_COPY) and s.get("properties")}
    own = {feature: _of_feature(module) for feature, module in parts("section").items() if hasattr(module, "KEYS")}
    core = [name for name in sections if not any(name in names for _, names in own.values())]
    of_features = {key for keys, _ in own.values() for at in keys.values() for key in at}
    lines = []
    for name, section in {_STUDY: _SCHEMA, **{name: sections[name] for name in core}}.items():
        lines += _heading(_title(name), section)
        lines += [_row(key, prop, section) for key, prop in section["properties"].items() if key not in of_features]
    for feature, (keys, names) in own.items():
        lines += ["", f"## Keys of the feature {feature}", "", *_HEAD]
        for at, added in keys.items():
            section = _SCHEMA if at == "StudySection" else sections[at]
            rows = [_row(key, section["properties"][key], section) for key in added]
            of = "" if at == "StudySection" else f" of {_link(at)}"
            lines += [row.replace(f"`{key}`", f"`{key}`{of}", 1) for key, row in zip(added, rows, strict=True)]
        for name in names:
            lines += _heading(_title(name), sections[name])
            lines += [_row(key, prop, sections[name]) for key, prop in sections[name]["properties"].items()]
    return lines[1:]


def _of_feature(module: ModuleType) -> tuple[dict[str, list[str]], list[str]]:
    """The keys that a feature adds, by section, and the names of its own sections."""
    schemas = {at: keys.model_json_schema(by_alias=True) for at, keys in module.KEYS.items()}
    inside = module.__name__.rpartition(".")[0]
    every = {kind.__name__ for kind in _kinds(Section) if kind.__module__.startswith(f"{inside}.")}
    names = [name for schema in schemas.values() for name in schema.get("$defs", {}) if name in every]
    return {at: list(schema["properties"]) for at, schema in schemas.items()}, names


def _kinds(of: type) -> Iterator[type]:
    for kind in of.__subclasses__():
        yield kind
        yield from _kinds(kind)


def _heading(title: str, section: Json) -> list[str]:
    return ["", f"### {title}", "", _text(section.get("description", "")), "", *_HEAD]


def _title(name: str) -> str:
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.removesuffix("Section"))
    return words[:1].upper() + words[1:].lower()


def _text(description: str) -> str:
    return " ".join(description.split())


def _row(key: str, prop: Json, section: Json) -> str:
    needed = key in section.get("required", [])
    own = prop.get("description", "")
    meaning = "" if own == section.get("description") else _text(own)
    default = "must be there" if needed else _default(prop)
    return f"| `{key}` | {_value(prop)} | {default} | {meaning} |".replace("|  |", "| |").replace("|  |", "| |")


def _default(prop: Json) -> str:
    """The value where nothing is said; of a whole section its own table tells them."""
    value = prop.get("default")
    return "" if value is None or value == "" or isinstance(value, dict | list) else f"`{json.dumps(value)}`"


def _value(prop: Json) -> str:
    """What may stand there, in words."""
    return " or ".join(dict.fromkeys(part for part in _values(prop) if part))


def _values(prop: Any) -> Iterator[str]:
    for part in (*prop.get("anyOf", ()), *prop.get("oneOf", ()), *prop.get("allOf", ())):
        yield from _values(part)
    if "$ref" in prop:
        name = prop["$ref"].removeprefix(_REF).removesuffix(_COPY)
        if _SCHEMA["$defs"][name].get("properties"):
            yield _link(name)
        else:
            yield from _values(_SCHEMA["$defs"][name])
    elif "const" in prop:
        yield f"`{prop['const']}`"
    elif "enum" in prop:
        yield ", ".join(f"`{value}`" for value in prop["enum"])
    elif prop.get("type") == "array":
        yield f"list of {_value(prop.get('items', {})) or 'values'}"
    elif prop.get("type") == "object":
        inner = prop.get("additionalProperties")
        yield f"NAME: {_value(inner)}" if isinstance(inner, dict) and inner else "mapping"
    elif isinstance(prop.get("type"), str) and prop["type"] != "null":
        yield _TYPES[prop["type"]] + _range(prop)


def _link(name: str) -> str:
    title = _title(name)
    return f"[{title}](#{title.lower().replace(' ', '-')})"


def _range(prop: Json) -> str:
    """The ends of a number."""
    low, high = prop.get("minimum"), prop.get("maximum")
    above, below = prop.get("exclusiveMinimum"), prop.get("exclusiveMaximum")
    ends = [
        f"{word} {end:.12g}"
        for word, end in (("from", low), ("above", above), ("to", high), ("below", below))
        if end is not None
    ]
    return f", {' '.join(ends)}" if ends else ""
