"""Dry run: filters, scenarios, finished and remaining rows, evaluations at most, and computed effects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..results.dataset import part_name
from ..results.folder import run_in
from ..results.identity import run_facts
from ..results.tables import REFERENCE
from ..search.solver import refinement_of
from ..search.trade_off import most_searches
from ..study import Study
from .held_out import most_evaluations_left_out
from .rows import parts_of


@dataclass(frozen=True)
class RemainingWork:
    """Remaining work of a study."""

    study: Study
    finished: int
    chunks: int
    searches: bool


def remaining_work(study: Study, output: Path) -> RemainingWork:
    """Plan a study and read which parts are kept, without computing or writing."""
    held, parts = run_in(output), parts_of(study)
    is_finished = held is not None and held.is_of(run_facts(study)) and held.finished
    todo = [part for part in parts if not is_finished and not (output / part_name(part.number)).is_file()]
    rows = sum(part.size for part in todo)
    searches = study.search is not None and not is_finished
    return RemainingWork(study.with_plans(), study.n_designs - rows, len(todo), searches=searches)


def remaining_work_lines(todo: RemainingWork, output: Path) -> Iterator[str]:
    """Yield lines that describe the remaining work."""
    study, search = todo.study, todo.study.search
    plain = sum(space.size for space in study.spaces if space.kind == REFERENCE)
    yield (
        f"{_count(study.n_filters - plain, 'filter')} and {_count(plain, 'plain CFA')} "
        f"in {_count(len(study.scenarios), 'scenario')}, {_count(study.n_designs, 'row')}: "
        f"{todo.finished:,} finished, {study.n_designs - todo.finished:,} in {_count(todo.chunks, 'chunk')} to compute."
    )
    if search is not None and not todo.searches:
        yield "The search is finished."
    elif search is not None:
        starts = min(search.starts, search.max_evaluations)
        per_start = search.max_evaluations // starts
        refinement = refinement_of(study.problem(search), search.algorithm)
        refined = refinement is not None
        then = f", then {refinement}" if refined else ""
        most = (starts + refined) * per_start
        yield f"Search: {_count(starts, 'start')}{then}, {_count(most, 'evaluation')} at most."
        if search.levels:
            most = most_searches(len(search.levels), starts, refined=refined) * per_start
            yield f"Its front: {_count(len(search.levels), 'level')}, {_count(most, 'evaluation')} at most."
        if study.leaves_one_out:
            most = most_evaluations_left_out(study, search)
            yield f"Without one light after the other: {_count(most, 'evaluation')} at most."
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, plan in study.plans.items():
        groups.setdefault(plan.computed, []).append(name)
    for effects, names in groups.items():
        scenes = names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]} ({len(names)} scenarios)"
        yield f"Effects computed in {scenes}: {', '.join(effects) or 'none'}."
    yield f"Results go to {output}/; nothing was computed or written."


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"
