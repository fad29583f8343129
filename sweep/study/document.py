"""YAML with line numbers, and pydantic's errors as one-line faults that name their line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from ..base.disk import NO_UTF_16, not_utf8, read_input
from ..base.errors import MOST_FAULTS, Fault, StudyError, nearest
from .yaml_tree import Key, Place, Tree, yaml_text

_MOST = (500_000, 50_000)
"""Bytes of a study file, and keys and values in it."""
_RESOLVED = ".resolved.yaml"
_MOST_RESOLVED = (8_000_000, 400_000)
"""Limits of a file of that name, as a run writes it: with every default, and each of up to 2000 scenarios."""
_MEANT = {"yes": "true", "on": "true", "y": "true", "no": "false", "off": "false", "n": "false"}
"""Booleans of YAML 1.1, which are texts in YAML 1.2."""
_MOST_LOOKED_AT = 2 * MOST_FAULTS
"""Most faults of the schema that are looked at; of a value that may have several types there is one for each."""


class Document:
    """A parsed YAML file that knows the line of each of its keys. `data`: its keys with plain values.

    `source`: the file, or the keys themselves, which then have no file and no lines.
    """

    def __init__(self, source: Path | Mapping[str, Any]) -> None:
        self.file = str(source) if isinstance(source, Path) else None
        resolved = isinstance(source, Path) and source.name.endswith(_RESOLVED)
        most_bytes, most_values = _MOST_RESOLVED if resolved else _MOST
        text = _text(source, most_bytes) if isinstance(source, Path) else yaml_text(source)
        self._tree = Tree(text, self.file, most_values)
        if not isinstance(self._tree.root, dict):
            allowed = "`study: name` and further keys"
            raise StudyError(Fault("a study file is a mapping of keys", self.file, 1, allowed=allowed))
        self.data: dict[str, Any] = self._tree.root

    def change(self, key: str, text: str) -> None:
        """Set a dotted key to a value written as in a study file. Raises StudyError where it cannot stand there."""
        said = f"--set {key}={text}"
        try:
            value = Tree(f"value: {text}", None, _MOST[1]).root["value"]
        except StudyError as error:
            raise StudyError([replace(fault, file=said, line=None, key=None) for fault in error.faults]) from None
        *path, last = key.split(".")
        node: Any = self.data
        for at, part in enumerate(path):
            if isinstance(node, list) and part.isdecimal() and int(part) < len(node):
                node = node[int(part)]
            elif isinstance(node, dict):
                if part not in node:
                    self._tree.put(node, part, {}, said)
                node = node[part]
            else:
                node = None
            if not isinstance(node, dict | list):
                where = ".".join(path[: at + 1])
                raise StudyError(Fault(f"`{where}` is no mapping in {self.file}", said, allowed="the whole of it"))
        if isinstance(node, list):
            if not last.isdecimal() or int(last) >= len(node):
                raise StudyError(Fault("no such entry of the list", said, value=last, allowed=f"0 to {len(node) - 1}"))
            self._tree.put(node, int(last), value, said)
        else:
            self._tree.put(node, last, value, said)

    def rename(self, path: Sequence[Key], name: str | None) -> None:
        """Give a key the name that was meant; without one, or where that is taken, drop the key."""
        *parents, key = path
        node: Any = self.data
        for part in parents:
            node = _child(node, part)
        if _has(node, key):
            value = node.pop(key)
            if name is not None and name not in node:
                self._tree.put(node, name, value, self._tree.place(node, key))

    def place(self, path: Sequence[Key]) -> Place:
        """Place of the deepest key of `path` that there is; of a section, an option that changed a key of it."""
        node: Any = self.data
        place: Place = 1
        for part in path:
            key = _written(node, part)
            if isinstance(node, list) and isinstance(part, str) and part in node:
                key = node.index(part)  # a list of names, which is read as a mapping
            if not _has(node, key):
                return place
            place = self._tree.place(node, key) or place
            node = _child(node, key)
        keys = node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
        return next((inner for key in keys if isinstance(inner := self._tree.place(node, key), str)), place)

    def fault(
        self,
        path: Sequence[Key],
        problem: str,
        value: object = None,
        allowed: str | None = None,
        near: str | None = None,
    ) -> Fault:
        """A fault at `path` of this file."""
        place = None if self.file is None else self.place(path)
        file, line = (place, None) if isinstance(place, str) else (self.file, place)
        return Fault(problem, file, line, dotted(path), value, allowed, near)

    def faults(self, error: ValidationError, model: type[BaseModel]) -> list[tuple[tuple[Key, ...], Fault]]:
        """Pydantic's errors as faults of this file, with their paths."""
        made: dict[tuple[tuple[Key, ...], str], Fault] = {}
        meant = set()
        items = error.errors(include_url=False)
        for item in islice(items, _MOST_LOOKED_AT):
            path = self._known_path(item["loc"])
            fault = self._fault(path, item, model)
            made.setdefault((path, fault.problem), fault)
            if item["type"] == "extra_forbidden":
                meant.add((*path[:-1], fault.nearest))
        # A misspelled key is one fault, not a second one because the right key is missing.
        kept = [(path, fault) for (path, problem), fault in made.items() if problem != "missing" or path not in meant]
        more = len(items) - _MOST_LOOKED_AT
        return [*kept, ((), Fault(f"and about {more:,} more faults", self.file))] if more > 0 else kept

    def _known_path(self, loc: Sequence[Key]) -> tuple[Key, ...]:
        """`loc` without the tags that pydantic adds for unions, and with a missing last key kept."""
        node: Any = self.data
        path: list[Key] = []
        varied: set[Key] = set()
        for position, made in enumerate(loc):
            key = _written(node, made)
            if key != made:
                varied = {part for name in node[key]["each"] for part in str(name).split(".")}
            if _has(node, key):
                path.append(key)
                node = _child(node, key)
            elif key in varied or (isinstance(node, dict) and position == len(loc) - 1):
                path.append(key)
        return tuple(path)

    def _fault(self, path: tuple[Key, ...], item: Any, model: type[BaseModel]) -> Fault:
        kind, value = item["type"], item["input"]
        if kind == "extra_forbidden":
            known = field_names(model, path[:-1], self.data)
            return self.fault(path, "unknown key", None, ", ".join(known), nearest(path[-1], known))
        if kind == "missing":
            return self.fault(path, "missing")
        if kind == "value_error":
            return self.fault(path, str(item["ctx"]["error"]))
        if kind == "union_tag_not_found":
            return self.fault((*path, str(item["ctx"]["discriminator"]).strip("'")), "missing")
        if kind == "union_tag_invalid":
            tag = str(item["ctx"]["discriminator"]).strip("'")
            expected = item["ctx"].get("expected_tags", "")
            got = value.get(tag) if isinstance(value, dict) else value
            return self.fault((*path, tag), "unknown kind", got, expected)
        shown = value if not isinstance(value, dict | list) else type(value).__name__
        meant = _MEANT.get(str(value).casefold()) if kind == "bool_type" else None
        problem = "not allowed" if meant is None else f"true or false expected: write {meant}"
        return self.fault(path, problem, shown, _readable(item["msg"]) if meant is None else None)


def field_names(model: type[BaseModel], path: Sequence[Key], data: Any) -> list[str]:
    """Keys that the section at `path` of a model knows; the section is found by its declared types."""
    annotation: Any = model
    node = data
    for key in path:
        node = _child(node, key)
        choices = [option for option in _options(annotation) if _accepts(option, key)]
        annotation = _inner(choices[0], key) if choices else None
    alone = [
        inner for option in _options(annotation) if get_origin(option) is list for inner in _options(_inner(option, 0))
    ]
    for option in (*_options(annotation), *(alone if isinstance(node, dict) else ())):
        if isinstance(option, type) and issubclass(option, BaseModel):
            kinds = option.model_fields.get("kind")
            if kinds is None or not isinstance(node, dict) or node.get("kind", kinds.default) == kinds.default:
                return [
                    str(key) for key, name in _keys(option).items() if option.model_fields[name].exclude is not True
                ]
    return []


def _has(node: Any, key: Key) -> bool:
    return key in node if isinstance(node, dict) else isinstance(node, list) and key in range(len(node))


def _written(node: Any, key: Key) -> Key:
    """The key as the file has it: a scenario made by `each` is named after the one that it was made from."""
    if isinstance(node, dict) and isinstance(key, str) and key not in node:
        for name, entry in node.items():
            if isinstance(entry, dict) and isinstance(entry.get("each"), dict) and key.startswith(f"{name} "):
                return str(name)
    return key


def _child(node: Any, key: Key) -> Any:
    return node[key] if _has(node, key) else None


def _options(annotation: Any) -> list[Any]:
    origin = get_origin(annotation)
    if origin in (Union, UnionType):
        return [inner for option in get_args(annotation) for inner in _options(option)]
    return [] if annotation in (None, type(None)) else [_unannotated(annotation)]


def _accepts(annotation: Any, key: Key) -> bool:
    if get_origin(annotation) is dict:
        return True
    if get_origin(annotation) is list:
        return isinstance(key, int)
    return isinstance(annotation, type) and issubclass(annotation, BaseModel) and key in _keys(annotation)


def _inner(annotation: Any, key: Key) -> Any:
    if get_origin(annotation) is dict:
        return _unannotated(get_args(annotation)[1])
    if get_origin(annotation) is list:
        return _unannotated(get_args(annotation)[0])
    return annotation.model_fields[_keys(annotation)[str(key)]].annotation


def _keys(section: type[BaseModel]) -> dict[Key, str]:
    """Keys as files have them -> names of the section's fields."""
    return {info.alias or name: name for name, info in section.model_fields.items()}


def _unannotated(annotation: Any) -> Any:
    return get_args(annotation)[0] if hasattr(annotation, "__metadata__") else annotation


def dotted(path: Sequence[Key]) -> str:
    """A path as people write it: `sweeps.main.grid`, `sensor.files[0].file`."""
    text = ""
    for key in path:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else str(key)
    return text


def _readable(message: str) -> str:
    plain = message.removeprefix("Input should be ").removeprefix("a valid ")
    return "mapping" if plain.startswith("dictionary") else "true or false" if plain == "boolean" else plain


def _text(path: Path, most_bytes: int) -> str:
    content = read_input(path, most_bytes, StudyError)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        problem, wide = not_utf8(content, error)
        line = None if wide else content.count(b"\n", 0, error.start) + 1
        raise StudyError(Fault(problem, str(path), line, allowed=NO_UTF_16 if wide else "UTF-8")) from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise StudyError(Fault("NUL characters in the text", str(path), line, allowed=NO_UTF_16))
    return text
