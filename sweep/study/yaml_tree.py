"""YAML as plain values that know their lines, built only up to limits.

The library's own constructor builds everything first: a few hundred bytes of aliases become billions of values.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from io import StringIO
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from ..base.errors import Fault, StudyError

MOST_DEPTH = 20
"""Levels of nesting; a study needs seven."""
_MOST_DIGITS = 100
"""Letters of a number; a float has 17 digits and an exponent."""
_MERGE = "<<"
_VERSION = re.compile(r"%YAML\s+(?!1\.2\s)\S*")
_NULL = ("", "~", "null", "Null", "NULL")
_BOOLEANS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_BASES = {"0o": 8, "0x": 16}
_LOOKS_LIKE_A_NUMBER = re.compile(r"[-+.]*[0-9][-+.0-9xo_a-fA-F]*")
_HALF = re.compile("[\ud800-\udfff]")
"""Half of a character: `\\ud800`. No file takes it."""

Key = str | int
Place = int | str
"""A line from 1, or the option that a value came from."""
Lines = dict[Key, Place]


class Tree:
    """The value of a YAML document (YAML 1.2, core schema; `<<` merges mappings), and the line of each of its keys.

    At most `most_values` keys and values, those of an alias counted each time that it stands for them. Raises
    StudyError with file and line: not YAML, beyond the limits, a key twice, a tag, a second document.
    """

    def __init__(self, text: str, file: str | None, most_values: int) -> None:
        self._file = file
        self._most = most_values
        self._count = 0
        self._lines: dict[int, tuple[Any, Lines]] = {}  # with what the id is of, so that no other value has it
        if version := _VERSION.match(text):
            raise self._refused("another version of YAML", 1, (), version.group(), "%YAML 1.2, or no such line")
        yaml = YAML(typ="safe", pure=True)
        yaml.composer.warn_double_anchors = False
        self._resolve = yaml.resolver.resolve
        try:
            root = yaml.compose(StringIO(text))
        except MarkedYAMLError as error:
            line = None if error.problem_mark is None else error.problem_mark.line + 1
            problem = ", ".join(part for part in (error.context, error.problem) if part)
            raise self._refused(f"not valid YAML: {problem}", line) from None
        except ReaderError as error:
            line = text.count("\n", 0, int(error.position)) + 1
            raise self._refused(f"not valid YAML: the character {error.character!r}", line) from None
        except RecursionError:
            raise self._refused("nested too deep", None, allowed=f"at most {MOST_DEPTH} levels") from None
        except (YAMLError, ValueError) as error:
            raise self._refused(f"not valid YAML: {type(error).__name__} {error}", None) from None
        self.root: Any = None if root is None else self._value(root, ())

    def place(self, node: Any, key: Key) -> Place | None:
        """The place of a key of a mapping or of an entry of a list; None where the file has none."""
        return self._lines[id(node)][1].get(key) if id(node) in self._lines else None

    def put(self, node: Any, key: Key, value: Any, place: Place | None) -> None:
        """Set a key of a mapping or an entry of a list to a value that stands at another place."""
        node[key] = value
        if place is not None:
            self._lines.setdefault(id(node), (node, {}))[1][key] = place

    def _value(self, node: Node, path: tuple[str, ...], depth: int = 0) -> Any:
        """The plain value of a node; `path`: the keys that lead to it."""
        line = self._counted(node, path)
        implicit = (True, False) if getattr(node, "style", None) is None else (False, True)
        if node.tag != str(self._resolve(type(node), node.value, implicit)):
            raise self._refused("a tag", line, path, node.tag, "the value without it; quotes make a text of it")
        if isinstance(node, ScalarNode):
            half = _HALF.search(node.value)
            if half:
                raise self._refused("not a character of a text", line, path, half.group())
            return self._plain(node.value, line, path) if node.style is None else node.value
        if depth >= MOST_DEPTH:
            raise self._refused("nested too deep", line, path, allowed=f"at most {MOST_DEPTH} levels")
        if isinstance(node, SequenceNode):
            entries = [self._value(entry, path, depth + 1) for entry in node.value]
            places: Lines = {index: entry.start_mark.line + 1 for index, entry in enumerate(node.value)}
            self._lines[id(entries)] = entries, places
            return entries
        assert isinstance(node, MappingNode)
        return self._mapping(node, path, depth)

    def _mapping(self, node: MappingNode, path: tuple[str, ...], depth: int) -> dict[Key, Any]:
        value: dict[Key, Any] = {}
        lines: Lines = {}
        merged: list[dict[Key, Any]] = []
        for key_node, inner in node.value:
            line = self._counted(key_node, path)
            key = key_node.value
            if not isinstance(key_node, ScalarNode):
                raise self._refused("a key that is no word", line, path, allowed="`key: value`")
            if half := _HALF.search(key):
                raise self._refused("not a character of a text", line, path, half.group())
            if key in lines:
                raise self._refused(f"found duplicate key {key!r}", line, path)
            lines[key] = line
            made = self._value(inner, (*path, key), depth + 1)
            if key == _MERGE and key_node.style is None:
                sources = made if isinstance(made, list) else [made]
                if not all(isinstance(source, dict) for source in sources):
                    raise self._refused("`<<` merges mappings only", line, path)
                merged += sources
            else:
                value[key] = made
        for source in merged:
            for key, made in source.items():
                value.setdefault(key, made)
        self._lines[id(value)] = value, lines
        return value

    def _counted(self, node: Node, path: tuple[str, ...]) -> int:
        """Count a key or a value, and return its line."""
        line: int = node.start_mark.line + 1
        self._count += 1
        if self._count > self._most:
            allowed = f"at most {self._most:,} keys and values, those of an alias counted each time"
            raise self._refused("more keys and values than a study has", line, path, allowed=allowed)
        return line

    def _plain(self, text: str, line: int, path: tuple[str, ...]) -> Any:
        """A value without quotes: nothing, a boolean, a number or a text."""
        if len(text) > _MOST_DIGITS:
            if _LOOKS_LIKE_A_NUMBER.fullmatch(text):
                allowed = f"at most {_MOST_DIGITS} letters"
                raise self._refused(f"a number of {len(text):,} letters", line, path, text, allowed)
            return text
        if text in _NULL:
            return None
        if text in _BOOLEANS:
            return _BOOLEANS[text]
        if _INTEGER.fullmatch(text):
            return int(text[2:], _BASES[text[:2]]) if text[:2] in _BASES else int(text)
        if _FLOAT.fullmatch(text):
            number = text.lower().replace(".inf", "inf").replace(".nan", "nan")
            return float(number) + 0.0  # no -0.0: it is the same number, but would give the study another fingerprint
        return text

    def _refused(
        self,
        problem: str,
        line: int | None,
        path: tuple[str, ...] = (),
        value: object = None,
        allowed: str | None = None,
    ) -> StudyError:
        return StudyError(Fault(problem, self._file, line, ".".join(path) or None, value, allowed))


def yaml_text(data: Mapping[str, Any]) -> str:
    """Keys with plain values as a YAML document; raises StudyError for a value that no study file can hold."""
    text = StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    try:
        yaml.dump(data, text)
    except YAMLError as error:
        raise StudyError(Fault(f"not a value of a study: {' '.join(str(error).split())}")) from None
    return text.getvalue()
