"""A study file, and pydantic's errors as one-line issues that name their line."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from ..base.disk import NO_UTF_16, not_utf8, read_input
from ..base.errors import MOST_ISSUES, Fault, StudyError, ValidationIssue, nearest
from .tree import LOOKS_LIKE_A_NUMBER, Entries, Key, KeyPath, Place, Tree, child, has, place_in, put, yaml_text

_MOST = (500_000, 50_000)
"""Bytes of a study file, and keys and values in it."""
_MOST_RESOLVED = (8_000_000, 400_000)
"""The same of a `*.resolved.yaml`, as a run writes it: with every default, and each of up to 2000 scenarios."""
_MOST_LOOKED_AT = 2 * MOST_ISSUES
"""Errors of the schema that are read; of a value that may have several types there is one for each."""
RESOLVED = ".resolved.yaml"
"""Ends the names of studies that runs write."""
_NOT_ALLOWED = "not allowed"
_MOST_NAMED = 8
_GONE = {
    "recognition.patches": "no such key: errors are exact without patches",
    "validate.lights": "`lights: [A, B]`, which runs the study on both",
    "accuracy.single_precision": "no such key: all is computed in double precision",
}
"""Keys that a study had in earlier versions, and what to write instead."""
_YAML_1_1_BOOLEANS = {"yes": "true", "on": "true", "y": "true", "no": "false", "off": "false", "n": "false"}


class Document:
    """A parsed YAML file that knows the line of each of its keys. `data`: its keys with plain values.

    `source`: the file, or the keys themselves, which then have no file and no lines.
    """

    def __init__(self, source: Path | Mapping[str, Any]) -> None:
        self.file = str(source) if isinstance(source, Path) else None
        resolved = isinstance(source, Path) and source.name.endswith(RESOLVED)
        most_bytes, most_values = _MOST_RESOLVED if resolved else _MOST
        text = _text(source, most_bytes) if isinstance(source, Path) else yaml_text(source)
        self.data: dict[str, Any] = Tree(text, self.file, most_values).root
        if not isinstance(self.data, dict):
            allowed = "`study: name` and further keys"
            raise StudyError(ValidationIssue("a study file is a mapping of keys", self.file, 1, allowed=allowed))

    def change(self, key: str, text: Any) -> None:
        """Set a key, as the option `--set` does.

        Raises StudyError if the value cannot be set there.
        """
        option = f"--set {key}={text}"
        try:
            value = Tree(f"value: {text}", None, _MOST[1], option).root["value"]
        except StudyError as error:
            raise StudyError([replace(issue, file=option, line=None, key=None) for issue in error.issues]) from None
        try:
            self.data = put(self.data, key.split("."), value, option)
        except Fault as fault:
            problem = f"`{dotted(fault.path)}` {fault.problem} in {self.file}"
            raise StudyError(ValidationIssue(problem, option, None, None, fault.value, fault.allowed)) from None

    def put(self, key: str, value: Any, of: Sequence[Key]) -> None:
        """Set a key, with the position of another one."""
        self.data = put(self.data, (key,), value, self.place(of))

    def expand(self, key: str, names: Iterable[str]) -> None:
        """Replace each entry of a list with `*` by the names that it stands for.

        Raises StudyError for one that stands for none.
        """
        entries, known = self.data.get(key), list(names)
        if not isinstance(entries, list):
            return
        expanded = Entries()
        for at, entry in enumerate(entries):
            found = fnmatch.filter(known, entry) if isinstance(entry, str) and "*" in entry else [entry]
            if not found:
                raise StudyError(self.issue((key, at), "no built-in name fits", entry, ", ".join(known[:_MOST_NAMED])))
            expanded.places |= dict.fromkeys(range(len(expanded), len(expanded) + len(found)), self.place((key, at)))
            expanded += found
        self.put(key, expanded, (key,))

    def place(self, path: Sequence[Key]) -> Place:
        """Return the position of the deepest existing key of a path.

        Returns position in the file, or the option that changed the key.
        """
        node: Any = self.data
        place: Place = 1
        for at, part in enumerate(path):
            key = written(node, part)
            if isinstance(node, list) and isinstance(part, str) and part in node:
                key = node.index(part)  # a list of names, which is read as a mapping
            if not has(node, key):
                axes, dotted_key = child(node, "each"), ".".join(map(str, path[at:]))
                return (place_in(axes, dotted_key) or place) if has(axes, dotted_key) else place
            place = place_in(node, key) or place
            node = node[key]
        keys = node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
        return next((inner for key in keys if isinstance(inner := place_in(node, key), str)), place)

    def issue(
        self,
        path: Sequence[Key],
        problem: str,
        value: object = None,
        allowed: str | None = None,
        near: str | None = None,
    ) -> ValidationIssue:
        """Create an issue with the position of a key."""
        place = None if self.file is None else self.place(path)
        file, line = (place, None) if isinstance(place, str) else (self.file, place)
        return ValidationIssue(problem, file, line, dotted(path), value, allowed, near)

    def issues(self, error: ValidationError, model: type[BaseModel]) -> list[ValidationIssue]:
        """Convert pydantic's errors to issues of this file."""
        more = error.error_count() - _MOST_LOOKED_AT
        issues = by_line(issue for _, issue in self.faults(error, model))
        return issues + ([ValidationIssue(f"and about {more:,} more errors", self.file)] if more > 0 else [])

    def faults(self, error: ValidationError, model: type[BaseModel]) -> list[tuple[KeyPath, ValidationIssue]]:
        """Convert pydantic's errors to issues with the paths of the keys that were meant."""
        issues: dict[tuple[KeyPath, str], ValidationIssue] = {}
        # A default that follows from other keys is no error of its own where these are wrong.
        items = [item for item in error.errors(include_url=False) if item["type"] != "default_factory_not_called"]
        schema = model.model_json_schema() if any(item["type"] == "extra_forbidden" for item in items) else {}
        meant: dict[KeyPath, KeyPath] = {}
        for item in islice(items, _MOST_LOOKED_AT):
            path = self._path(item["loc"], missing=item["type"] in ("missing", "extra_forbidden"))
            issue = self._issue(path, item, schema)
            issues.setdefault((path, issue.problem), issue)
            if item["type"] == "extra_forbidden" and issue.nearest is not None:
                meant[path] = (*path[:-1], issue.nearest)
        # A misspelled key is one issue, not a second one because the right key is missing; and a fault inside a value
        # is no second one because another form of the value would not fit either.
        above = {path[:end] for path, _ in issues for end in range(len(path))}
        return [
            (path, issue)
            for (path, problem), issue in issues.items()
            if not (problem == "missing" and path in meant.values()) and not (problem == _NOT_ALLOWED and path in above)
        ]

    def _path(self, loc: Sequence[Key], *, missing: bool) -> KeyPath:
        """Return `loc` without the tags that pydantic adds for unions; with its last key if that is `missing`."""
        node: Any = self.data
        path: list[Key] = []
        varied: set[Key] = set()
        for position, part in enumerate(loc):
            key = written(node, part)
            if key != part:
                varied = {part for name in node[key].get("each", ()) for part in str(name).split(".")}
            if has(node, key):
                path.append(key)
                node = node[key]
            elif key in varied or (isinstance(node, dict) and position == len(loc) - 1 and missing):
                path.append(key)
        return tuple(path)

    def _issue(self, path: KeyPath, item: Any, schema: dict[str, Any]) -> ValidationIssue:
        kind, context = item["type"], item.get("ctx", {})
        tag = str(context.get("discriminator")).strip("'")
        if kind == "extra_forbidden" and (instead := _GONE.get(dotted(path))):
            return self.issue(path, "unknown key, one of earlier versions", None, instead)
        if kind == "extra_forbidden":
            known = _known_keys(schema, path[:-1], self.data)
            return self.issue(path, "unknown key", None, ", ".join(known), nearest(path[-1], known))
        if isinstance(fault := context.get("error"), Fault):
            near = nearest(fault.value, fault.known) if fault.known else fault.nearest
            return self.issue((*path, *fault.path), fault.problem, fault.value, fault.allowed, near)
        if kind in ("missing", "value_error", "union_tag_not_found"):
            place = (*path, tag) if kind == "union_tag_not_found" else path
            return self.issue(place, str(context["error"]) if kind == "value_error" else "missing")
        return self.issue(*_of_value(path, item))


def _of_value(path: KeyPath, item: Any) -> tuple[KeyPath, str, object, str | None, str | None]:
    """Return place, problem, value, what is allowed and the nearest name of a value that pydantic refuses."""
    kind, value, context = item["type"], item["input"], item.get("ctx", {})
    if kind == "union_tag_invalid":
        tag, known = str(context["discriminator"]).strip("'"), str(context["expected_tags"]).replace("'", "")
        got = value.get(tag) if isinstance(value, dict) else value
        return (*path, tag), "unknown kind", got, known, nearest(got, known.split(", "))
    if kind == "too_short":
        return path, "too few entries", context["actual_length"], f"{context['min_length']} or more", None
    if kind == "too_long":
        return path, "too many entries", context["actual_length"], f"at most {context['max_length']:,}", None
    shown = "a mapping" if isinstance(value, dict) else "a list" if isinstance(value, list) else value
    if kind == "bool_type" and (meant := _YAML_1_1_BOOLEANS.get(str(value).casefold())):
        return path, f"true or false expected: write {meant}", shown, None, None
    allowed = item["msg"].removeprefix("Input should be ").removeprefix("a valid ")
    allowed = {"boolean": "true or false", "tuple": "list"}.get(allowed, allowed)
    if allowed in ("number", "integer") and isinstance(value, str) and LOOKS_LIKE_A_NUMBER.fullmatch(value):
        allowed += ", without quotes"
    return path, _NOT_ALLOWED, shown, "mapping" if allowed.startswith("dictionary") else allowed, None


def _known_keys(schema: dict[str, Any], path: Sequence[Key], data: Any) -> list[str]:
    """Return the keys that the section at `path` of a JSON Schema knows."""

    def options(part: Any) -> list[dict[str, Any]]:
        """Return a part without references and unions."""
        if not isinstance(part, dict):
            return []
        if "$ref" in part:
            return options(schema["$defs"][part["$ref"].rpartition("/")[2]])
        union = [inner for word in ("anyOf", "oneOf", "allOf") for inner in part.get(word, ())]
        return [option for inner in union for option in options(inner)] or [part]

    parts, node = options(schema), data
    for key in path:
        node = child(node, key)
        inner = []
        for part in parts:
            general = [part.get("items")] if isinstance(key, int) else [part.get("additionalProperties")]
            general += part.get("patternProperties", {}).values()
            inner += [part["properties"][key]] if key in part.get("properties", {}) else general
        parts = [option for part in inner for option in options(part)]
    if isinstance(node, dict):  # an entry alone in the place of a list
        parts += [option for part in parts for option in options(part.get("items"))]
    for keys in (part["properties"] for part in parts if "properties" in part):
        kind = keys.get("kind", {}).get("const")
        if kind is None or not isinstance(node, dict) or node.get("kind", keys["kind"].get("default")) == kind:
            return list(keys)
    return []


def written(node: Any, key: Key) -> Key:
    """Return the key as the file has it: a scenario made by `each` is named after the one that it was made from."""
    if isinstance(node, dict) and isinstance(key, str) and key not in node:
        for name, entry in node.items():
            made = isinstance(entry, dict) and (isinstance(entry.get("each"), dict) or entry.get("cfa") == "tiles")
            if made and key.startswith(f"{name} "):
                return str(name)
    return key


def by_line(issues: Iterable[ValidationIssue]) -> list[ValidationIssue]:
    """Sort issues by line.

    Issues without a line last.
    """
    return sorted(issues, key=lambda issue: (issue.line is None, issue.file or "", issue.line or 0))


def dotted(path: Sequence[Key]) -> str:
    """Format a path of keys: `sweeps.main.grid`, `sensor.files[0].file`."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).removeprefix(".")


def _text(path: Path, most_bytes: int) -> str:
    content = read_input(path, most_bytes, StudyError)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        problem, wide = not_utf8(content, error)
        line = None if wide else content.count(b"\n", 0, error.start) + 1
        raise StudyError(ValidationIssue(problem, str(path), line, allowed=NO_UTF_16 if wide else "UTF-8")) from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise StudyError(ValidationIssue("NUL characters in the text", str(path), line, allowed=NO_UTF_16))
    return text
