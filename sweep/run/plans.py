"""Plans of all scenarios over the cores."""

from __future__ import annotations

from dataclasses import replace

from ..study import Study
from ..types import Progress, delayed
from .stop import Stop
from .workers import Workers, workers


def with_plans(
    study: Study, n_jobs: int, progress: Progress, tolerance_dn: float | None = None, stop: Stop | None = None
) -> Study:
    """The study with a plan for each of its scenarios; `tolerance_dn` instead of the study's own.

    A scene whose worker dies is planned again. Raises InterruptedRunError after `stop` was asked for.
    """
    names = list(study.scenarios)
    calls = (delayed(study.plan, name, tolerance_dn) for name in names)
    plans = {}
    # One scene is planned faster than workers are started.
    how = Workers(min(n_jobs, len(names)), Stop() if stop is None else stop)
    with workers(how) as crew:
        for name, plan in zip(names, crew(calls), strict=True):
            plans[name] = plan
            progress("scenes planned", len(plans), len(names))
    return replace(study, plans=plans)
