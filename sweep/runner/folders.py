"""Which folder a run works in: its own, beside that of another study of the same name."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from ..errors import Fault, OutputError
from ..journal import LOCK
from ..store import CURVES, POINTS, PROVENANCE, PROVENANCE_KEYS, RESOLVED, RESULTS, has_footer, write_json
from ..study import Study
from .provenance import fingerprint, identity

RUN = "run.json"
_MOST_SHOWN = 3


@dataclass(frozen=True)
class Held:
    """The run that a folder holds: its fingerprint, its identity, whether it is finished."""

    fingerprint: str
    identity: Mapping[str, Any]
    finished: bool

    def is_of(self, study: Study) -> bool:
        """Whether it is the run of this very study."""
        return self.fingerprint == fingerprint(study)


def held_by(folder: Path) -> Held | None:
    """The run in a folder, or None; a folder with results of unknown origin has an empty fingerprint.

    A run is finished when all that its report needs is there; where something was deleted or cut, the same command
    makes it again.
    """
    run = read_facts(folder / RUN)
    finished = read_facts(folder / PROVENANCE)
    if not run and not finished and not os.path.lexists(folder / RESULTS):
        return None
    mine = str(run.get("fingerprint", finished.get("fingerprint", "")))
    whole = finished.get("fingerprint") == mine and finished.keys() >= set(PROVENANCE_KEYS)
    whole = whole and (folder / RESOLVED).is_file()
    whole = whole and all(has_footer(folder / name) for name in (RESULTS, CURVES, POINTS))
    return Held(mine, run.get("identity", {}), whole)


def output_folder(base: Path, study: Study) -> tuple[Path, str | None]:
    """`base`, or, where that holds another study, `base-2` and so on; and in that case what is different, in words."""
    note = None
    for number in count(1):
        folder = base if number == 1 else base.with_name(f"{base.name}-{number}")
        held = held_by(folder)
        if held is None or held.is_of(study):
            return folder, None if note is None else f"{note}; this one is in {folder}"
        note = f"{folder} holds another study of this name ({_changed(held.identity, identity(study))})"
    raise AssertionError


def discard(folder: Path) -> None:
    """Leave nothing of a run that has no result, unless the folder holds other files."""
    for name in (RUN, LOCK):
        (folder / name).unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        folder.rmdir()


def begin(folder: Path, study: Study, facts: Mapping[str, Any]) -> None:
    """Say in the folder which run it holds; raises OutputError when it holds another one."""
    held = held_by(folder)
    if held is not None and not held.is_of(study):
        problem = f"holds another study ({_changed(held.identity, identity(study))})"
        raise OutputError(Fault(problem, str(folder), allowed="another folder"))
    write_json({"fingerprint": fingerprint(study), "identity": identity(study)} | dict(facts), folder / RUN)


def _changed(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """The keys that differ with their values, the first few."""
    if not old:
        return "of an earlier version"
    before, after = (dict(_flat(value)) for value in (json.loads(json.dumps(old)), json.loads(json.dumps(new))))
    keys = [key for key in {**before, **after} if before.get(key) != after.get(key)]
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


def read_facts(path: Path) -> dict[str, Any]:
    """A JSON mapping; an empty one where there is none that can be read."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
