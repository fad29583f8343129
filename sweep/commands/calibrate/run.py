"""The whole calibration: validation and final fit, prediction of unseen figures, cross-validation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from ...base.types import Progress, delayed
from ...curves.builtin.surrogate import parameter_tree
from ...run.stop import Stop
from ...run.workers import Workers, workers
from .fit import Fit, Task, best_of, fit_from
from .model import Figures, figures
from .parameters import Path as Tree
from .parameters import checked

_EDGES = ("left_nm", "left_width_nm", "right_nm", "right_width_nm")
_SET_BY = ("sensitivity", "csd_yellow_red")
_BAND = ("left_nm", "right_nm")


@dataclass(frozen=True)
class Calibration:
    """Everything that a calibration found.

    `predicted`: figures that the validation fit did not see, by row. `predicted_pair`: the last filter again, with the
    printed sensitivity read as that of the two yellow pixels together. `left_out`: each row's figures from a fit
    without that row.
    """

    printed: Figures
    seed: int
    starts: int
    validation: Fit
    final: Fit
    validation_costs: tuple[float, ...]
    final_costs: tuple[float, ...]
    fitted: Figures
    predicted: Figures
    predicted_pair: Figures
    shipped: Figures
    left_out: Figures


def fit_surrogate(printed: Figures, seed: int, starts: int, n_jobs: int, progress: Progress) -> Calibration:
    """Fit the surrogate to `printed` (row -> quantity -> value; rows are CFAs and the stopband filters of the prior).

    The validation fit sees the plain CFAs and the first filter; the last filter's band is then set by its sensitivity
    and its yellow/red CSD alone; the filters between share the first one's band but for its end. The final fit sees
    everything. Cross-validation leaves out each plain CFA, all but the last filter together, and the last filter.
    The result does not depend on `n_jobs`.
    """
    prior = parameter_tree("prior")
    filters = [row for row in printed if row in prior["stopbands"]]
    plain = [row for row in printed if row not in filters]
    first, *between, last = filters
    seen = [*plain, first]
    tasks = {"validation": _task(prior, printed, seen, filters), "final": _task(prior, printed, list(printed), filters)}
    groups = [[row] for row in plain] + [[first, *between], [last]]
    for group in groups:
        rows = [row for row in printed if row not in group]
        tasks["without " + group[-1]] = _task(prior, printed, rows, filters)
    jobs = [(name, start) for name in tasks for start in range(starts if name in ("validation", "final") else 1)]
    with workers(Workers(n_jobs, Stop())) as crew:
        found = crew(delayed(fit_from, tasks[name], seed, start) for name, start in jobs)
        fits: dict[str, list[Fit]] = {name: [] for name in tasks}
        for index, ((name, _), fit) in enumerate(zip(jobs, found, strict=True)):
            fits[name].append(fit)
            progress("fits", index + 1, len(jobs))
    validation, final = best_of(fits["validation"]), best_of(fits["final"])
    predicted = figures(validation.parameters, between) | _with_band(validation.tree, first, last, printed, pair=False)
    left_out: Figures = {}
    for group in groups:
        tree = fits["without " + group[-1]][0].tree
        if group == [last]:
            left_out |= _with_band(tree, first, last, printed, pair=False)
        else:
            left_out |= figures(checked(tree), group)
    return Calibration(
        printed=printed,
        seed=seed,
        starts=starts,
        validation=validation,
        final=final,
        validation_costs=tuple(fit.cost for fit in fits["validation"]),
        final_costs=tuple(fit.cost for fit in fits["final"]),
        fitted=figures(validation.parameters, seen),
        predicted=predicted,
        predicted_pair=_with_band(validation.tree, first, last, printed, pair=True),
        shipped=figures(final.parameters, list(printed)),
        left_out=left_out,
    )


def _task(prior: Mapping[str, Any], printed: Figures, rows: Sequence[str], filters: Sequence[str]) -> Task:
    """Only filters whose figures are seen may move; those between first and last share the first one's edges."""
    first, *between, last = filters
    seen = {row: printed[row] for row in printed if row in rows}
    moving = [f"{row}.{edge}" for row in (first, last) if row in seen for edge in _EDGES]
    moving += [f"{row}.right_nm" for row in between if row in seen]
    shared = [edge for edge in _EDGES if edge != "right_nm"]
    tied: dict[Tree, Tree] = {
        ("stopbands", row, edge): ("stopbands", first, edge) for row in between for edge in shared
    }
    return Task(prior, seen, tuple(moving), tied)


def _with_band(tree: Mapping[str, Any], first: str, last: str, printed: Figures, *, pair: bool) -> Figures:
    """The last filter on fixed curves: the first one's edge widths, its two edges set by two printed figures.

    `pair`: read the printed sensitivity as (Y + N) / 2Y, that of both yellow pixels, instead of N / Y.
    """
    band = dict(tree["stopbands"][first])
    sensitivity, distance = (printed[last][quantity] for quantity in _SET_BY)

    def of(edges: np.ndarray) -> dict[str, float]:
        moved = {**band, **dict(zip(_BAND, map(float, edges), strict=True))}
        whole = {**tree, "stopbands": {**tree["stopbands"], last: moved}}
        found = figures(checked(whole), [last])[last]
        return found | {"sensitivity": (1 + found["sensitivity"]) / 2} if pair else found

    def misses(edges: np.ndarray) -> list[float]:
        found = of(edges)
        return [(found[_SET_BY[0]] - sensitivity) / sensitivity, (found[_SET_BY[1]] - distance) / distance]

    start = [band["left_nm"], 650.0]
    found = least_squares(misses, start, bounds=([550, 625], [640, 699]), x_scale=[5.0, 5.0])
    return {last: of(found.x)}
