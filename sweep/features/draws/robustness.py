"""Robustness of designs over the population of the lights: scale at which they break, and yield."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ...base.types import Array, Float, delayed
from ...camera.setup import Setup
from ...designs.space import Space
from ...designs.tolerance import AS_DESIGNED, NONE, ProductionError, Tolerance
from ...metrics.drawn_sensors import fresh_samples
from ...metrics.members import PopulationModel, population_model
from ...metrics.separation import csd_name
from ...metrics.share import share_interval
from ...results.tables import REFERENCE
from ...runs.analysis import Calls, NamedDesign, named_designs, table_of_calls
from ...spectra.lights import Pair
from ...study import Study
from . import ROBUSTNESS

if TYPE_CHECKING:
    import pandas as pd

_LARGEST, _STEP, _HALVINGS = 3.0, 0.25, 6
"""Times the population that are looked at, the steps in which, and how often the last of these is halved."""
_SCHEMA = pa.schema(
    [
        ("design_id", pa.int64()),
        *(
            (name, pa.float64())
            for name in ("breaks_at", "breaks_dn", "breaks_edge_nm", "breaks_thickness", "breaks_broadening")
        ),
        *((name, pa.string()) for name in ("breaks_first", "breaks_second")),
        *((name, pa.float64()) for name in ("breaks_first_nm", "breaks_second_nm", "breaks_low_c", "breaks_high_c")),
        *((name, pa.float64()) for name in ("yield", "yield_low", "yield_high")),
    ]
)


@dataclass(frozen=True)
class Candidate:
    """Design in a scene, with parameters of shape (1, n_parameters) and the tolerance of production."""

    setup: Setup
    space: Space
    point: Float[Array, "1 parameters"]
    tolerance: Tolerance

    def population_model(self, scale: float) -> PopulationModel:
        """Return the scene with a scaled population of its lights."""
        population = self.setup.lights.population
        assert population is not None
        return population_model(
            replace(self.setup, lights=replace(self.setup.lights, population=population.scaled(scale)))
        )

    def curves(self, production_error: ProductionError) -> Float[Array, "1 modified wavelengths"]:
        """Return the filters as production makes them."""
        return np.asarray(self.space.curves(self.point, self.setup.camera.grid.size, production_error), dtype=float)

    def worst(self, pair: Pair, scale: float) -> tuple[float, ProductionError]:
        """Return the smallest CSD over a scaled population and scaled tolerances."""
        model, has_filter = self.population_model(scale), self.space.filter is not None
        errors = self.tolerance.scaled(scale).places if has_filter else (AS_DESIGNED,)
        csds = model.worst(np.concatenate([self.curves(error) for error in errors]), [pair])[csd_name(pair)]
        at = int(csds.argmin())
        return float(csds[at]), errors[at]


def _pair(study: Study) -> Pair | None:
    """Return the two signal types of the Pareto front where the study has a population of lights; else None."""
    return None if study.lights.population is None else study.quantities[study.trade_off[0]].pair


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Compute robustness and yield of designs.

    `breaks_at` is the factor of the population and the tolerances at which the worst CSD falls below that of the plain
    CFA that has most at 1 (null if it does not up to 3, in steps of 0.25), with CSD, lights, shifts and temperature
    there; `yield` is the share of lamps and cameras with the wanted CSD, with its 95 % interval (Wilson, 1927).
    """
    pair = _pair(study)
    assert pair is not None
    designs = [*named_designs(study, rows)]
    for design in designs:
        plain = [
            other
            for other in designs
            if other.row["kind"] == REFERENCE and other.row["scenario"] == design.row["scenario"]
        ]
        best = max(plain, key=lambda other: other.row[f"worst_{csd_name(pair)}"], default=design)
        rival = None if best is design else candidate_of(study, best)
        yield design.key, delayed(_robustness, candidate_of(study, design), rival, pair, study.section.seed)


def candidate_of(study: Study, design: NamedDesign) -> Candidate:
    """Return a named design with the production errors of its study."""
    point = np.array([[design.row[name] for name in design.space.parameters]], dtype=float)
    return Candidate(design.setup, design.space, point, study.tolerance)


def _robustness(design: Candidate, rival: Candidate | None, pair: Pair, seed: int) -> list[dict[str, float | str]]:
    """Return numbers, and names of lights, of a design by column."""
    found: dict[str, float | str] = {} if rival is None else _breaks(design, rival, pair)
    population = design.setup.lights.population
    assert population is not None
    if population.wanted_dn is not None:
        has_it = drawn_dn(design, pair, seed) >= population.wanted_dn
        low, high = share_interval(int(has_it.sum()), has_it.size)
        found |= {"yield": float(has_it.mean()), "yield_low": low, "yield_high": high}
    return [found]


def _breaks(design: Candidate, rival: Candidate, pair: Pair) -> dict[str, float | str]:
    """Return the scale at which a design first falls below a rival, and its causes."""

    def below(scale: float) -> bool:
        return design.worst(pair, scale)[0] < rival.worst(pair, scale)[0]

    scale = _first(below)
    if scale is None:
        return {}
    least, production_error = design.worst(pair, scale)
    model = design.population_model(scale)
    response = model.linear.smooth(design.curves(production_error))[0]
    near = min((model.nearest(case, pair) for case in response), key=lambda pairs: float(pairs.squared.min()))
    at = np.unravel_index(int(near.squared.argmin()), near.squared.shape)
    lights, population = design.setup.lights, design.population_model(scale).members.population
    found: dict[str, float | str] = {
        "breaks_at": scale,
        "breaks_dn": least,
        "breaks_edge_nm": production_error.shift_nm,
    }
    found |= {"breaks_thickness": production_error.thickness, "breaks_broadening": production_error.broadening}
    warm = []
    for side, (name, starts) in enumerate((("first", near.first), ("second", near.second))):
        signal = model.members.signal(int(starts[at[side]]))
        nm = model.members.shift_nm(int(near.steps[at][side]), float(near.shares[at][side]))
        found |= {f"breaks_{name}": lights.names[signal], f"breaks_{name}_nm": nm}
        warm.append(population.temperature_of(lights.types[signal], lights.names[signal], nm))
    together = max(low for low, _ in warm), min(high for _, high in warm)
    if population.temperatures == "common":
        found |= {"breaks_low_c": together[0], "breaks_high_c": together[1]}
    return found


def _first(below: Callable[[float], bool]) -> float | None:
    """Return the smallest scale, in steps of `_STEP`, at which a condition holds, refined to 2^-_HALVINGS of a step."""
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


def drawn_dn(design: Candidate, pair: Pair, seed: int) -> Float[Array, " draws"]:
    """Return the CSD of random lamps and cameras, before clipping and rounding; equal draws for all designs.

    No search has looked at these draws.
    """
    tolerance, parts = design.tolerance if design.space.filter is not None else NONE, []
    for sample in fresh_samples(design.setup, tolerance, seed):
        curves = np.concatenate([design.curves(production_error) for production_error in sample.production_errors])
        parts.append(sample.distances(curves, [pair])[pair])
    return np.concatenate(parts)


ROBUST = table_of_calls(
    ROBUSTNESS, "robustness", lambda study: _pair(study) is not None, lambda _: _SCHEMA, _calls, is_kept=True
)
