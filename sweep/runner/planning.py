"""Plans of all scenarios over the cores."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import joblib

from ..study import Study

Progress = Callable[[str, int, int], None]


def with_plans(study: Study, n_jobs: int, progress: Progress, tolerance_dn: float | None = None) -> Study:
    """The study with a plan for each of its scenarios; `tolerance_dn` instead of the study's own."""
    names = list(study.scenarios)
    calls = (joblib.delayed(study.plan)(name, tolerance_dn) for name in names)
    plans = {}
    with joblib.parallel_config("loky", inner_max_num_threads=1):
        # One scene is planned faster than workers are started.
        found = joblib.Parallel(n_jobs=min(n_jobs, len(names)), return_as="generator")(calls)
        for name, plan in zip(names, found, strict=True):
            plans[name] = plan
            progress("scenes planned", len(plans), len(names))
    return replace(study, plans=plans)
