"""YAML as plain values that know their lines; one of them is put in by a copy of what leads to it.

The tree is built from ruamel.yaml's nodes and only up to limits. The library's constructor builds everything first: a
few hundred bytes of aliases become billions of values.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from io import StringIO
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from ..base.errors import Fault, StudyError, ValidationIssue

MOST_DEPTH = 20
"""Levels of nesting; a study needs seven."""
_MOST_DIGITS = 100
"""Letters of a number; a float has 17 digits and an exponent."""
_PLAIN = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
LOOKS_LIKE_A_NUMBER = re.compile(r"[-+.]*[0-9][-+.0-9xo_a-fA-F]*")
_SURROGATE = re.compile("[\ud800-\udfff]")
"""Half of a character: `\\ud800`. No file takes it."""
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
    is_new = not has(changed, key)
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
            if LOOKS_LIKE_A_NUMBER.fullmatch(text):
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


def place_in(node: Any, key: Key) -> Place | None:
    """Return where a mapping's key or a list's entry stands; None if the file does not contain it."""
    places: Mapping[Key, Place] = getattr(node, "places", {})
    return places.get(key)


def has(node: Any, key: Key) -> bool:
    return key in node if isinstance(node, dict) else isinstance(node, list) and key in range(len(node))


def child(node: Any, key: Key) -> Any:
    return node[key] if has(node, key) else None
