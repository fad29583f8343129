"""Plans of all scenarios over the cores."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..base.types import Progress, delayed
from ..camera.plan.plan import Plan
from ..results.kept_plans import KeptPlans, plan_key, study_keys
from ..study import Study
from .stop import Stop
from .workers import Workers, workers


def with_plans(
    study: Study, n_jobs: int, progress: Progress, tolerance_dn: float | None = None, stop: Stop | None = None
) -> Study:
    """The study with a plan for each of its scenarios; `tolerance_dn` instead of the study's own.

    Plans that were found before, for a scene with the same designs, are taken from the cache. A scene whose worker dies
    is planned again. Raises InterruptedRunError after `stop` was asked for.
    """
    kept = KeptPlans()
    keys = study_keys(study, tolerance_dn)
    plans = {name: plan for name, key in keys.items() if (plan := kept.of(key)) is not None}
    missing = [name for name in keys if name not in plans]
    for name, plan in zip(missing, _found(study, missing, n_jobs, tolerance_dn, stop), strict=True):
        kept.keep(keys[name], plan)
        plans[name] = plan
        progress("scenes planned", len(plans), len(keys))
    return replace(study, plans={name: plans[name] for name in keys})


def _found(
    study: Study, names: list[str], n_jobs: int, tolerance_dn: float | None, stop: Stop | None
) -> Iterator[Plan]:
    """Plans of some scenes, in order, over the cores."""
    if not names:
        return
    # One scene is planned faster than workers are started.
    how = Workers(n_jobs if len(names) > 1 else 1, Stop() if stop is None else stop)
    with workers(how) as crew:
        yield from crew(delayed(_planned, study, name, tolerance_dn) for name in names)


def _planned(study: Study, scenario: str, tolerance_dn: float | None) -> Plan:
    """The plan of a scene: that of another study with the same scene, or a new one."""
    kept, key = KeptPlans(), plan_key(study, scenario, tolerance_dn)
    plan = kept.of(key)
    if plan is None:
        plan = study.plan(scenario, tolerance_dn)
        kept.keep(key, plan)
    return plan
