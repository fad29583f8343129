"""What is left of a study beside its faulty keys, so that all other faults are found at the same try."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy, deepcopy
from typing import Any

from pydantic import ValidationError

from ..base.errors import Fault
from .document import Document, written
from .schema import StudySection
from .tree import Key, KeyPath

_INSTEAD = {"study": "study", "sensor": "ar0820", "lights": "tl16", "cfas": ["RGGB"]}
"""What stands for a key that must be there and is faulty; nothing that depends on it is looked at."""
_MOST_TRIES = 4
_SPACES = ("designs", "sweeps", "boxes")
_CURVES = ("wavelengths", "sensor", "sensors", "colorants")
_QUANTITIES = (
    "lights",
    "recognition.states",
    "production",
    "population",
    "uncertainty",
    "pixel.captures",
    "scenarios.*.target",
    "scenarios.*.drive",
    "metrics",
    "tasks",
    "vision",
    "sweeps.*.family",
    "boxes.*.family",
    "search.algorithm",
    "search.space",
    "search.front",
)
"""Keys that say which quantities a study has."""
_ONLY = {
    "production": ("worst_",),
    "population": ("worst_", "yield_"),
    "uncertainty": ("yield_",),
    "scenarios.*.target": ("best_phase_",),
}
"""Keys that only some quantities depend on, with how the names of these begin."""
_WAITS: Mapping[str, Sequence[str]] = {
    "wavelengths": ("sensor", "sensors", "lights"),
    "sensor": (),
    "sensor.files": ("wavelengths",),
    "lights": (),
    "lights.files": ("wavelengths",),
    "colorants": ("wavelengths",),
    **dict.fromkeys(_SPACES, (*_CURVES, "cfas")),
    **dict.fromkeys((f"{space}.*.cfa" for space in _SPACES), ("cfas",)),
    "cfas": (*_CURVES, *(f"{space}.*.{key}" for space in _SPACES for key in ("cfa", "channel"))),
    "scenarios": ("pixel", "camera", "lights", "wavelengths"),
    "scenarios.*.noise": (),
    "search": (*_CURVES, *_SPACES, "cfas", "scenarios", "objective"),
    "search.algorithm": (),
    "search.space": ("sweeps.*", "boxes.*", "cfas"),
    "search.scenario": ("scenarios.*", "sweeps.*", "boxes.*"),
    "uncertainty": (*_CURVES, "population", "scenarios"),
    "recognition": ("lights",),
    "metrics": ("lights",),
    "clouds": ("cfas",),
    "objective": _QUANTITIES,
    "constraints": _QUANTITIES,
}
"""Key -> those whose faults its checks wait for; a key that does not stand here waits for all.

`*` stands for any name; of such a key no fault of an inner one counts.
"""


class Partial:
    """A study beside its faulty keys: `section` without them, None where too little is left, and their `issues`."""

    def __init__(self, document: Document, error: ValidationError) -> None:
        self.issues = document.issues(error, StudySection)
        faults = document.faults(error, StudySection)
        self._document, self._data = document, document.data
        self._faulty = [path for path, _ in faults]
        self._faulty += [(*path[:-1], issue.nearest) for path, issue in faults if issue.nearest and path]
        self.section = self._without_faulty()

    def _without_faulty(self) -> StudySection | None:
        data, paths = deepcopy(self._data), list(self._faulty)
        for _ in range(_MOST_TRIES):
            if () in paths:
                return None
            for path in paths:
                _drop(data, path)
            document = copy(self._document)
            document.data = _INSTEAD | data
            try:
                return StudySection.model_validate(document.data)
            except ValidationError as error:
                found = [path for path, _ in document.faults(error, StudySection)]
                paths = [path[:-1] if path in paths or len(path) > 1 else path for path in found]
                self._faulty += paths
        return None

    def waits(self, fault: Fault) -> bool:
        """Return whether a fault may follow from faulty keys, so that its check has to wait for them."""
        path = (
            *fault.path[:1],
            *(written(self._data.get(str(fault.path[0])), key) for key in fault.path[1:2]),
            *fault.path[2:],
        )
        names = [".".join("*" if at == 1 else str(key) for at, key in enumerate(path[:end])) for end in (3, 2, 1)]
        names.insert(1, ".".join(map(str, path[:2])))
        needed = next((_WAITS[name] for name in names if name in _WAITS), None)
        if needed is _QUANTITIES:
            said = f"{path[-1]} {fault.value} {fault.problem}"
            needed = [key for key in needed if key not in _ONLY or any(begin in said for begin in _ONLY[key])]
        return any(self._hides(faulty, path, needed) for faulty in self._faulty)

    def _hides(self, faulty: KeyPath, path: Sequence[Key], needed: Sequence[str] | None) -> bool:
        both = min(len(faulty), len(path))
        if faulty[:both] == tuple(path[:both]):
            return True
        if path[0] == faulty[0]:
            return path[0] in ("cfas", *_SPACES) and path[2:] != ("cfa",) and both > 1 and faulty[1] == path[1]
        if faulty[0] == "cfas" and len(faulty) > 1 and path[0] in _SPACES:
            return bool(self._cfa_of(path) == faulty[1])
        return needed is None or any(_depends(key.split("."), faulty) for key in needed)

    def _cfa_of(self, path: Sequence[Key]) -> Any:
        try:
            return self._data[str(path[0])][path[1]]["cfa"]
        except (LookupError, TypeError):
            return None


def _depends(key: Sequence[str], faulty: KeyPath) -> bool:
    """Return whether a key with `*` for any name is at or above a faulty path, or below one."""
    alike = all(mine in ("*", its) for mine, its in zip(key, faulty, strict=False))
    return alike and ("*" not in key or len(faulty) <= len(key))


def _drop(data: Any, path: KeyPath) -> None:
    """Remove a key, where it is; of an entry of a list the whole list, which means something else without it."""
    whole = next((path[:at] for at, part in enumerate(path) if isinstance(part, int)), path)
    try:
        for part in whole[:-1]:
            data = data[part]
        del data[data.index(whole[-1]) if isinstance(data, list) else whole[-1]]
    except (LookupError, TypeError, ValueError):
        return  # an entry above it is gone, or is another value
