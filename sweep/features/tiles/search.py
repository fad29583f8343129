"""Search of a study over tiles, and its tables: each tile at each level of light, and the front over all tiles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa

from ...base.errors import InfeasibleError, ValidationIssue
from ...base.types import Parallel, Progress, delayed
from ...camera.model import SceneModel
from ...metrics.evaluate import evaluate_some
from ...results.tables import FRONT, SCHEMA_VERSION, front_schema
from ...runs.as_read import Reading, best_as_read
from ...runs.routes import Rules
from ...runs.search import OtherSearch, SearchAnswer
from ...search.problem import Problem, best_feasible, starting_points
from ...search.solver import search_from
from ...search.trade_off import Effort, check_proof
from ...search.upper_bound import reason_without_bound, upper_bound_of
from ...spectra.lights import pair_name
from ...study import Search, Study
from . import TILES
from .tiles import SEARCHED, Tiles, search_tiles

COUNTED = ("csd", "pixel_csd", "chromatic_csd", "chromatic_pixel_csd")
"""Metrics of separations beside the objective of a search over tiles: of equal brightness or any, also by pixel."""


@dataclass(frozen=True)
class TileAnswer:
    """Answer of a search over tiles.

    `answer`: that of the best tile at the light that the study needs; `search`: the whole search.
    """

    answer: SearchAnswer
    search: Search
    problems: tuple[Problem, ...]
    tiles: Tiles


def asked(search: Search) -> bool:
    """Return whether a search is over tiles."""
    return bool(search.tiles)


def run(study: Study, search: Search, rules: Rules, parallel: Parallel, progress: Progress) -> OtherSearch:
    """Search over tiles, and then from every start in the best one.

    Raises InfeasibleError if no tile has a feasible filter. Raises UpperBoundExceededError if a filter exceeds the
    bound of its tile.
    """
    problems = tuple(study.problem(replace(search, space=space, tiles=())) for space in search.tiles)
    starts = starting_points(problems[0], min(search.starts, search.max_evaluations), study.section.seed)
    per_start = search.max_evaluations // len(starts)
    effort = Effort(search.algorithm, starts, per_start, study.section.seed)
    tiles = search_tiles(problems, search.levels, effort, parallel, progress)
    winner, found = tiles.winners[0], tiles.best(0)
    if winner is None or found is None:
        wanted = ", ".join(f"{name} {bound}" for name, bound in study.constraints.items()) or "none"
        said = f"{study.name}: no feasible design was found in any of {len(problems)} tiles"
        raise InfeasibleError([ValidationIssue(said, key="constraints", value=wanted)])
    problem = problems[winner]
    no_upper_bound = reason_without_bound(problem)
    points = [*starts, problem.to_unit(found.x)]
    calls = [
        delayed(search_from, problem, i, u, search.algorithm, per_start, effort.seed) for i, u in enumerate(points)
    ]
    *runs, limit = (
        parallel([*calls, delayed(upper_bound_of, problem)]) if no_upper_bound is None else (*parallel(calls), None)
    )
    best = best_feasible([found, *(e for run in runs for e in run.log)])
    assert best is not None
    of_best = replace(search, space=search.tiles[winner], tiles=())
    run = best_as_read(problem, Reading.of(study, of_best, rules), runs, effort, progress)
    runs, best = (runs, best) if run is None else ([*runs, run], run.log[-1])
    check_proof(best, limit)
    answer = SearchAnswer(
        of_best, search.scenario, tuple(runs), best, limit, no_upper_bound, front=(), starts=len(starts)
    )
    whole = TileAnswer(answer, search, problems, tiles)
    tables = {TILES: tiles_table(study, whole)}
    if search.levels:
        tables[FRONT] = tile_front_table(whole)
    return OtherSearch(answer, tables, {"tiles": tile_facts(whole)})


def tiles_schema(parameters: Sequence[str]) -> pa.Schema:
    """Return the columns of a search over tiles: a row for each tile and level of light."""
    text, number = pa.dictionary(pa.int32(), pa.string()), pa.float64()
    fields = [pa.field("cfa_sensitivity_min", number), *(pa.field(name, text) for name in ("space", "cfa", "base"))]
    fields += [pa.field("kinds", pa.int32()), pa.field("status", text), pa.field("best", pa.bool_())]
    names = ("upper_bound", "objective", "sensitivity", "cfa_sensitivity", *parameters, *COUNTED)
    fields += [pa.field(name, number) for name in names]
    return pa.schema(fields, metadata={"cfa_sweep_schema": SCHEMA_VERSION})


def tiles_table(study: Study, found: TileAnswer) -> pa.Table:
    """Return a row for each tile at each level of light."""
    rows, tiles, names = list[dict[str, Any]](), found.tiles, found.search.space.parameters
    for number, level in enumerate(tiles.levels):
        winner, best = tiles.winners[number], tiles.best(number)
        for i, tile in enumerate(tiles.at[number]):
            space, setup = found.search.tiles[i], found.problems[i].setup
            assert space.filter is not None
            (base,) = space.filter.bases.values()
            row: dict[str, Any] = {
                "cfa_sensitivity_min": None if number == 0 else level,
                "space": space.name,
                "cfa": space.cfa,
                "base": base,
                "kinds": len(setup.camera.mosaic.channels),
                "status": tile.status(-np.inf if best is None else best.objective),
                "upper_bound": tile.upper_bound if np.isfinite(tile.upper_bound) else None,
                "best": i == winner,
            }
            if tile.best is not None:
                row |= {"objective": tile.best.objective, "sensitivity": tile.best.sensitivity}
                row |= {"cfa_sensitivity": tile.best.cfa_sensitivity}
                row |= dict(zip(names, map(float, tile.best.x), strict=True))
            if tile.best is not None and i == winner:
                row |= _beside(study, found.problems[i], row, names)
            rows.append(row)
    return pa.Table.from_pylist(rows, schema=tiles_schema(names))


def _beside(study: Study, problem: Problem, row: dict[str, Any], names: tuple[str, ...]) -> dict[str, float]:
    """Return the separations of a filter in other ways to count, as the camera reads them out."""
    pair = study.quantities[study.trade_off[0]].pair
    known = [] if pair is None else [(name, study.quantities.get(pair_name(name, pair))) for name in COUNTED]
    quantities = {name: quantity for name, quantity in known if quantity is not None}
    curves = problem.family.curves(np.array([[row[name] for name in names]]))
    values = evaluate_some(SceneModel(problem.setup), curves, list(quantities.values()), study.states)
    return {name: values[quantity.name] for name, quantity in quantities.items()}


def tile_front_table(found: TileAnswer) -> pa.Table:
    """Return the best filter over all tiles at each level of light, with the upper bound over all tiles."""
    names, rows = found.search.space.parameters, list[dict[str, Any]]()
    for number, level in enumerate(found.tiles.levels[1:], 1):
        best, proven = found.tiles.best(number), found.tiles.upper_bound(number)
        row: dict[str, Any] = {"cfa_sensitivity_min": level}
        if best is not None:
            row |= {"objective": best.objective, "sensitivity": best.sensitivity}
            row |= {"cfa_sensitivity": best.cfa_sensitivity} | dict(zip(names, map(float, best.x), strict=True))
        if np.isfinite(proven):
            row |= {"upper_bound": proven} | (
                {} if best is None or proven <= 0 else {"gap": 1 - best.objective / proven}
            )
        rows.append(row)
    return pa.Table.from_pylist(rows, schema=front_schema(names))


def tile_facts(found: TileAnswer) -> dict[str, Any]:
    """Return how many tiles there are, and what became of them at the light that the study needs."""
    tiles, best = found.tiles, found.tiles.best(0)
    assert best is not None
    of_each = [tile.status(best.objective) for tile in tiles.at[0]]
    proven = tiles.upper_bound(0)
    return {
        "counts": {status: of_each.count(status) for status in dict.fromkeys((SEARCHED, *of_each))},
        "limit": proven if np.isfinite(proven) else None,
    }


TABLES = (TILES,)
