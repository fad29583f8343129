"""Folder of a run, beside that of another study of the same name."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any

from ..base.disk import is_folder
from ..base.errors import OutputError, ValidationIssue
from .manifest import Manifest

_MOST_SHOWN = 3


def run_folder(given: Path | str | os.PathLike[str]) -> Path:
    """Return the folder of a run, which may be given by the name of its study in `outputs`."""
    folder = Path(given)
    named = Path("outputs") / folder
    return named if not is_folder(folder) and len(folder.parts) == 1 and run_in(named) is not None else folder


def run_in(folder: Path) -> Manifest | None:
    """Return the run in a folder; files of others under the names of a run's have an empty fingerprint."""
    manifest = Manifest(folder)
    return manifest if manifest.fingerprint or manifest.damaged or manifest.foreign_files() else None


def output_folder(base: Path, facts: Mapping[str, Any]) -> tuple[Path, str | None]:
    """Return the folder of a run: `base`, or `base-2` and so on if that holds another run or files of others."""
    note = None
    for number in count(1):
        folder = base if number == 1 else base.with_name(f"{base.name}-{number}")
        held = run_in(folder)
        if held is None or held.is_of(facts):
            return folder, None if note is None else f"{note}; this one is in {folder}"
        if held.damaged:
            held.require_run()  # or it may be this one
        if held.fingerprint:
            note = f"{folder} holds another study of this name ({_changed(held, facts)})"
        else:
            note = f"{folder / held.foreign_files()[0]} is not of a run of this study"
    raise AssertionError


def begin(folder: Path, facts: Mapping[str, Any]) -> Manifest:
    """Write into the folder which run it holds, and return its files.

    Raises OutputError if it holds another run, or files of others.
    """
    manifest = Manifest(folder)
    if manifest.damaged:
        manifest.require_run()
    if manifest.fingerprint and not manifest.is_of(facts):
        problem = f"holds another study ({_changed(manifest, facts)})"
        raise OutputError(ValidationIssue(problem, str(folder), allowed="another folder"))
    if manifest.damaged or not manifest.fingerprint:
        manifest.begin(facts)
    return manifest


def _changed(held: Manifest, facts: Mapping[str, Any]) -> str:
    """Return the first few keys that differ, with their values."""
    if ("runs" in held.facts) != ("runs" in facts):
        return f"of {'several sensors' if 'runs' in held.facts else 'one sensor'}"
    before, after = (dict(_flat(x)) for x in (held.facts.get("identity"), json.loads(json.dumps(facts["identity"]))))
    keys = [key for key in {**before, **after} if before.get(key) != after.get(key)]
    if not keys or not before.keys() & after.keys():
        return "of another version of this package"
    shown = [f"{_short(key)}: {_short(before.get(key))} -> {_short(after.get(key))}" for key in keys[:_MOST_SHOWN]]
    more = f", {len(keys) - _MOST_SHOWN} more" if len(keys) > _MOST_SHOWN else ""
    return "changed " + ", ".join(shown) + more


def _flat(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(inner, f"{path}.{key}" if path else str(key))
    else:
        yield path, value


def _short(value: object) -> str:
    text = str(value).removeprefix("study.")
    return text if len(text) <= 40 else text[:37] + "..."
