"""Plans that were found before, kept by what they were found for in the user's cache folder.

A plan that is damaged, or that cannot be read or written, is found again; nothing but time depends on what is kept.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np
from platformdirs import user_cache_path
from pydantic import BaseModel

from ..base.disk import read_plain
from ..base.errors import OutputError
from ..camera.plan.plan import Choice, Plan
from ..study import Study
from .atomic import write_bytes
from .identity import MODEL_VERSION, fingerprint

CACHE = "SWEEP_CACHE"
"""Variable of the environment: the folder to keep plans in, instead of the user's cache folder."""
_MOST_BYTES, _MOST_KEPT = 2**20, 4096
"""Of a plan, more than any has; how many are kept."""


class KeptPlans:
    """Plans by key, a JSON file each."""

    def __init__(self) -> None:
        named = os.environ.get(CACHE)
        self._folder = (Path(named) if named else user_cache_path("sweep")) / "plans"

    def of(self, key: str) -> Plan | None:
        """A plan that is kept; None where there is none, or not a whole one."""
        try:
            sealed = json.loads(read_plain(self._path(key), _MOST_BYTES))
            held = sealed["plan"]
            if sealed["sha256"] != _digest_of(held):
                return None
            choices = tuple(Choice(**choice) for choice in held["choices"])
            rejected = tuple((str(effect), str(method), float(dn)) for effect, method, dn in held["rejected"])
            plan = Plan(**{**held, "choices": choices, "rejected": rejected})
        except (OSError, ValueError, TypeError, KeyError, RecursionError):
            return None
        return plan

    def keep(self, key: str, plan: Plan) -> None:
        """Keep a plan, if the folder can be written; of too many, the oldest half is forgotten."""
        held = asdict(plan)
        content = json.dumps({"plan": held, "sha256": _digest_of(held)}).encode()
        with suppress(OutputError, OSError):
            write_bytes(content, self._path(key))
            kept = list(self._folder.glob("*.json"))
            if len(kept) > _MOST_KEPT:
                for old in sorted(kept, key=lambda path: path.stat().st_mtime)[: len(kept) // 2]:
                    old.unlink()

    def _path(self, key: str) -> Path:
        return self._folder / f"{key}.json"


def study_keys(study: Study, tolerance_dn: float | None) -> dict[str, str]:
    """For each scene the SHA-256 of all that the whole study depends on, and the scene.

    Nothing of its families is asked for it. What an object may have in place of what its section says (spaces, scenes,
    pixel, lights) is part of it.
    """
    digest = hashlib.sha256()
    spaces = [
        (s.kind, s.name, s.cfa, s.axes, None if s.filter is None else (s.filter.family.kind, s.filter.bases))
        for s in study.spaces
    ]
    held = (study.scenarios, study.pixel, study.lights, spaces)
    _add(digest, (fingerprint(study), held, _code(), study.tolerance_dn(tolerance_dn)))
    keys = {}
    for name in study.scenarios:
        own = digest.copy()
        _add(own, name)
        keys[name] = own.hexdigest()
    return keys


def plan_key(study: Study, scenario: str, tolerance_dn: float | None) -> str:
    """SHA-256 of all that the plan of a scene depends on: its boxes, the tolerance, what is asked, and the code.

    A study that changes elsewhere leaves it as it is.
    """
    digest = hashlib.sha256()
    asked = (MODEL_VERSION, _code(), scenario, study.tolerance_dn(tolerance_dn), bool(study.states))
    _add(digest, (asked, study.boxes(scenario)))
    return digest.hexdigest()


@cache
def _code() -> str:
    """Of the version of the package, and when its files were changed: a plan of other code is another one."""
    root = Path(__file__).parent.parent
    files = [(path, path.stat()) for path in sorted(root.rglob("*.py"))]
    stamps = [(str(path.relative_to(root)), found.st_mtime_ns, found.st_size) for path, found in files]
    return hashlib.sha256(repr((version("cfa-sweep"), stamps)).encode()).hexdigest()


def _digest_of(held: Mapping[str, object]) -> str:
    return hashlib.sha256(json.dumps(held, sort_keys=True).encode()).hexdigest()


def _add(digest: hashlib._Hash, value: object) -> None:
    """Add a value, with its type and length, so that no two different ones add the same bytes."""
    digest.update(type(value).__name__.encode() + b":")
    if isinstance(value, np.ndarray):
        digest.update(repr((value.dtype.str, value.shape)).encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, BaseModel):
        _add(digest, value.model_dump(mode="python"))
    elif is_dataclass(value):
        _add(digest, {field.name: getattr(value, field.name) for field in fields(value)})
    elif isinstance(value, Mapping):
        _add(digest, sorted(value.items()))
    elif isinstance(value, list | tuple):
        digest.update(str(len(value)).encode())
        for one in value:
            _add(digest, one)
    elif value is None or isinstance(value, str | int | float | bool):
        digest.update(repr(value).encode() + b";")
    else:
        raise TypeError(f"a plan cannot be kept by a value of type {type(value).__name__}")
