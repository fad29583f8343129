"""What a plan costs and what it saves: plan and run beside everything on, for scenes of a study."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from ...camera.forget import forget_scenes
from ...camera.forward import ForwardModel
from ...camera.methods import REFERENCE
from ...camera.plan.plan import Plan
from ...designs.block import CurveBlock, edges_of
from ...metrics.evaluate import evaluate
from ...results.identity import CHUNK
from ...study import Study

ALL, ONE = "all", "one"
PAID_AT_DN = (10.0, 1.0, 0.1, 0.01)
"""Tolerances at which plans are judged."""
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
            measured = _measured(own, scenario, tolerances_dn, repeats)
            for tolerance, (plan, everything_s, plan_s, run_s) in measured.items():
                left_out = ", ".join(choice.effect for choice in plan.choices if choice.promised_dn > 0)
                times = plan.reference_work, everything_s, plan_s, run_s
                yield Payment(study.name, scenario, kind, n_designs, tolerance, *times, left_out)


def _measured(
    study: Study, scenario: str, tolerances_dn: Sequence[float], repeats: int
) -> dict[float, tuple[Plan, float, float, float]]:
    """For each tolerance the plan, and median CPU times of everything on, of planning and of the run by the plan.

    Turn by turn. As in a run with one worker, what was made while planning is there for the run.
    """
    without = replace(study, plans={})
    plans = {tolerance: study.plan(scenario, tolerance) for tolerance in tolerances_dn}
    everything_s: list[float] = []
    each: dict[float, list[tuple[float, float]]] = {tolerance: [] for tolerance in tolerances_dn}
    spent_s = 0.0
    while len(everything_s) < repeats and spent_s < _SHORT_S:
        everything_s.append(cpu_s(partial(compute, without, scenario), 1))
        spent_s += everything_s[-1]
        for tolerance, plan in plans.items():
            plan_s = cpu_s(partial(study.plan, scenario, tolerance), 1)
            started = time.process_time()
            compute(replace(study, plans={scenario: plan}), scenario)
            each[tolerance].append((plan_s, time.process_time() - started))
            spent_s += sum(each[tolerance][-1])
    whole_s = statistics.median(everything_s)
    found = {}
    for tolerance, both in each.items():
        plan_s, run_s = (statistics.median(times) for times in zip(*both, strict=True))
        found[tolerance] = plans[tolerance], whole_s, plan_s, run_s
    return found


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
        imager = ForwardModel(view if scenario in study.plans else replace(view, methods=REFERENCE))
        for start in range(0, space.size, CHUNK):
            stop = min(start + CHUNK, space.size)
            block = edges_of(space, start, stop)
            evaluate(
                imager,
                CurveBlock(space.curves(space.points(start, stop), study.grid.size)) if block is None else block,
                study.states,
            )
