"""What a plan costs and what it saves: plan and run beside everything on, for scenes of a study."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from ...camera.forget import forget_scenes
from ...camera.imager import Imager
from ...camera.methods import REFERENCE
from ...camera.plan.plan import Plan
from ...designs.block import CurveBlock, edges_of
from ...metrics.evaluate import evaluate
from ...results.identity import CHUNK
from ...study import Study

ALL, ONE = "all", "one"
_SHORT_S = 2.0
"""Measurements that take longer together are not repeated."""


@dataclass(frozen=True)
class Payment:
    """Median CPU times of a scene, s: everything on, to find a plan as a run does, and to compute all designs by it.

    `estimated_s`: everything on, as the plan estimates it.
    """

    study: str
    scenario: str
    designs: str
    n_designs: int
    tolerance_dn: float
    estimated_s: float
    everything_s: float
    plan_s: float
    run_s: float
    left_out: str

    @property
    def factor(self) -> float:
        """How many times faster plan and run are than everything on."""
        return self.everything_s / (self.plan_s + self.run_s)


def one_design(study: Study) -> Study:
    """The study with the first design of its last space alone."""
    space = [space for space in study.spaces if space.size][-1]
    first = tuple((axis[0],) for axis in space.axes)
    return replace(study, spaces=(replace(space, axes=first, gridded=True, rows=None),), search=None)


def payments(
    study: Study,
    scenarios: Sequence[str],
    tolerances_dn: Sequence[float],
    repeats: int,
    designs: Sequence[str] = (ONE, ALL),
) -> Iterator[Payment]:
    """Each scene at each tolerance, for one design and for all; nothing is kept from one measurement to the next."""
    compute(replace(one_design(study), plans={}), scenarios[0])  # what is compiled and imported is there from now on
    for kind in designs:
        own = study if kind == ALL else one_design(study)
        n_designs = sum(space.size for space in own.spaces)
        for scenario in scenarios:
            for tolerance in tolerances_dn:
                everything_s, plan_s, run_s, plan = _measured(own, scenario, tolerance, repeats)
                left_out = ", ".join(choice.effect for choice in plan.choices if choice.promised_dn > 0)
                times = plan.reference_work, everything_s, plan_s, run_s
                yield Payment(study.name, scenario, kind, n_designs, tolerance, *times, left_out)


def _measured(study: Study, scenario: str, tolerance_dn: float, repeats: int) -> tuple[float, float, float, Plan]:
    """Median CPU times of everything on, of planning and of the run by the plan, one after the other; the plan.

    As in a run with one worker, what was made while planning is there for the run.
    """
    plan = study.plan(scenario, tolerance_dn)
    without, by_plan = replace(study, plans={}), replace(study, plans={scenario: plan})
    times: list[list[float]] = []
    while len(times) < repeats and sum(map(sum, times)) < _SHORT_S:
        everything_s = cpu_s(partial(compute, without, scenario), 1)
        plan_s = cpu_s(partial(study.plan, scenario, tolerance_dn), 1)
        started = time.process_time()
        compute(by_plan, scenario)
        times.append([everything_s, plan_s, time.process_time() - started])
    everything_s, plan_s, run_s = (statistics.median(each) for each in zip(*times, strict=True))
    return everything_s, plan_s, run_s, plan


def cpu_s(work: Callable[[], object], repeats: int) -> float:
    """Median CPU time of `work`, as the first of its process but for what is compiled and imported."""
    times: list[float] = []
    while len(times) < repeats and sum(times) < _SHORT_S:
        forget_scenes()
        started = time.process_time()
        work()
        times.append(time.process_time() - started)
    return statistics.median(times)


def compute(study: Study, scenario: str) -> None:
    """All designs of a scene, by its plan or with everything on."""
    for space in study.spaces:
        if not space.size:
            continue
        view = study.view(space, scenario)
        imager = Imager(view if scenario in study.plans else replace(view, methods=REFERENCE))
        for start in range(0, space.size, CHUNK):
            stop = min(start + CHUNK, space.size)
            block = edges_of(space, start, stop)
            evaluate(
                imager,
                CurveBlock(space.curves(space.points(start, stop), study.grid.size)) if block is None else block,
                study.states,
            )
