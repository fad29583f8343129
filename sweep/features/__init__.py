"""Features: folders that the core does not know. Delete a folder and its name here, and the rest works.

A feature's `__init__.py` says its question, its files of a run (`FILES`) and its public names (`PUBLIC`: name -> module
of the folder). Beside it stand those that it needs of `section.py` (keys of a study), `columns.py` (metrics),
`tables.py` (how files are made), `page.py` (sections, kinds of answers) and `commands.py`. It imports the core, and no
other feature; the core imports no feature.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

FEATURES = (
    "accuracy",
    "audit",
    "compare",
    "describe",
    "draws",
    "export",
    "field_map",
    "flicker",
    "held_out",
    "map",
    "published",
    "regions",
    "sensors",
    "tasks",
    "tiles",
    "validate",
    "vision",
)


def parts(part: str = "") -> dict[str, ModuleType]:
    """Import the modules of a name of all features that have one; without a name the folders themselves."""
    found = {}
    for feature in FEATURES:
        if not part or (Path(__file__).parent / feature / f"{part}.py").is_file():
            found[feature] = import_module(f".{feature}.{part}".rstrip("."), __name__)
    return found


def modules(part: str = "") -> Iterable[ModuleType]:
    """Return these modules alone."""
    return parts(part).values()


def gathered(name: str, part: str = "") -> dict[str, Any]:
    """Return the entries of the mappings of a name in the modules of all features."""
    return {key: value for module in modules(part) for key, value in getattr(module, name, {}).items()}


def public() -> dict[str, str]:
    """Return the public names with the modules that define them, and their names there."""
    return {
        name: f"features.{feature}.{home}:{name}"
        for feature, module in parts().items()
        for name, home in getattr(module, "PUBLIC", {}).items()
    }
