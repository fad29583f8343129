"""Identity of a run: runs with equal identity have equal rows."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from ..study import SensorAndLights, Study

MODEL_VERSION = "28"
"""Raised whenever the same study would give other rows; part of every part's key."""
CHUNK = 4096
"""Designs that are computed at once."""


def identity(study: Study) -> dict[str, Any]:
    """Return everything that a run depends on.

    Checked study, digests of its curves, and version of the model.
    """
    curves, lights = hashlib.sha256(), hashlib.sha256()
    for name, curve in sorted(study.sensor.qe.items()):
        curves.update(name.encode() + curve.tobytes())
    section = study.section.model_dump(mode="json", by_alias=True, exclude={"title", "question"})
    if study.section.lights.builtin is None:
        section["lights"]["photon_ratio"] = study.lights.photon_ratio  # stated, or from the spectra: the same study
    lights.update(study.lights.photons.tobytes() + repr((study.lights.types, study.lights.photon_ratio)).encode())
    return {
        "study": section,
        "files": dict(study.digests),
        "curves": curves.hexdigest(),
        "lights": lights.hexdigest(),
        "model_version": MODEL_VERSION,
        "chunk": CHUNK,
    }


def fingerprint(study: Study) -> str:
    """Return the SHA-256 of the canonical JSON of `identity`."""
    return _digest(identity(study))


def run_facts(study: Study) -> dict[str, Any]:
    """Return the facts of the manifest of a study's run."""
    known = identity(study)
    return {"fingerprint": _digest(known), "identity": known, "designs": study.n_designs}


def several_facts(studies: Mapping[SensorAndLights, Study]) -> dict[str, Any]:
    """Return the facts of the manifest of a study of several sensors or lights; `runs` names each pair of them."""
    known = {member.name: identity(study) for member, study in studies.items()}
    designs = sum(study.n_designs for study in studies.values())
    runs = [[member.sensor, member.lights] for member in studies]
    return {"fingerprint": _digest(known), "identity": known, "designs": designs, "runs": runs}


def _digest(value: object) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
