"""Identity of a run: runs with equal identity have equal rows."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from ..study import Study

MODEL_VERSION = "20"
"""Raised whenever the same study would give other rows; part of every part's key."""
CHUNK = 4096
"""Designs that are computed at once."""


def identity(study: Study) -> dict[str, Any]:
    """Return everything that a run depends on.

    Parameters
    ----------
    study : Study
        Study.

    Returns
    -------
    dict
        Checked study, digests of its curves, and version of the model.
    """
    curves, lights = hashlib.sha256(), hashlib.sha256()
    for name, curve in sorted(study.sensor.qe.items()):
        curves.update(name.encode() + curve.tobytes())
    section = study.section.model_dump(mode="json", by_alias=True, exclude={"question"})
    if study.section.lights.builtin is None:
        section["lights"]["photon_ratio"] = study.lights.photon_ratio  # stated, or from the spectra: the same study
    if study.held_out is not None:
        lights.update(study.held_out.photons.tobytes() + repr(study.held_out.types).encode())
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
    """Return the SHA-256 of the canonical JSON of `identity`.

    Parameters
    ----------
    study : Study
        Study.

    Returns
    -------
    str
        Hexadecimal digest.
    """
    return hashlib.sha256(json.dumps(identity(study), sort_keys=True).encode()).hexdigest()
