"""Where results come from: the resolved study, versions, digests, seed, platform."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import sys
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from io import StringIO
from typing import Any

from ruamel.yaml import YAML

from ..study import Study
from .jobs import CHUNK
from .workers import Workers

MODEL_VERSION = "7"
"""Raised whenever the same study would give other rows; part of every shard's key."""
_PACKAGES = ("cfa-sweep", "numpy", "scipy", "numba", "scikit-learn", "pandas", "pyarrow", "joblib", "nlopt", "moocore")


def identity(study: Study) -> dict[str, Any]:
    """Everything that a run's results depend on: the checked study, digests of its curves, the model's version."""
    curves, lights = hashlib.sha256(), hashlib.sha256()
    for name, curve in sorted(study.sensor.qe.items()):
        curves.update(name.encode() + curve.tobytes())
    lights.update(study.lights.photons.tobytes() + repr((study.lights.types, study.lights.photon_ratio)).encode())
    return {
        "study": study.section.model_dump(mode="json", by_alias=True, exclude={"question"}),
        "files": dict(study.digests),
        "curves": curves.hexdigest(),
        "lights": lights.hexdigest(),
        "model_version": MODEL_VERSION,
        "chunk": CHUNK,
    }


def fingerprint(study: Study) -> str:
    """SHA-256 of the canonical JSON of `identity`."""
    return hashlib.sha256(json.dumps(identity(study), sort_keys=True).encode()).hexdigest()


def resolved_yaml(study: Study) -> str:
    """The study with every default written out; a study file itself."""
    section = study.section.model_dump(mode="json", by_alias=True, exclude_none=True)
    for key in ("sensor", "lights"):
        section[key] = section[key].get("builtin", {k: v for k, v in section[key].items() if k != "builtin"})
    text = StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.dump(section, text)
    return text.getvalue()


def plan_facts(study: Study) -> dict[str, Any]:
    """How each scene was simulated."""
    return {
        name: {
            "key": plan.key,
            "tolerance_dn": plan.tolerance_dn,
            "promised_dn": plan.promised_dn,
            "work": plan.work,
            "reference_work": plan.reference_work,
            "effects": [asdict(choice) for choice in plan.choices],
        }
        for name, plan in study.plans.items()
    }


def provenance(study: Study, workers: Workers, command: Sequence[str], duration_s: float) -> dict[str, Any]:
    """Everything needed to run the study again, and what the machine was."""
    return {
        "command": list(command),
        "duration_s": round(duration_s, 3),
        "seed": study.section.seed,
        "fingerprint": fingerprint(study),
        "model_version": MODEL_VERSION,
        "data_sha256": dict(study.digests),
        "sensor": {"name": study.sensor.name, "source": study.sensor.source, "surrogate": study.sensor.surrogate},
        "lights": {"name": study.lights.name, "source": study.lights.source, "surrogate": study.lights.surrogate},
        "versions": {"python": platform.python_version()} | {name: version(name) for name in _PACKAGES},
        "platform": platform.platform(),
        "byte_order": sys.byteorder,
        "cores": os.cpu_count(),
        "backend": workers.backend,
        "scheduler": workers.scheduler,
        "workers": workers.count,
        "threads_per_worker": 1,
    }
