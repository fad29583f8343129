"""YAML as plain values that know their lines, and pydantic's errors as one-line issues that name their line.

The tree is built from ruamel.yaml's nodes and only up to limits. The library's constructor builds everything first: a
few hundred bytes of aliases become billions of values.
"""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from io import StringIO
from itertools import islice
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from ..base.disk import NO_UTF_16, not_utf8, read_input
from ..base.errors import MOST_ISSUES, Fault, StudyError, ValidationIssue, nearest

MOST_DEPTH = 20
"""Levels of nesting; a study needs seven."""
_MOST_DIGITS = 100
"""Letters of a number; a float has 17 digits and an exponent."""
_MOST = (500_000, 50_000)
"""Bytes of a study file, and keys and values in it."""
_MOST_RESOLVED = (8_000_000, 400_000)
"""The same of a `*.resolved.yaml`, as a run writes it: with every default, and each of up to 2000 scenarios."""
_MOST_LOOKED_AT = 2 * MOST_ISSUES
"""Errors of the schema that are read; of a value that may have several types there is one for each."""
_PLAIN = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_LOOKS_LIKE_A_NUMBER = re.compile(r"[-+.]*[0-9][-+.0-9xo_a-fA-F]*")
_SURROGATE = re.compile("[\ud800-\udfff]")
"""Half of a character: `\\ud800`. No file takes it."""
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
_YAML_FAULTS: tuple[tuple[str, str, bool], ...] = (
    ("found character '\\t'", "a tab begins a value; allowed: spaces", False),
    ("found '<block mapping start>'", "the line is indented otherwise than the one before it", False),
    ("found '<block sequence start>'", "the line is indented otherwise than the one before it", False),
    (
        "mapping values are not allowed here",
        "a second colon, or the line is indented otherwise than the one before it",
        False,
    ),
    ("could not find expected ':'", "no `key: value`; after a colon comes a space", True),
    ("expected ',' or '}'", "a `{` that begins here is not closed, or a comma is missing", True),
    ("expected ',' or ']'", "a `[` that begins here is not closed, or a comma is missing", True),
)
"""What a part of ruamel's message means, and whether its place is where the part of the text begins."""
_YAML_1_1_BOOLEANS = {"yes": "true", "on": "true", "y": "true", "no": "false", "off": "false", "n": "false"}

Key = str | int
KeyPath = tuple[Key, ...]
"""Keys that lead to a place of the study."""
Place = int | str
"""A line from 1, or the option that a value came from."""


class Keys(dict[Key, Any]):
    """A mapping of a document; `places`: where each of its keys stands."""

    def __init__(self, value: Mapping[Key, Any] = {}, places: Mapping[Key, Place] = {}) -> None:
        super().__init__(value)
        self.places = dict(places)


class Entries(list[Any]):
    """A list of a document; `places`: where each of its entries stands."""

    def __init__(self, value: Iterable[Any] = (), places: Mapping[Key, Place] = {}) -> None:
        super().__init__(value)
        self.places = dict(places)


def put(node: Any, path: Sequence[Key], value: Any, place: Place | None = None) -> Any:
    """Return a mapping or a list with a value at a path, which is made where it is missing.

    What the path leads through is copied, the rest is shared. A key that is `true` has its defaults. Raises Fault at
    what is no mapping, or has no such entry.
    """
    if not path:
        return value
    (key, *rest), places = path, getattr(node, "places", {})
    changed: Any = None
    if isinstance(node, list):
        if not (str(key).isdecimal() and int(key) < len(node)):
            raise Fault((), "has no such entry", key, f"0 to {len(node) - 1}")
        key, changed = int(key), Entries(node, places)
    elif isinstance(node, dict) or node is True:
        changed = Keys({} if node is True else node, places)
    else:
        raise Fault((), "is no mapping", None, "the whole of it")
    is_new = not _has(changed, key)
    try:
        inner = put(Keys() if is_new else changed[key], rest, value, place)
    except Fault as fault:
        raise fault.under(key) from None
    changed[key] = inner
    if place is not None and (is_new or not rest):
        changed.places[key] = place
    return changed


@lru_cache(maxsize=4)
def _composed(text: str) -> Node | None:
    """Return the nodes of a document, once for all members of a study of several."""
    yaml = YAML(typ="safe", pure=True)
    yaml.composer.warn_double_anchors = False
    root: Node | None = yaml.compose(StringIO(text))
    return root


class Tree:
    """The value of a YAML document (YAML 1.2, core schema; `<<` merges mappings), and the line of each of its keys.

    At most `most_values` keys and values, those of an alias counted each time that it stands for them; `option`: it
    stands there instead of in a file. Raises StudyError with file and line: not YAML, beyond the limits, a key twice, a
    tag, a second document.
    """

    def __init__(self, text: str, file: str | None, most_values: int, option: str | None = None) -> None:
        self._file, self._most, self._option, self._count = file, most_values, option, 0
        if version := re.match(r"%YAML\s+(?!1\.2\s)\S*", text):
            raise self._error("another version of YAML", 1, (), version.group(), "%YAML 1.2, or no such line")
        self._resolve = YAML(typ="safe", pure=True).resolver.resolve
        try:
            root = _composed(text)
        except MarkedYAMLError as error:
            said = ", ".join(part for part in (error.context, error.problem) if part)
            words, begins = next((told for part, *told in _YAML_FAULTS if part in said), (said, False))
            mark = (begins and error.context_mark) or error.problem_mark
            raise self._error(f"not valid YAML: {words}", None if mark is None else mark.line + 1) from None
        except ReaderError as error:
            line = text.count("\n", 0, int(error.position)) + 1
            raise self._error(f"not valid YAML: the character {error.character!r}", line) from None
        except RecursionError:
            raise self._error("nested too deep", None, allowed=f"at most {MOST_DEPTH} levels") from None
        except (YAMLError, ValueError) as error:
            raise self._error(f"not valid YAML: {type(error).__name__} {error}", None) from None
        self.root: Any = None if root is None else self._value(root, ())

    def _value(self, node: Node, path: tuple[str, ...], depth: int = 0) -> Any:
        """Return the plain value of a node; `path`: the keys that lead to it."""
        line = self._counted(node, path)
        implicit = (True, False) if getattr(node, "style", None) is None else (False, True)
        if node.tag != str(self._resolve(type(node), node.value, implicit)):
            raise self._error("a tag", line, path, node.tag, "the value without it; quotes make a text of it")
        if isinstance(node, ScalarNode):
            return self._plain(node.value, line, path) if node.style is None else node.value
        if depth >= MOST_DEPTH:
            raise self._error("nested too deep", line, path, allowed=f"at most {MOST_DEPTH} levels")
        if not isinstance(node, SequenceNode):
            return self._mapping(node, path, depth)
        entries = [self._value(entry, path, depth + 1) for entry in node.value]
        lines = [entry.start_mark.line + 1 for entry in node.value]
        return Entries(entries, {i: self._option or line for i, line in enumerate(lines)})

    def _mapping(self, node: Node, path: tuple[str, ...], depth: int) -> Keys:
        value: dict[Key, Any] = {}
        lines: dict[Key, Place] = {}
        merged: list[dict[Key, Any]] = []
        for key_node, inner in node.value:
            line = self._counted(key_node, path)
            key = key_node.value
            if not isinstance(key_node, ScalarNode):
                raise self._error("a key that is no word", line, path, allowed="`key: value`")
            if key in lines:
                raise self._error(f"found duplicate key {key!r}", line, path)
            lines[key] = self._option or line
            converted = self._value(inner, (*path, key), depth + 1)
            if key == "<<" and key_node.style is None:
                sources = converted if isinstance(converted, list) else [converted]
                if not all(isinstance(source, dict) for source in sources):
                    raise self._error("`<<` merges mappings only", line, path)
                merged += sources
            else:
                value[key] = converted
        for source in merged:
            value |= {key: converted for key, converted in source.items() if key not in value}
        return Keys(value, lines)

    def _counted(self, node: Node, path: tuple[str, ...]) -> int:
        """Count a key or a value, check its characters, and return its line."""
        line: int = node.start_mark.line + 1
        self._count += 1
        if self._count > self._most:
            allowed = f"at most {self._most:,} keys and values, those of an alias counted each time"
            raise self._error("more keys and values than a study has", line, path, allowed=allowed)
        if isinstance(node, ScalarNode) and (half := _SURROGATE.search(node.value)):
            raise self._error("not a character of a text", line, path, half.group())
        return line

    def _plain(self, text: str, line: int, path: tuple[str, ...]) -> Any:
        """Return a value without quotes: nothing, a boolean, a number or a text."""
        if len(text) > _MOST_DIGITS:
            if _LOOKS_LIKE_A_NUMBER.fullmatch(text):
                allowed = f"at most {_MOST_DIGITS} letters"
                raise self._error(f"a number of {len(text):,} letters", line, path, text, allowed)
            return text
        if text in _PLAIN:
            return _PLAIN[text]
        if _INTEGER.fullmatch(text):
            return int(text, 0 if text[:2] in ("0o", "0x") else 10)
        if _FLOAT.fullmatch(text):
            # No -0.0: it is the same number, but would give the study another fingerprint.
            return float(text.lower().replace(".inf", "inf").replace(".nan", "nan")) + 0.0
        return text

    def _error(
        self,
        problem: str,
        line: int | None,
        path: Sequence[str] = (),
        value: object = None,
        allowed: str | None = None,
    ) -> StudyError:
        return StudyError(ValidationIssue(problem, self._file, line, ".".join(path) or None, value, allowed))


def yaml_text(data: Mapping[str, Any]) -> str:
    """Format keys with plain values as a YAML document.

    Raises StudyError if a value has no YAML form.
    """
    text = StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    try:
        yaml.dump(data, text)
    except YAMLError as error:
        raise StudyError(ValidationIssue(f"not a value of a study: {' '.join(str(error).split())}")) from None
    return text.getvalue()


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
            if not _has(node, key):
                axes, dotted_key = _child(node, "each"), ".".join(map(str, path[at:]))
                return (_place(axes, dotted_key) or place) if _has(axes, dotted_key) else place
            place = _place(node, key) or place
            node = node[key]
        keys = node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
        return next((inner for key in keys if isinstance(inner := _place(node, key), str)), place)

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
            if _has(node, key):
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
    if allowed in ("number", "integer") and isinstance(value, str) and _LOOKS_LIKE_A_NUMBER.fullmatch(value):
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
        node = _child(node, key)
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


def _place(node: Any, key: Key) -> Place | None:
    """Return where a mapping's key or a list's entry stands; None if the file does not contain it."""
    places: Mapping[Key, Place] = getattr(node, "places", {})
    return places.get(key)


def _has(node: Any, key: Key) -> bool:
    return key in node if isinstance(node, dict) else isinstance(node, list) and key in range(len(node))


def _child(node: Any, key: Key) -> Any:
    return node[key] if _has(node, key) else None


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
