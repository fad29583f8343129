"""The best objective at each pair of values of two parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import pyarrow as pa

from ...base.types import delayed
from ...designs.families.mixture import THICKNESS_UM
from ...runs.analysis import RunTable, Shown
from ...search.held import fix_parameters, search_held
from ...search.problem import Evaluation, Problem
from . import MAP
from .section import map_of

_CELLS_AT_ONCE, _MOST_HELD = 16, 60
_CM_PER_UM = 1e-4


def _table(shown: Shown) -> pa.Table:
    """Return the best objective over the values of two parameters, with all other parameters free.

    Returns one row per pair of values: all parameters, objective and sensitivity before clipping and quantization.
    """
    study, search, held = shown.study, shown.study.search, map_of(shown.study)
    assert search is not None
    problem, names = study.problem(search), search.space.parameters
    indices = [names.index(name) for name in held]
    assumed = None if study.section.colorants is None else study.section.colorants.assumed
    cells = [dict(zip(indices, values, strict=True)) for values in product(*held.values())]
    most = min(_MOST_HELD, search.max_evaluations)
    parts = [cells[at : at + _CELLS_AT_ONCE] for at in range(0, len(cells), _CELLS_AT_ONCE)]
    calls = [delayed(search_cells, problem, part, search.algorithm, most, study.section.seed) for part in parts]
    rows = []
    for evaluations in shown.kept("map")(calls):
        for best in evaluations:
            row = dict(zip(names, map(float, best.x), strict=True))
            row |= {"objective": best.objective, "sensitivity": best.sensitivity}
            if assumed is not None and "absorbance" in row:
                mol_per_l = row["absorbance"] / (assumed.molar_extinction * THICKNESS_UM * _CM_PER_UM)
                g_per_l = mol_per_l * assumed.molar_mass_g_per_mol
                row["mol_per_l"] = mol_per_l
                row["percent_by_weight"] = 100 * g_per_l / (1000 * assumed.film_density_g_per_cm3)
            rows.append(row | {"violation": best.violation, "feasible": best.feasible})
        shown.progress("cells of the map", len(rows), len(cells))
    return pa.Table.from_pylist(rows)


def search_cells(
    problem: Problem, cells: Sequence[Mapping[int, float]], algorithm: str, max_evaluations: int, seed: int
) -> list[Evaluation]:
    """Search what is free with other parameters held at the values of each cell."""
    return [search_held(fix_parameters(problem, cell), algorithm, max_evaluations, seed) for cell in cells]


TABLES = (RunTable(MAP, lambda study: bool(map_of(study)), _table),)
