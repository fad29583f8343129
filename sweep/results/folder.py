"""Which folder a run works in: its own, beside that of another study of the same name."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from ..base.errors import Fault, OutputError
from ..study import Study
from .identity import fingerprint, identity
from .inventory import Inventory
from .names import MADE_BY_RUN
from .tables import PROVENANCE

_MOST_SHOWN = 3


@dataclass(frozen=True)
class Held:
    """The run that a folder holds: its fingerprint, its identity, whether it is finished.

    `stranger`: a file of others under the name of one of a run's.
    """

    fingerprint: str
    identity: Mapping[str, Any]
    finished: bool
    stranger: str | None

    def is_of(self, study: Study) -> bool:
        """Whether it is the run of this very study."""
        return self.fingerprint == fingerprint(study)


def held_by(folder: Path) -> Held | None:
    """The run in a folder, or None; files of others under the names of a run's have an empty fingerprint.

    A run is finished when all files that its list names are there. Raises OutputError for a damaged `run.json`.
    """
    inventory = Inventory(folder)
    strangers = inventory.strangers()
    if not inventory.fingerprint and not strangers:
        return None
    known = inventory.facts.get("identity")
    listed = inventory.files.keys() & MADE_BY_RUN
    whole = PROVENANCE in listed and not inventory.wrong(listed, quick=True)
    return Held(inventory.fingerprint, known if isinstance(known, dict) else {}, whole, next(iter(strangers), None))


def output_folder(base: Path, study: Study) -> tuple[Path, str | None]:
    """`base`, or, where that holds another study, `base-2` and so on; and in that case what is different, in words."""
    note = None
    for number in count(1):
        folder = base if number == 1 else base.with_name(f"{base.name}-{number}")
        held = held_by(folder)
        if held is None or held.is_of(study):
            return folder, None if note is None else f"{note}; this one is in {folder}"
        if held.fingerprint or held.identity:
            note = f"{folder} holds another study of this name ({_changed(held.identity, identity(study))})"
        else:
            note = f"{folder / held.stranger if held.stranger else folder} is not of a run of this study"
    raise AssertionError


def begin(folder: Path, study: Study) -> Inventory:
    """Say in the folder which run it holds; raises OutputError when it holds another one, or files of others."""
    held = held_by(folder)
    if held is not None and held.fingerprint and not held.is_of(study):
        problem = f"holds another study ({_changed(held.identity, identity(study))})"
        raise OutputError(Fault(problem, str(folder), allowed="another folder"))
    inventory = Inventory(folder)
    if not inventory.facts:
        inventory.begin(fingerprint(study), {"identity": identity(study), "designs": study.n_designs})
    return inventory


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
