"""Filters that no family makes, judged as a study judges its own: the same image chain, quantities and constraints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..base.errors import DataError, Fault, nearest
from ..base.types import FloatArray
from ..camera.exposure import leaves_exposure
from ..camera.forward import forward_model
from ..camera.setup import Setup
from ..curves.lights import class_pairs
from ..designs.families.stopband import Stopband
from ..designs.family import Family
from ..metrics.bound import FEASIBLE, Bound, total_violation
from ..metrics.columns.sensitivity import SENSITIVITY
from ..metrics.evaluate import evaluate, family_quantities, image_quantities
from ..metrics.objective import COMBINED
from ..metrics.quantity import WORST, YIELD, Column, Columns
from ..search.limit import Limit, limit_of, why_not
from ..search.problem import Problem
from ..study import Study

if TYPE_CHECKING:
    import pandas as pd

_MOST_QE = 1 + 1e-9


def with_units(table: pd.DataFrame, columns: Mapping[str, Column]) -> pd.DataFrame:
    """The table with `units` and `meanings` of its quantities in its attributes."""
    own = {name: column for name, column in columns.items() if name in table}
    table.attrs["units"] = {name: column.unit for name, column in own.items()}
    table.attrs["meanings"] = {name: column.meaning for name, column in own.items()}
    return table


def bases_of(study: Study, cfa: str, channels: Sequence[str], base: str | None) -> dict[str, str]:
    """Modified channel -> the curve that it replaces: `base`, what the study says of the channel, or its own curve.

    Raises DataError where nothing says it.
    """
    said = {
        channel: curve
        for space in study.spaces
        if space.filter is not None and space.cfa == cfa
        for channel, curve in space.filter.bases.items()
    }
    named = dict(study.section.cfas[cfa].curves)
    found = {}
    for channel in channels:
        own = named.get(channel, study.sensor.curve_name(cfa, channel))
        curve = base or said.get(channel) or (own if own in study.sensor.qe else None)
        if curve is None:
            known = ", ".join(study.sensor.qe)
            raise DataError(Fault(f"which curve does {channel} of {cfa} replace?", key="base", allowed=known))
        study.sensor.curve(curve)  # raises for a name that is none
        found[channel] = curve
    return found


def setup_with(study: Study, cfa: str, scenario: str, bases: Mapping[str, str]) -> Setup:
    """A scene for own filters: of the technology that the study states for its own ones in these channels.

    Raises DataError where it states several.
    """
    own = [s.filter for s in study.spaces if s.filter is not None and s.cfa == cfa]
    stated = {repr(f.technology): f.technology for f in own if bases.keys() & set(f.channels)}
    if len(stated) > 1:
        several = ", ".join("none" if made is None else made.told for made in stated.values())
        raise DataError(Fault(f"several technologies are stated for {' and '.join(bases)} of {cfa}", value=several))
    return study.setup_of(cfa, scenario, bases, next(iter(stated.values()), None))


def cfa_with(study: Study, channels: Sequence[str]) -> str:
    """The CFA that has these channels: the one that the study modifies in them, or the only one.

    Raises DataError where there is none, or more than one.
    """
    own = [name for name, mosaic in study.mosaics.items() if set(channels) <= set(mosaic.channels)]
    modified = {s.cfa for s in study.spaces if s.filter is not None and set(s.filter.channels) == set(channels)}
    wanted = " and ".join(channels)
    if not own:
        known = list(dict.fromkeys(channel for mosaic in study.mosaics.values() for channel in mosaic.channels))
        near = nearest(channels[0], known)
        raise DataError(
            Fault(f"no CFA of the study has a channel {wanted}", None, None, None, None, ", ".join(known), near)
        )
    chosen = [name for name in own if name in modified] or own
    if len(chosen) > 1:
        raise DataError(Fault(f"several CFAs have a channel {wanted}", key="cfa", allowed=", ".join(chosen)))
    return chosen[0]


def judged(study: Study, setup: Setup, curves: FloatArray) -> Columns:
    """Every quantity of filters in the modified channels of a setup, and `violation` of the study's constraints.

    `curves`: QE, ndarray[n_designs, n_modified, n_wavelengths]. What only a family's parameters say (edges, bands,
    their shifts in production) is NaN. Raises DataError for a QE above 1.
    """
    if not curves.max(initial=0.0) <= _MOST_QE:
        allowed = "0 to 1; a transmission is relative to a curve (`relative_to`), percent are divided by 100"
        raise DataError(Fault("a QE above 1", value=round(float(curves.max()), 6), allowed=allowed))
    asked = study.asked
    found = evaluate(forward_model(setup), curves, asked.states, probabilities=asked.probabilities, own=asked.own)
    if setup.lights.population is not None and not study.tolerance:
        from ..metrics.members import population_imager  # noqa: PLC0415  (only where lights have a population)

        found |= {WORST + name: values for name, values in population_imager(setup).worst(curves).items()}
        if asked.wanted_yield:
            from ..metrics.drawn import LampsAndCameras  # noqa: PLC0415

            drawn = LampsAndCameras(population_imager(setup), study.tolerance, study.section.seed)
            kept = drawn.columns(lambda _, some: curves[some], len(curves), class_pairs(setup.lights.classes))
            found |= {YIELD + name: values for name, values in kept.items()}
    found |= family_quantities(None, np.empty((len(curves), 0)))
    found |= image_quantities(setup, curves, study.section.vision, study.section.seed)
    lacking = np.full(len(curves), np.nan)
    columns = {name: found.get(name, lacking) for name in study.quantities if name != COMBINED}
    if COMBINED in study.quantities:
        columns[COMBINED] = study.objective.of(columns)
    own = np.zeros(len(curves))
    return columns | {"violation": total_violation(columns, study.constraints, own)}


def table_of(study: Study, rows: Sequence[tuple[str, str, str, Columns]]) -> pd.DataFrame:
    """Return a table with a row per design: (name, CFA, scenario, columns) of each block of designs.

    A design with an unknown constrained quantity, such as a width of edges, is not feasible.
    """
    import pandas as pd  # noqa: PLC0415  (slow to import: kept off the start-up path)

    parts = []
    for name, cfa, scenario, columns in rows:
        labels: dict[str, Any] = {"name": name, "cfa": cfa, "scenario": scenario}
        parts.append(pd.DataFrame(labels | columns | {"feasible": columns["violation"] <= FEASIBLE}))
    return with_units(pd.concat(parts, ignore_index=True), study.quantities)


def any_filter(study: Study, setup: Setup) -> Problem:
    """The problem of the best filter between nothing and the curve that it replaces, under the study's constraints."""
    base = setup.camera.base_qe[0]
    # The limit asks a family only for how large and how small its filters can be.
    family = cast(Family, Stopband(study.grid.nodes_nm, base, np.zeros_like(base)))
    low, high = (np.array([getattr(p, end) for p in family.parameters], dtype=float) for end in ("low", "high"))
    return Problem(
        setup,
        family,
        low,
        high,
        study.objective,
        study.constraints,
        edge_shift_nm=study.tolerance.edge_shift_nm,
        states=study.states,
        thickness=study.tolerance.thickness,
        own=study.own,
        vision=study.images,
    )


def at_least(problem: Problem, quantity: str, value: float) -> Problem:
    """The problem with a further lower end of a quantity."""
    old = problem.constraints.get(quantity)
    lower = value if old is None or old.min is None else max(value, old.min)
    bound = Bound(min=lower, max=None if old is None else old.max)
    return replace(problem, constraints={**problem.constraints, quantity: bound})


def as_exposed(problem: Problem) -> Problem:
    """The problem of filters that are not the brightest on white, and so leave the exposure to other pixels."""
    most = min(1.0, leaves_exposure(problem.setup))
    old = problem.constraints.get(SENSITIVITY)
    bound = Bound(
        min=None if old is None else old.min, max=most if old is None or old.max is None else min(most, old.max)
    )
    return replace(problem, constraints={**problem.constraints, SENSITIVITY: bound})


def limit_or_reason(problem: Problem) -> tuple[Limit | None, str]:
    """The limit, or why there is none."""
    reason = why_not(problem)
    return (limit_of(problem), "") if reason is None else (None, reason)
