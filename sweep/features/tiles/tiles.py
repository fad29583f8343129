"""Search over tiles: which tile, which of its pixels is modified, and which filter is in it, at each level of light.

Tiles come in the order of their upper bounds. One whose bound is no more than the best that is found needs no search:
no filter in it is better. A proof at one level of light is, as a tangent, one at every higher level.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.types import Array, Float, Parallel, Progress, delayed
from ...camera.setup import Setup
from ...metrics.bound import Bound
from ...metrics.columns.sensitivity import CFA_SENSITIVITY, SENSITIVITY, cfa_sensitivity_at
from ...search.problem import Evaluation, Problem
from ...search.solver import search_from, smooth_evaluation
from ...search.trade_off import Effort, with_least
from ...search.upper_bound import check_bound, reason_without_bound, upper_bound_of

_BOUND_DN, _PROGRAMS, _MORE_PROGRAMS = 0.5, 100, 400
"""Width of the bounds, and linear programs for the bound of each tile, and for the highest ones."""
_AT_ONCE = 2
"""Tiles of each level in one round, whatever the number of workers."""
_EVALUATIONS, _STARTS, _SEEDS = 80, 4, 4
_TIGHTENED = 4
_POLISHED, _POLISHED_FIRST = 3, 8
"""Best tiles of each level that are searched once more, from all starts and the answers of one another: more of them
at the light that the study needs.
"""
_TIE, _TIE_SHARE = 1e-3, 1e-6
"""Values that are no farther apart, absolute or relative, are equal: the tile with more light is preferred."""
SEARCHED, EXCLUDED, DARK, IMPOSSIBLE = "searched", "excluded", "too dark", "impossible"


@dataclass
class TileAtLevel:
    """A tile at a level of light: its upper bound, and the best filter if it was searched.

    `sensitivity`: what the modified channel needs for the level; `exact`: the bound is that of this level.
    """

    sensitivity: float
    upper_bound: float
    exact: bool
    best: Evaluation | None = None
    is_searched: bool = False

    def status(self, best: float) -> str:
        """Return what became of it, beside the best objective of all tiles."""
        if self.is_searched:
            return SEARCHED
        if self.sensitivity > 1:
            return DARK
        return IMPOSSIBLE if self.upper_bound == -np.inf else EXCLUDED if self.upper_bound <= best else "not searched"


@dataclass(frozen=True)
class Tiles:
    """All tiles at all levels of light; the first level is that of the study's constraints.

    `at`: level, then tile; `winners`: the best tile of each level, None where none has a filter.
    """

    levels: tuple[float, ...]
    at: tuple[tuple[TileAtLevel, ...], ...] = field(repr=False)
    winners: tuple[int | None, ...]

    def best(self, level: int) -> Evaluation | None:
        """Return the best filter of a level."""
        winner = self.winners[level]
        return None if winner is None else self.at[level][winner].best

    def upper_bound(self, level: int) -> float:
        """Return the upper bound over all tiles."""
        return max(tile.upper_bound for tile in self.at[level])


def search_tiles(
    problems: Sequence[Problem],
    levels: Sequence[float],
    effort: Effort,
    parallel: Parallel,
    progress: Progress,
) -> Tiles:
    """Find the best filter over all tiles at the light that the study needs, and at each level.

    Raises UpperBoundExceededError if a filter exceeds the bound of its tile.
    """
    all_levels = (0.0, *levels)
    tiles = [[_at_level(problem, level) for problem in problems] for level in all_levels]
    _bound_all(problems, tiles, parallel, progress)
    searches = _Searches(problems, tiles, effort)
    total = sum(tile.upper_bound > -np.inf for row in tiles for tile in row)
    while True:
        calls, applied = [], list[tuple[int, int]]()
        for level, row in enumerate(tiles):
            best = searches.best_value(level)
            waiting = [i for i, tile in enumerate(row) if not tile.is_searched and tile.upper_bound > best]
            for i in sorted(waiting, key=lambda i: (-row[i].upper_bound, i))[:_AT_ONCE]:
                calls.append(delayed(_searched, searches.problem(level, i), searches.starts(level, i), effort.seed))
                applied.append((level, i))
        if not calls:
            break
        for (level, i), answer in zip(applied, parallel(calls), strict=True):
            tiles[level][i].is_searched = True
            searches.take(level, i, answer)
        left = sum(
            not t.is_searched and t.upper_bound > searches.best_value(k) for k, row in enumerate(tiles) for t in row
        )
        progress("tiles at all levels of light", total - left, total)
    searches.polish(parallel, (0,), _POLISHED_FIRST)
    searches.polish(parallel, range(1, len(all_levels)), _POLISHED)
    searches.carry()
    searches.share()
    searches.tighten(parallel)
    winners = tuple(searches.winner(level) for level in range(len(all_levels)))
    return Tiles(all_levels, tuple(tuple(row) for row in tiles), winners)


def _searched(problem: Problem, starts: Sequence[Float[Array, " free"]], seed: int) -> Evaluation:
    """Search from some points; returns the best evaluation."""
    runs = [search_from(problem, number, u0, "SLSQP", _EVALUATIONS, seed) for number, u0 in enumerate(starts)]
    return max((evaluation for run in runs for evaluation in run.log), key=lambda evaluation: evaluation.rank)


@dataclass
class _Searches:
    """What is found so far."""

    problems: Sequence[Problem]
    tiles: list[list[TileAtLevel]]
    effort: Effort

    def problem(self, level: int, tile: int) -> Problem:
        """Return the problem of a tile at a level of light."""
        least = self.tiles[level][tile].sensitivity
        return self.problems[tile] if least <= 0 else with_least(self.problems[tile], SENSITIVITY, least)

    def take(self, level: int, tile: int, best: Evaluation) -> None:
        """Keep a filter of a tile, if it is the best one."""
        at = self.tiles[level][tile]
        if best.feasible and (at.best is None or best.objective > at.best.objective):
            check_bound(best.objective, at.upper_bound)
            at.best = best

    def value(self, level: int, tile: int) -> float:
        """Return the best objective of a tile."""
        best = self.tiles[level][tile].best
        return -np.inf if best is None else best.objective

    def best_value(self, level: int) -> float:
        """Return the best objective of a level, of filters with this light or more."""
        of_more = range(level, len(self.tiles))
        return max(self.value(k, i) for k in of_more for i in range(len(self.problems)))

    def carry(self) -> None:
        """Take filters that were found at more light for the levels of less."""
        for level in range(len(self.tiles) - 2, -1, -1):
            for i, above in enumerate(self.tiles[level + 1]):
                if above.best is not None:
                    self.take(level, i, above.best)

    def starts(self, level: int, tile: int) -> list[Float[Array, " free"]]:
        """Return starting points: a few of the box, fewer where there are seeds."""
        seeds = self.seeds(level, tile)
        return [*self.effort.starts[: max(1, _STARTS - len(seeds))], *seeds]

    def seeds(self, level: int, tile: int) -> list[Float[Array, " free"]]:
        """Return the best filters of the tile at other levels, and of others of the same base at this one."""
        problem, around = self.problem(level, tile), range(max(0, level - 1), min(level + 2, len(self.tiles)))
        alike = sorted(self._alike(tile), key=lambda i: (-self.value(level, i), i))[:_SEEDS]
        known = [*(self.tiles[k][tile].best for k in around), *(self.tiles[level][i].best for i in alike)]
        points = {e.x.tobytes(): problem.to_unit(e.x) for e in known if e is not None}
        return [*points.values()][:_SEEDS]

    def _alike(self, tile: int) -> list[int]:
        """Return tiles with the same curve below the filter."""
        base = self.problems[tile].setup.camera.base_qe
        return [
            i for i, problem in enumerate(self.problems)
            if i != tile and np.array_equal(problem.setup.camera.base_qe, base)
        ]  # fmt: skip

    def polish(self, parallel: Parallel, levels: Sequence[int], count: int) -> None:
        """Search the best tiles of some levels once more, from all starts and the answers of one another."""
        calls, whose = [], []
        for level in levels:
            values = [self.value(level, i) for i in range(len(self.problems))]
            ranked = np.argsort([-value for value in values], kind="stable")[:count].tolist()
            for tile in (i for i in ranked if self.tiles[level][i].best is not None):
                starts = [*self.seeds(level, tile), *self.effort.starts]
                calls.append(delayed(_searched, self.problem(level, tile), starts, self.effort.seed))
                whose.append((level, tile))
        for (level, tile), best in zip(whose, parallel(calls), strict=True):
            self.take(level, tile, best)

    def share(self) -> None:
        """Put the best filter of each level into the other tiles of its base: of equal tiles all have it then."""
        for level, row in enumerate(self.tiles):
            values = [self.value(level, i) for i in range(len(row))]
            top = values.index(max(values))
            best = row[top].best
            for i in self._alike(top):
                if best is not None and row[i].upper_bound >= best.objective * (1 - _TIE_SHARE):
                    self.take(level, i, smooth_evaluation(self.problem(level, i), best.x))

    def tighten(self, parallel: Parallel) -> None:
        """Compute the highest bounds of each level at its own light, a few times; all of them hold anyway."""
        for _ in range(_TIGHTENED):
            limits = [[tile.upper_bound for tile in row] for row in self.tiles]
            highest = [(k, row.index(max(row))) for k, row in enumerate(limits)]
            loose = [
                (k, i) for k, i in highest if not self.tiles[k][i].exact and np.isfinite(self.tiles[k][i].upper_bound)
            ]
            if not loose:
                return
            calls = [delayed(upper_bound_of, self.problem(k, i), _BOUND_DN, _MORE_PROGRAMS) for k, i in loose]
            for (k, i), limit in zip(loose, parallel(calls), strict=True):
                self.tiles[k][i].upper_bound, self.tiles[k][i].exact = (
                    min(self.tiles[k][i].upper_bound, limit.proven),
                    True,
                )

    def winner(self, level: int) -> int | None:
        """Return the best tile; of equal ones that with more light, then with fewer kinds of pixels."""
        top = max(self.value(level, i) for i in range(len(self.problems)))
        if not np.isfinite(top):
            return None
        near = top - max(_TIE, _TIE_SHARE * abs(top))

        def order(tile: int) -> tuple[float, int, float]:
            best = self.tiles[level][tile].best
            assert best is not None
            return (
                -round(best.cfa_sensitivity, 6),
                len(self.problems[tile].setup.camera.mosaic.channels),
                -best.objective,
            )

        return min((i for i in range(len(self.problems)) if self.value(level, i) >= near), key=order)


def _at_level(problem: Problem, level: float) -> TileAtLevel:
    """Return a tile with the sensitivity of the modified channel that a CFA sensitivity needs."""
    stated, light = problem.constraints.get(SENSITIVITY), problem.constraints.get(CFA_SENSITIVITY)
    least = max(level, 0.0 if light is None or light.min is None else light.min)
    none, whole = (cfa_sensitivity_at(problem.setup, share) or 0.0 for share in (0.0, 1.0))
    needed = (least - none) / (whole - none)
    sensitivity = max(needed, 0.0 if stated is None or stated.min is None else stated.min)
    return TileAtLevel(sensitivity, np.inf if sensitivity <= 1 else -np.inf, exact=False)


def _bound_all(
    problems: Sequence[Problem], tiles: list[list[TileAtLevel]], parallel: Parallel, progress: Progress
) -> None:
    """Compute upper bounds: one proof for all tiles of the same channels, at the least light, and tangents above it."""
    bounded = [reason_without_bound(problem) is None for problem in problems]
    groups: dict[Hashable, list[tuple[int, int]]] = {}
    for level, row in enumerate(tiles):
        for i, tile in enumerate(row):
            if tile.upper_bound > -np.inf and bounded[i]:
                groups.setdefault(_kind(problems[i]), []).append((level, i))
    calls, whose = [], []
    for members in groups.values():
        needed = sorted({tiles[level][i].sensitivity for level, i in members})
        darkest = next(i for level, i in members if tiles[level][i].sensitivity == needed[0])
        problem = _without_light(problems[darkest])
        problem = problem if needed[0] <= 0 else with_least(problem, SENSITIVITY, needed[0])
        calls.append(delayed(upper_bound_of, problem, _BOUND_DN, _PROGRAMS, needed))
        whose.append((members, needed))
    for number, ((members, needed), limit) in enumerate(zip(whose, parallel(calls), strict=True), 1):
        for level, i in members:
            tile = tiles[level][i]
            at = needed.index(tile.sensitivity)
            tile.upper_bound = limit.proven if at == 0 else min(limit.proven, limit.elsewhere[at])
            tile.exact = at == 0
        progress("upper bounds of tiles", number, len(calls))


def _without_light(problem: Problem) -> Problem:
    """Return the problem without a least CFA sensitivity, which stands as a sensitivity of the modified channel."""
    bounds = dict(problem.constraints)
    light = bounds.pop(CFA_SENSITIVITY, None)
    if light is not None and light.max is not None:
        bounds[CFA_SENSITIVITY] = Bound(max=light.max)
    return replace(problem, constraints=bounds)


def _kind(problem: Problem) -> Hashable:
    """Return what the bound of a tile depends on beside the light: its channels where only these count, or all."""
    setup, names = problem.setup, (*problem.objective.weights, *problem.constraints)
    counted = any(problem.quantities[name].per_pixel for name in names) or CFA_SENSITIVITY in problem.objective.weights
    light = problem.constraints.get(CFA_SENSITIVITY)
    if _sees_places(setup) or counted or (light is not None and light.max is not None):
        return setup.camera.mosaic.name, setup.camera.base_qe.tobytes()
    fixed = frozenset(setup.camera.qe[channel].tobytes() for channel in setup.camera.fixed)
    return fixed, setup.camera.base_qe.tobytes()


def _sees_places(setup: Setup) -> bool:
    """Return whether the places of the pixels in a tile count."""
    return setup.scene.target is not None or setup.camera.pixel.crosstalk > 0
