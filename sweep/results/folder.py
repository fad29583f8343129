"""Folder of a run, beside that of another study of the same name."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

from ..base.errors import OutputError, ValidationIssue
from ..study import Study
from .identity import fingerprint, identity
from .inventory import Inventory

_MOST_SHOWN = 3


def run_in(folder: Path) -> Inventory | None:
    """Return the run in a folder.

    Parameters
    ----------
    folder : Path
        Output folder.

    Returns
    -------
    Inventory or None
        Run; files of others under the names of a run's have an empty fingerprint.

    Raises
    ------
    OutputError
        If `run.json` is damaged.
    """
    inventory = Inventory(folder)
    return inventory if inventory.fingerprint or inventory.foreign_files() else None


def output_folder(base: Path, study: Study) -> tuple[Path, str | None]:
    """Return the folder of a study's run.

    Parameters
    ----------
    base : Path
        Preferred folder.
    study : Study
        Study.

    Returns
    -------
    folder : Path
        `base`, or `base-2` and so on if it holds another study.
    note : str or None
        Difference to that study.
    """
    note = None
    for number in count(1):
        folder = base if number == 1 else base.with_name(f"{base.name}-{number}")
        held = run_in(folder)
        if held is None or held.fingerprint == fingerprint(study):
            return folder, None if note is None else f"{note}; this one is in {folder}"
        if held.fingerprint:
            note = f"{folder} holds another study of this name ({_changed(held, study)})"
        else:
            note = f"{folder / held.foreign_files()[0]} is not of a run of this study"
    raise AssertionError


def begin(folder: Path, study: Study) -> Inventory:
    """Write into the folder which run it holds.

    Parameters
    ----------
    folder : Path
        Output folder.
    study : Study
        Study.

    Returns
    -------
    Inventory
        Files of the run.

    Raises
    ------
    OutputError
        If it holds another run, or files of others.
    """
    inventory = Inventory(folder)
    if not inventory.fingerprint:
        inventory.begin(fingerprint(study), {"identity": identity(study), "designs": study.n_designs})
    elif inventory.fingerprint != fingerprint(study):
        problem = f"holds another study ({_changed(inventory, study)})"
        raise OutputError(ValidationIssue(problem, str(folder), allowed="another folder"))
    return inventory


def _changed(held: Inventory, study: Study) -> str:
    """Return the first few keys that differ, with their values."""
    before, after = (dict(_flat(x)) for x in (held.facts.get("identity"), json.loads(json.dumps(identity(study)))))
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
