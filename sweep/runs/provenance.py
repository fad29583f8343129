"""Provenance of results: the resolved study, versions, digests, seed, platform."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Mapping
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

from ..results.identity import MODEL_VERSION, fingerprint
from ..study import Study
from ..study.tree import yaml_text

_PACKAGES = ("cfa-sweep", "numpy", "scipy", "numba", "pandas", "pyarrow", "joblib", "nlopt", "moocore")


def resolved_yaml(study: Study) -> str:
    """Return the study with all defaults written out; a study file itself."""
    section = study.section.model_dump(mode="json", by_alias=True, exclude_none=True)
    for key in ("sensor", "lights"):
        named = not section[key]["files"] and not section[key].get("technology")
        section[key] = section[key]["builtin"] if named else section[key]
    if study.section.lights.builtin is None:
        section["lights"]["photon_ratio"] = study.lights.photon_ratio  # another light in the file would change it
    return yaml_text(section)


def plan_facts(study: Study) -> dict[str, Any]:
    """Return the plan of each scene for the provenance."""
    return {
        name: {
            "key": plan.key,
            "tolerance_dn": plan.tolerance_dn,
            "error_bound_dn": plan.error_bound_dn,
            "accuracy": plan.accuracy.model_dump(),
            "effects": [asdict(choice) for choice in plan.choices],
        }
        for name, plan in study.plans.items()
    }


def provenance(study: Study, how: Mapping[str, Any]) -> dict[str, Any]:
    """Return versions, digests, seed and machine.

    `how`: `command`, `duration_s`, `backend`, `scheduler` and `workers` of the run.
    """
    return {
        **how,
        "seed": study.section.seed,
        "fingerprint": fingerprint(study),
        "model_version": MODEL_VERSION,
        "data_sha256": dict(study.digests),
        "sensor": {
            "name": study.sensor.name,
            "source": study.sensor.source,
            "surrogate": study.sensor.surrogate,
            "reference": study.sensor.clear,
            "has_clear": study.sensor.has_clear,
        },
        "lights": {"name": study.lights.name, "source": study.lights.source, "surrogate": study.lights.surrogate},
        "versions": {"python": platform.python_version()} | {name: version(name) for name in _PACKAGES},
        "platform": platform.platform(),
        "byte_order": sys.byteorder,
        "cores": os.cpu_count(),
        "threads_per_worker": 1,
    }
