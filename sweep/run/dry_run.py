"""Dry run: filters, scenarios, rows finished and to compute, evaluations at most, and the effects that are computed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..results.folder import held_by
from ..results.inventory import Inventory
from ..results.parts import Parts
from ..results.tables import PLAIN, RESULTS
from ..search.trade_off import most_searches
from ..study import Search, Study
from .held_out import most_evaluations_left_out
from .rows import rules_of
from .sweep import Sweep
from .workers import Workers


@dataclass(frozen=True)
class ToDo:
    """A study with its plans, and what is left to do of it.

    `finished`: rows that are kept; `chunks`: those that hold the others; `searches`: whether its search is to do.
    """

    study: Study
    finished: int
    chunks: int
    searches: bool


def to_do(study: Study, output: Path, n_jobs: int) -> ToDo:
    """Plan, and look at what is kept; neither compute designs nor write anything."""
    held = held_by(output)
    whole = held is not None and held.is_of(study) and not Inventory(output).wrong([RESULTS], quick=True)
    study = study.with_plans()
    if whole:
        return ToDo(study, study.n_designs, 0, searches=False)
    sweep = Sweep(study, rules_of(study), Parts(output), Workers(n_jobs))
    todo = [sweep.jobs[index] for index in sweep.todo]
    rows = sum(job.stop - job.start for job in todo)
    return ToDo(study, study.n_designs - rows, len(todo), searches=study.search is not None)


def to_do_lines(found: ToDo, output: Path) -> Iterator[str]:
    """Describe the work that is left, a line each."""
    study = found.study
    plain = sum(space.size for space in study.spaces if space.kind == PLAIN)
    left = study.n_designs - found.finished
    yield (
        f"{_count(study.n_filters - plain, 'filter')} and {_count(plain, 'plain CFA')} "
        f"in {_count(len(study.scenarios), 'scenario')}, {_count(study.n_designs, 'row')}: "
        f"{found.finished:,} finished, {left:,} in {_count(found.chunks, 'chunk')} to compute."
    )
    if study.search is not None:
        yield from _search_lines(study, study.search) if found.searches else ["The search is finished."]
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, plan in study.plans.items():
        groups.setdefault(plan.computed, []).append(name)
    for effects, names in groups.items():
        scenes = names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]} ({len(names)} scenarios)"
        yield f"Effects computed in {scenes}: {', '.join(effects) or 'none'}."
    yield f"Results go to {output}/; nothing was computed or written."


def _search_lines(study: Study, search: Search) -> Iterator[str]:
    """The most evaluations of a search that finds a feasible design, and of all that is searched with it."""
    starts = min(search.starts, search.max_evaluations)
    per_start = search.max_evaluations // starts
    yield f"Search: {_count(starts, 'start')}, {_count(starts * per_start, 'evaluation')} at most."
    if search.levels:
        most = most_searches(len(search.levels), starts) * per_start
        yield f"Its front: {_count(len(search.levels), 'level')}, {_count(most, 'evaluation')} at most."
    if study.leaves_one_out:
        most = most_evaluations_left_out(study, search)
        yield f"Without one light after the other: {_count(most, 'evaluation')} at most."


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"
