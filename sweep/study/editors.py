"""JSON Schema of the study file, for editors that complete and check it while it is written."""

from __future__ import annotations

import json
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from ..base.types import key_texts
from ..designs.registry import FAMILIES, FamilyOptions
from .schema import StudySection

SCHEMA_FILE = "study.schema.json"
"""Its name beside the studies, which their first line gives."""
TITLE = "A study of sweep"
"""Title of the schema, its second key."""
_REF = "#/$defs/"
Json = dict[str, Any]


class _Described(GenerateJsonSchema):
    """Generator with the docstrings below the keys, and without titles of keys, which only repeat these."""

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        """Add the descriptions; pydantic would read all sources whenever the package is imported."""
        described, section = super().model_schema(schema), schema["cls"]
        options = [family.Options for family in FAMILIES.values()] if issubclass(section, FamilyOptions) else []
        texts = key_texts([*options, *reversed(section.__mro__)])
        if "description" in described:  # without the keys that `help` shows
            described["description"] = described["description"].partition("\n\nParameters\n")[0]
        for name, field in section.model_fields.items():
            if name in texts:
                described["properties"][field.alias or name]["description"] = texts[name]
        return described

    def field_title_should_be_set(self, schema: core_schema.CoreSchema | Any) -> bool:  # noqa: ARG002  (pydantic's)
        """Return False."""
        return False


def study_schema() -> Json:
    """Return the schema of studies: sections as mappings or as their short forms, nothing unknown.

    It is wider than the loader in what only a whole file tells: names that refer to others, what goes together.
    """
    schema = StudySection.model_json_schema(mode="validation", by_alias=True, schema_generator=_Described)
    sections: JsonSchemaValue = schema["$defs"]
    for section in [schema, *sections.values()]:
        # A key that has no description of its own shows its section's, which speaks of it.
        for prop in section.get("properties", {}).values():
            if "description" in section and "$ref" not in prop:
                prop.setdefault("description", section["description"])
    for part in _parts(schema):
        part.pop("discriminator", None)  # OpenAPI's; the constant `kind` says it
        if part.get("type") != "string":
            part.pop("minLength", None)
    for section in sections.values():
        if "const" in section.get("properties", {}).get("kind", {}):
            section["required"] = ["kind", *section.get("required", [])]
    _loosen_each(sections)
    schema["required"].remove("sensor")  # or `sensors`
    schema["anyOf"] = [{"required": ["sensor"]}, {"required": ["sensors"]}]
    # Editors know this dialect; nothing in the schema needs a later one.
    return {"$schema": "http://json-schema.org/draft-07/schema#", "title": TITLE} | schema | {"title": TITLE}


def schema_text() -> str:
    """Return the schema as the text of a file."""
    return json.dumps(study_schema(), indent=1, ensure_ascii=False) + "\n"


def _parts(node: Any) -> Iterator[Json]:
    if isinstance(node, dict):
        yield node
    for inner in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _parts(inner)


def _loosen_each(sections: Json) -> None:
    """Let a scenario with `each` lack what that gives it: its sections require nothing but their kind."""
    template, strict = sections["ScenarioTemplate"], {}
    for key, prop in template["properties"].items():
        parts = [part for part in _parts(prop) if "$ref" in part]
        names = [part["$ref"].removeprefix(_REF) for part in parts]
        if any("required" in sections[name] for name in names):
            strict[key] = deepcopy(prop)
            for part, name in zip(parts, names, strict=True):
                loose = sections[f"{name}WithEach"] = deepcopy(sections[name])
                loose["required"] = [required for required in loose.get("required", []) if required == "kind"]
                part["$ref"] = f"{_REF}{name}WithEach"
    template |= {"if": {"required": ["each"]}, "else": {"properties": strict}}
