"""Plans of all scenarios over the cores."""

from __future__ import annotations

from dataclasses import replace

from ..base.types import Progress, delayed
from ..camera.plan.plan import Plan
from ..study import Study
from .stop import Stop
from .workers import Workers, workers


def with_plans(
    study: Study, n_jobs: int, progress: Progress, tolerance_dn: float | None = None, stop: Stop | None = None
) -> Study:
    """The study with a plan for each of its scenarios; `tolerance_dn` instead of the study's own.

    A scene whose worker dies is planned again. Raises InterruptedRunError after `stop` was asked for.
    """
    names, plans = list(study.scenarios), dict[str, Plan]()
    # One scene is planned faster than workers are started.
    how = Workers(n_jobs if len(names) > 1 else 1, Stop() if stop is None else stop)
    with workers(how) as crew:
        found = crew(delayed(study.plan, name, tolerance_dn) for name in names)
        for name, plan in zip(names, found, strict=True):
            plans[name] = plan
            progress("scenes planned", len(plans), len(names))
    return replace(study, plans=plans)
