"""YAML as plain values that know their lines, read event by event and only up to limits.

The library's own loaders build everything first: a few hundred bytes of aliases become billions of values.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import StringIO
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)
from ruamel.yaml.reader import ReaderError

from ..base.errors import Fault, StudyError

MOST_DEPTH = 20
"""Levels of nesting; a study needs seven."""
_MOST_DIGITS = 100
"""Letters of a number; a float has 17 digits and an exponent."""
_MERGE = "<<"
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


@dataclass
class _Open:
    """A mapping or a list that is being read. `first` is the number of values that were read before it."""

    value: Any
    lines: Lines
    line: int
    anchor: str | None
    first: int
    key: str | None = None
    merged: list[Any] = field(default_factory=list)


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
        self._open: list[_Open] = []
        self._anchors: dict[str, tuple[Any, int] | None] = {}
        self.root: Any = None
        try:
            for event in _events(text):
                self._take(event)
        except MarkedYAMLError as error:
            line = None if error.problem_mark is None else error.problem_mark.line + 1
            raise self._refused(f"not valid YAML: {error.problem or error.context}", line) from None
        except ReaderError as error:
            line = text.count("\n", 0, int(error.position)) + 1
            raise self._refused(f"not valid YAML: the character {error.character!r}", line) from None
        except (YAMLError, RecursionError, ValueError) as error:
            raise self._refused(f"not valid YAML: {type(error).__name__} {error}", None) from None

    def place(self, node: Any, key: Key) -> Place | None:
        """The place of a key of a mapping or of an entry of a list; None where the file has none."""
        return self._lines[id(node)][1].get(key) if id(node) in self._lines else None

    def put(self, node: Any, key: Key, value: Any, place: Place | None) -> None:
        """Set a key of a mapping or an entry of a list to a value that stands at another place."""
        node[key] = value
        if place is not None:
            self._lines.setdefault(id(node), (node, {}))[1][key] = place

    def _take(self, event: Event) -> None:
        line = event.start_mark.line + 1
        if isinstance(event, DocumentStartEvent):
            self._check_document(event, line)
        elif isinstance(event, AliasEvent):
            self._put(*self._anchored(event.anchor, line), line)
        elif isinstance(event, ScalarEvent):
            self._check_tag(event.tag, line)
            self._scalar(event, line)
        elif isinstance(event, MappingStartEvent | SequenceStartEvent):
            self._check_tag(event.tag, line)
            self._begin({} if isinstance(event, MappingStartEvent) else [], event.anchor, line)
        elif isinstance(event, MappingEndEvent | SequenceEndEvent):
            self._end()

    def _check_document(self, event: DocumentStartEvent, line: int) -> None:
        if self._count:
            raise self._refused("a second document", line, allowed="one study in a file")
        if event.version is not None and tuple(event.version) != (1, 2):
            version = ".".join(map(str, event.version))
            raise self._refused("another version of YAML", line, f"%YAML {version}", "%YAML 1.2, or no such line")

    def _check_tag(self, tag: str | None, line: int) -> None:
        if tag is not None:
            raise self._refused("a tag", line, tag, "the value without it; quotes make a text of it")

    def _scalar(self, event: ScalarEvent, line: int) -> None:
        text = event.value
        half = _HALF.search(text)
        if half:
            raise self._refused("not a character of a text", line, half.group())
        parent = self._open[-1] if self._open else None
        is_key = parent is not None and isinstance(parent.value, dict) and parent.key is None
        plain = bool(event.implicit[0])
        if is_key and plain and text == _MERGE:
            self._count_one(line)
            assert parent is not None
            parent.key = _MERGE
            return
        value = text if is_key or not plain else self._plain(text, line)
        if event.anchor is not None:
            self._anchors[event.anchor] = (value, 1)
        self._put(value, 1, line)

    def _plain(self, text: str, line: int) -> Any:
        """A value without quotes: nothing, a boolean, a number or a text."""
        if len(text) > _MOST_DIGITS:
            if _LOOKS_LIKE_A_NUMBER.fullmatch(text):
                allowed = f"at most {_MOST_DIGITS} letters"
                raise self._refused(f"a number of {len(text):,} letters", line, text, allowed)
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

    def _begin(self, value: Any, anchor: str | None, line: int) -> None:
        if len(self._open) >= MOST_DEPTH:
            raise self._refused("nested too deep", line, allowed=f"at most {MOST_DEPTH} levels")
        if anchor is not None:
            self._anchors[anchor] = None  # not to be used before its end
        self._open.append(_Open(value, {}, line, anchor, self._count))
        self._count_one(line)

    def _end(self) -> None:
        done = self._open.pop()
        for source in done.merged:
            for key, value in source.items():
                done.value.setdefault(key, value)
        self._lines[id(done.value)] = done.value, done.lines
        if done.anchor is not None:
            self._anchors[done.anchor] = (done.value, self._count - done.first)
        self._put(done.value, 0, done.line)

    def _anchored(self, name: str, line: int) -> tuple[Any, int]:
        if name not in self._anchors:
            raise self._refused("an alias of nothing", line, f"*{name}", f"a value marked &{name} above it")
        found = self._anchors[name]
        if found is None:
            raise self._refused("an alias of what it stands in", line, f"*{name}", "a value that ends above it")
        return found

    def _put(self, value: Any, count: int, line: int) -> None:
        """Add a value to what is open; `count` values more have been read with it."""
        self._count_one(line, count)
        if not self._open:
            self.root = value
            return
        parent = self._open[-1]
        if isinstance(parent.value, list):
            parent.lines[len(parent.value)] = line
            parent.value.append(value)
        elif parent.key is None:
            self._put_key(parent, value, line)
        else:
            key, parent.key = parent.key, None
            if key == _MERGE and _MERGE not in parent.lines:
                parent.merged += self._to_merge(value, line)
            else:
                parent.value[key] = value

    def _put_key(self, parent: _Open, value: Any, line: int) -> None:
        key = value if isinstance(value, str) else None
        if key is None:
            raise self._refused("a key that is no word", line, allowed="`key: value`")
        if key in parent.lines:
            raise self._refused(f"found duplicate key {key!r}", line)
        parent.lines[key] = line
        parent.key = key

    def _to_merge(self, value: Any, line: int) -> list[Any]:
        sources = value if isinstance(value, list) else [value]
        if not all(isinstance(source, dict) for source in sources):
            raise self._refused("`<<` merges mappings only", line)
        return sources

    def _count_one(self, line: int, count: int = 1) -> None:
        self._count += count
        if self._count > self._most:
            allowed = f"at most {self._most:,} keys and values, those of an alias counted each time"
            raise self._refused("more keys and values than a study has", line, allowed=allowed)

    def _refused(self, problem: str, line: int | None, value: object = None, allowed: str | None = None) -> StudyError:
        keys = [str(part.key) for part in self._open if part.key is not None]
        return StudyError(Fault(problem, self._file, line, ".".join(keys) or None, value, allowed))


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


def _events(text: str) -> Iterator[Event]:
    yield from YAML(typ="safe", pure=True).parse(StringIO(text))
