"""Features: folders that the core does not know. Delete a folder and its name here, and the rest works.

A feature has those of `commands.py` (public functions that are commands) that it needs, and modules of its own. It
imports the core, and no other feature; the core imports no feature.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

FEATURES: dict[str, tuple[str, ...]] = {
    "accuracy": (),
    "compare": ("compare",),
    "describe": ("describe",),
    "export": ("export",),
}
"""Names of features, and the functions of a module of its name that each makes public."""
PUBLIC = {name: f"features.{feature}.{feature}:{name}" for feature, names in FEATURES.items() for name in names}
"""Public name to the module that defines it, and its name there."""


def modules(part: str) -> Iterator[ModuleType]:
    """Import the modules of a name of all features that have one."""
    for feature in FEATURES:
        if (Path(__file__).parent / feature / f"{part}.py").is_file():
            yield import_module(f".{feature}.{part}", __name__)
