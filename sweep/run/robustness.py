"""How designs do over the population of the lights: what breaks them, and how many lamps and cameras they keep."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from ..camera.view import View
from ..curves.lights import Pair
from ..designs.space import Space
from ..designs.tolerance import AS_DESIGNED, Off, Tolerance
from ..metrics.members import PopulationImager, population_imager
from ..metrics.separation import csd_name
from ..results.designs import row_space
from ..results.tables import FEW, PLAIN
from ..study import Study
from ..types import FloatArray, IndexArray, Parallel, Progress, delayed

_LARGEST, _STEP, _HALVINGS = 3.0, 0.25, 6
"""Times the population that are looked at, the steps in which, and how often the last of these is halved."""
_PARTS, _PARTS_OF_BOTH = 101, 25
"""Equal parts of the range of a tolerance, and of each where there are two; what is drawn is the middle of one."""
_Z = 1.959963984540054
"""Of a two-sided 95 % interval of a normal distribution."""
_FIELDS = [
    ("design_id", pa.int64()),
    *((name, pa.float64()) for name in ("breaks_at", "breaks_dn", "breaks_edge_nm", "breaks_thickness")),
    *((name, pa.string()) for name in ("breaks_first", "breaks_second")),
    *((name, pa.float64()) for name in ("breaks_first_nm", "breaks_second_nm", "breaks_low_c", "breaks_high_c")),
    *((name, pa.float64()) for name in ("yield", "yield_low", "yield_high")),
]


@dataclass(frozen=True)
class Candidate:
    """A design in a scene; `point`: its parameters, ndarray[1, n_parameters]."""

    view: View
    space: Space
    point: FloatArray
    tolerance: Tolerance

    def imager(self, scale: float) -> PopulationImager:
        """The scene with the population of its lights so many times as large."""
        population = self.view.lights.population
        assert population is not None
        return population_imager(
            replace(self.view, lights=replace(self.view.lights, population=population.scaled(scale)))
        )

    def curves(self, off: Off) -> FloatArray:
        """Its filters as production has them."""
        return np.asarray(self.space.curves(self.point, self.view.grid.size, off), dtype=float)

    def worst(self, pair: Pair, scale: float) -> tuple[float, Off]:
        """The smallest CSD over population and tolerances so many times as far, DN, and how its filter came out."""
        imager, own = self.imager(scale), self.space.filter is not None
        places = self.tolerance.scaled(scale).places if own else (AS_DESIGNED,)
        each = imager.worst(np.concatenate([self.curves(off) for off in places]), [pair])[csd_name(pair)]
        at = int(each.argmin())
        return float(each[at]), places[at]


def robustness_table(study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """A row per plain CFA, named design and answer of the search.

    `breaks_at`: how many times as large the population, and the tolerances, must be for the worst CSD to fall
    below that of the plain CFA that has most at 1 (null where it does not up to 3 times, in steps of 0.25); `breaks_dn`
    and what stands beside it: the worst CSD there, and the lights, shifts and temperature that it comes from. `yield`:
    the share of lamps and cameras with the wanted CSD, with its 95 % interval (Wilson, 1927).
    """
    pair = study.pair_over_population
    assert pair is not None
    few = rows[rows["kind"].isin(FEW) & (rows["status"] == "ok")]
    found: list[dict[str, Any]] = []
    calls = []
    shown: list[dict[Any, Any]] = few.to_dict("records")
    for row in shown:
        own = few[(few["kind"] == PLAIN) & (few["scenario"] == row["scenario"])]
        plain = own.loc[[own[f"worst_{csd_name(pair)}"].idxmax()]].to_dict("records") if len(own) else []
        rival = _design(study, plain[0]) if plain and plain[0]["design_id"] != row["design_id"] else None
        calls.append(delayed(_robustness, _design(study, row), rival, pair, study.section.seed))
    for row, (numbers, lights) in zip(shown, parallel(calls), strict=True):
        found.append({"design_id": row["design_id"], **numbers, **lights})
        progress("robustness", len(found), len(shown))
    return pa.Table.from_pylist(found, schema=pa.schema(_FIELDS))


def _design(study: Study, row: dict[Any, Any]) -> Candidate:
    space = row_space(study, row)
    point = np.array([[row[name] for name in space.parameters]], dtype=float)
    return Candidate(study.view(space, row["scenario"]), space, point, study.tolerance)


def _robustness(
    design: Candidate, rival: Candidate | None, pair: Pair, seed: int
) -> tuple[dict[str, float], dict[str, str]]:
    """What is found of a design, numbers and names of lights by their columns, in a form that a run can keep."""
    numbers, lights = ({}, {}) if rival is None else _breaks(design, rival, pair)
    population = design.view.lights.population
    assert population is not None
    if population.wanted_dn is not None:
        kept = int((drawn_dn(design, pair, seed) >= population.wanted_dn).sum())
        low, high = yield_interval(kept, population.draws)
        numbers |= {"yield": kept / population.draws, "yield_low": low, "yield_high": high}
    return numbers, lights


def _breaks(design: Candidate, rival: Candidate, pair: Pair) -> tuple[dict[str, float], dict[str, str]]:
    """Where a design falls below a rival first, and what it is that breaks it: numbers, and names of lights."""

    def below(scale: float) -> bool:
        return design.worst(pair, scale)[0] < rival.worst(pair, scale)[0]

    scale = _first(below)
    if scale is None:
        return {}, {}
    least, off = design.worst(pair, scale)
    imager = design.imager(scale)
    response = imager.imager.smooth(design.curves(off))[0]
    near = min((imager.nearest(case, pair) for case in response), key=lambda each: float(each.squared.min()))
    at = np.unravel_index(int(near.squared.argmin()), near.squared.shape)
    lights, population = design.view.lights, design.imager(scale).members.population
    names = dict[str, str]()
    found: dict[str, float] = {"breaks_at": scale, "breaks_dn": least, "breaks_edge_nm": off.shift_nm}
    found["breaks_thickness"] = off.thickness
    warm = []
    for side, (name, starts) in enumerate((("first", near.first), ("second", near.second))):
        signal = imager.members.signal(int(starts[at[side]]))
        nm = imager.members.shift_nm(int(near.steps[at][side]), float(near.shares[at][side]))
        names[f"breaks_{name}"], found[f"breaks_{name}_nm"] = lights.names[signal], nm
        warm.append(population.temperature_of(lights.types[signal], lights.names[signal], nm))
    together = max(low for low, _ in warm), min(high for _, high in warm)
    if population.temperatures == "common":
        found |= {"breaks_low_c": together[0], "breaks_high_c": together[1]}
    return found, names


def _first(below: Callable[[float], bool]) -> float | None:
    """The smallest scale, in steps of `_STEP`, at which something holds; then to 2^-_HALVINGS of a step."""
    for step in range(round(_LARGEST / _STEP) + 1):
        high = step * _STEP
        if below(high):
            break
    else:
        return None
    low = max(0.0, high - _STEP)
    for _ in range(_HALVINGS if high > 0 else 0):
        middle = (low + high) / 2
        low, high = (low, middle) if below(middle) else (middle, high)
    return high


def drawn_dn(design: Candidate, pair: Pair, seed: int) -> FloatArray:
    """The distance of two random members each, before clipping and rounding, DN, ndarray[n_draws].

    Every number is drawn whatever the design, so that all designs see the same lamps and cameras.
    """
    lights, population = design.view.lights, design.view.lights.population
    assert population is not None
    imager = population_imager(design.view)
    members = imager.members
    rng, n = np.random.default_rng([seed, 1]), population.draws
    ambient, heating, u, chosen, edge, place, film = (rng.random((n, k)) for k in (2, 2, 2, 4, 1, 1, 1))
    if population.temperatures == "common":
        ambient, heating = (np.repeat(values[:, :1], 2, axis=1) for values in (ambient, heating))
    low, high = population.temperature_c
    warmer = low + ambient * (high - low) + heating * population.self_heating_k - population.reference_c
    rows, shifts = [], []
    for side, kind in enumerate(pair):
        signals, starts = lights.members[kind], members.rows[kind]
        at = np.minimum((chosen[:, side] * signals.size).astype(int), signals.size - 1)
        width = np.minimum((chosen[:, 2 + side] * len(population.width)).astype(int), len(population.width) - 1)
        drifts = np.array([population.drift(kind, lights.names[s]) for s in signals], dtype=float)
        own = np.array([population.own_nm(kind, lights.names[s]) for s in signals])
        rows.append(starts[at * len(population.width) + width])
        shifts.append(drifts[at] * warmer[:, side] + own[at, 0] + u[:, side] * (own[at, 1] - own[at, 0]))
    offs, which = _drawn_offs(design, edge[:, 0], film[:, 0])
    found = np.empty(n)
    for number in np.unique(which):
        response = imager.imager.smooth(design.curves(offs[number]))[0]
        some = np.flatnonzero(which == number)
        case = np.minimum((place[some, 0] * len(response)).astype(int), len(response) - 1)
        sides = [_at(response, case, rows[k][some], members.steps_of(shifts[k][some])) for k in range(2)]
        found[some] = np.linalg.norm(sides[0] - sides[1], axis=1)
    return found


def _drawn_offs(design: Candidate, edge: FloatArray, film: FloatArray) -> tuple[list[Off], IndexArray]:
    """How filters come out, and which of these each draw is: from numbers in 0..1, ndarray[n_draws] each."""
    tolerance = design.tolerance if design.space.filter is not None else Tolerance()
    kinds = tolerance.edge_shift_nm > 0, tolerance.thickness > 0
    parts = _PARTS_OF_BOTH if all(kinds) else _PARTS
    edges, films = (parts if kind else 1 for kind in kinds)
    middles = [[(2 * number + 1) / count - 1 for number in range(count)] for count in (edges, films)]
    places = [np.minimum((drawn * count).astype(np.intp), count - 1) for drawn, count in ((edge, edges), (film, films))]
    return [tolerance.at(one, other) for one in middles[0] for other in middles[1]], places[0] * films + places[1]


def _at(response: FloatArray, case: Any, rows: Any, steps: FloatArray) -> FloatArray:
    """What spectra give that are shifted by so many steps from the first of their rows, ndarray[n, n_channels]."""
    below = np.floor(steps).astype(int)
    share = (steps - below)[:, None]
    last = response.shape[1] - 1
    low, high = response[case, rows + below], response[case, np.minimum(rows + below + 1, last)]
    return np.asarray(low + share * (high - low), dtype=float)


def yield_interval(kept: int, n: int) -> tuple[float, float]:
    """The 95 % interval of a share, of which `kept` of `n` were counted (Wilson, J. Am. Stat. Assoc. 22, 209, 1927)."""
    share, z = kept / n, _Z**2 / n
    middle, half = share + z / 2, _Z * math.sqrt(share * (1 - share) / n + z / (4 * n))
    return max(0.0, (middle - half) / (1 + z)), min(1.0, (middle + half) / (1 + z))
