"""JSON Schema of the study file, for editors that complete and check it while it is written."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from .schema import StudySection

SCHEMA_FILE = "study.schema.json"
"""Its name beside the studies, which their first line gives."""
TITLE = "A study of sweep"
"""Title of the schema, its second key."""
_REF = "#/$defs/"
_TEMPLATE = "ScenarioTemplate"
Json = dict[str, Any]


class _Untitled(GenerateJsonSchema):
    """Leaves out titles of keys, which only repeat the keys."""

    def field_title_should_be_set(self, schema: core_schema.CoreSchema | Any) -> bool:  # noqa: ARG002  (pydantic's)
        """Never."""
        return False


def study_schema() -> Json:
    """The schema of what the loader takes: sections as mappings or as their short forms, nothing unknown.

    It is wider than the loader in what only a whole file tells: names that refer to others, what goes together.
    """
    schema = StudySection.model_json_schema(mode="validation", by_alias=True, schema_generator=_Untitled)
    sections: JsonSchemaValue = schema["$defs"]
    for section in [schema, *sections.values()]:
        _describe_keys(section)
    for part in _parts(schema):
        part.pop("discriminator", None)  # OpenAPI's; the constant `kind` says it
        if part.get("type") != "string":
            part.pop("minLength", None)
    for section in sections.values():
        if "const" in section.get("properties", {}).get("kind", {}):
            section["required"] = ["kind", *section.get("required", [])]
    _loosen_each(sections)
    # Editors know this dialect; nothing in the schema needs a later one.
    return {"$schema": "http://json-schema.org/draft-07/schema#", "title": TITLE} | schema | {"title": TITLE}


def schema_text() -> str:
    """The schema as the text of a file."""
    return json.dumps(study_schema(), indent=1, ensure_ascii=False) + "\n"


def _describe_keys(section: Json) -> None:
    """A key that has no description of its own shows its section's, which speaks of it."""
    for prop in section.get("properties", {}).values():
        if "description" in section and "$ref" not in prop:
            prop.setdefault("description", section["description"])


def _parts(node: Any) -> Iterator[Json]:
    if isinstance(node, dict):
        yield node
    for inner in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _parts(inner)


def _loosen_each(sections: Json) -> None:
    """With `each` a scenario may lack what `each` gives it: its sections require nothing but their kind.

    Without `each` the sections as they are hold.
    """
    template = sections[_TEMPLATE]
    strict = {}
    for key, prop in template["properties"].items():
        named = {part["$ref"] for part in _parts(prop) if "$ref" in part}
        if any("required" in sections[ref.removeprefix(_REF)] for ref in named):
            strict[key] = json.loads(json.dumps(prop))
            for part in _parts(prop):
                if "$ref" in part:
                    part["$ref"] = _loose(sections, part["$ref"].removeprefix(_REF))
    template |= {"if": {"required": ["each"]}, "else": {"properties": strict}}


def _loose(sections: Json, name: str) -> str:
    """The reference to a copy of a section in which everything but `kind` may be missing."""
    copied = json.loads(json.dumps(sections[name]))
    copied["required"] = [key for key in copied.get("required", []) if key == "kind"]
    sections[f"{name}WithEach"] = copied
    return f"{_REF}{name}WithEach"
