"""A study by its schema; where that has faults, what can be had of it, so that its faults of meaning are told, too."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from pydantic import ValidationError

from ..base.errors import Fault, StudyError
from .document import Document
from .schema import StudySection
from .yaml_tree import Key

_BY_NAME = ("scenarios", "geometry", "cfas", "designs", "sweeps", "boxes", "constraints", "published")
"""Sections of which one entry may be left out."""
_STAND_INS = {"study": "study", "sensor": "ar0820", "lights": "tl16", "cfas": ["RGGB"]}
"""Values of sections that no study lacks."""
_SPACES = ("cfas", "designs", "sweeps", "boxes")
_COLUMNS = ("objective", "constraints", "search")
_LEADS_TO = {
    "wavelengths": ("sensor", "lights", "validate", "scenarios", "population", "regions", "tasks", "vision", *_SPACES),
    "sensor": ("wavelengths", "scenarios", "tasks", "vision", *_SPACES),
    "pixel": ("scenarios", "tasks", "vision"),
    "lights": ("wavelengths", "validate", "scenarios", "population", "recognition", "vision", "published", *_COLUMNS),
    "scenarios": ("search", "tasks", "vision"),
    "geometry": ("published",),
    "cfas": ("vision", "published", *_SPACES),
    "designs": ("cfas", "published"),
    "sweeps": ("cfas", "search"),
    "boxes": ("cfas", "search"),
    "search": ("validate",),
    **dict.fromkeys(("production", "population", "recognition", "tasks", "vision", "metrics", "objective"), _COLUMNS),
}
"""Section -> sections that may have faults only because it is not there as it was meant."""


@dataclass(frozen=True)
class Checked:
    """A study by its schema, with the faults of that.

    `doubtful`: sections whose faults may come from what is left out.
    """

    section: StudySection
    faults: tuple[Fault, ...] = ()
    doubtful: frozenset[str] = frozenset()

    def faults_with(self, more: Iterable[Fault]) -> list[Fault]:
        """All faults in the order of their lines; of `more`, found in the section, those in no doubt."""
        sure = [fault for fault in more if (fault.key or "").split(".")[0].split("[")[0] not in self.doubtful]
        return sorted([*self.faults, *sure], key=lambda fault: (fault.line is None, fault.file or "", fault.line or 0))


def schema_of(document: Document) -> Checked:
    """The schema of a document, which is mended where it has faults. Raises StudyError where that does not do.

    A misspelled key gets the name that was meant; what is wrong is left out.
    """
    faults: list[Fault] = []
    doubtful: set[str] = set()
    for mended in range(3):
        try:
            section = StudySection.model_validate(document.data)
        except ValidationError as error:
            wrong = document.faults(error, StudySection)
            faults = faults or [fault for _, fault in wrong]
            if not all(path for path, _ in wrong):
                break  # too many to look at
            for path, fault in wrong:
                if mended == 0 and fault.problem == "unknown key":
                    document.rename(path, fault.nearest)
                else:
                    doubtful |= _left_out(document, path)
        else:
            return Checked(section, tuple(faults), frozenset(doubtful))
    raise StudyError(faults)


def _left_out(document: Document, path: tuple[Key, ...]) -> set[str]:
    """Leave out the entry or the section that a path leads into; the sections that are doubtful without it."""
    root = str(path[0])
    entries = document.data.get(root)
    if root in _BY_NAME and isinstance(entries, dict) and len(path) > 1 and len(entries) > 1:
        entries.pop(path[1], None)
        return set(_LEADS_TO.get(root, ()))
    document.data.pop(root, None)
    if root in _STAND_INS:
        document.data[root] = _STAND_INS[root]
    return {root, *_LEADS_TO.get(root, ())}
