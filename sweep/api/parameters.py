"""Designs by the parameters of a family of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import SweepError, ValidationIssue, nearest
from ..designs.family import Parameter
from ..designs.space import Space
from ..designs.ungridded import PairedDesigns
from ..metrics.bound import total_violation
from ..study import Study
from .user_filters import table_of_results

if TYPE_CHECKING:
    import pandas as pd

OWN = "own"
"""Name of designs that are no part of the study."""


def plain_and_named(study: Study, cfa: str | None) -> list[Space]:
    """Return plain CFAs and named designs, of one CFA or of all."""
    from ..results.tables import NAMED, REFERENCE

    named = [space for space in study.spaces if space.kind in (REFERENCE, NAMED)]
    spaces = [space for space in named if cfa in (None, space.cfa)]
    if not spaces:
        known = list(dict.fromkeys(space.cfa for space in named))
        near = None if cfa is None else nearest(cfa, known)
        issue = ValidationIssue("no plain CFA or named design", value=cfa, allowed=", ".join(known), nearest=near)
        raise SweepError(issue)
    return spaces


def evaluate_spaces(study: Study, spaces: Sequence[Space], scenarios: Sequence[str]) -> pd.DataFrame:
    """Return a row per design and scenario of some spaces of a study."""
    from ..runs.routes import quantities_at
    from ..runs.rows import rules_of

    rules, rows = rules_of(study), []
    for name in scenarios:
        for space in spaces:
            points = space.points(0, space.size)
            numbers, setup = np.arange(space.size), study.setup(space, name)
            values, issues = quantities_at(space, numbers, setup, rules, rules.wanted)
            for text in issues.values():
                raise SweepError(ValidationIssue(f"{space.name} in {name}: {text}"))
            worst = total_violation(values, study.constraints, space.violation(points))
            unknown = np.full(space.size, np.nan)  # of a lamp that is not pulsed in this scenario
            columns = dict(zip(space.parameters, points.T, strict=True)) if space.name == OWN else {}
            columns |= {quantity: values.get(quantity, unknown) for quantity in study.quantities}
            rows.append((space.name, space.cfa, name, columns | {"violation": worst}))
    return table_of_results(study, rows)


def are_parameters(study: Study, filters: Mapping[str, object]) -> bool:
    """Return whether filters are given by parameters of a family; raises SweepError for curves beside them."""
    parameters = {name for space in study.spaces for name in space.parameters}
    channels = {channel for mosaic in study.mosaics.values() for channel in mosaic.channels}
    numbers = {name for name, value in filters.items() if isinstance(value, int | float | np.number)}
    if not parameters or not (numbers - channels or parameters & filters.keys()):
        return False
    if others := filters.keys() - parameters:
        raise SweepError(_unknown("parameter", min(others), sorted(parameters)))
    return True


def designs_of_parameters(study: Study, cfa: str | None, parameters: Mapping[str, Any]) -> Space:
    """Return designs of a family of the study: that of the search, or the first with these parameters."""
    searched = [] if study.search is None else [study.search.space]
    spaces = [s for s in (*searched, *study.spaces) if s.filter is not None and cfa in (None, s.cfa)]
    space = next((s for s in spaces if parameters.keys() <= set(s.parameters)), None)
    if space is None or space.filter is None:
        allowed = "; ".join(dict.fromkeys(f"{s.cfa}: {', '.join(s.parameters)}" for s in spaces)) or "none"
        problem = f"no filter of the study{f' on {cfa}' if cfa else ''} has these parameters together"
        raise SweepError(ValidationIssue(problem, value=list(parameters), allowed=allowed))
    axes = [_values(parameter, parameters.get(parameter.name)) for parameter in space.filter.family.parameters]
    size = max(map(len, axes))
    if {len(axis) for axis in axes} - {1, size}:
        counts = {p: len(axis) for p, axis in zip(space.parameters, axes, strict=True)}
        raise SweepError(ValidationIssue("as many values of each parameter, or one", value=counts))
    return Space("design", OWN, space.cfa, space.filter, tuple(axes), gridded=False, rows=PairedDesigns(size))


def _values(parameter: Parameter, stated: Any) -> tuple[float, ...]:
    """Return the values of a parameter, its default where none is stated."""
    allowed, stated = f"{parameter.low:g} to {parameter.high:g}", parameter.default if stated is None else stated
    if stated is None:
        raise SweepError(ValidationIssue("missing", key=parameter.name, allowed=allowed))
    try:
        values = np.asarray(stated, dtype=float).ravel()
    except (TypeError, ValueError):
        issue = ValidationIssue("not a number, nor several", key=parameter.name, value=stated, allowed=allowed)
        raise SweepError(issue) from None
    outside = values[~((values >= parameter.low) & (values <= parameter.high))]
    if outside.size or not values.size:
        value = outside[:1].tolist()
        raise SweepError(ValidationIssue("out of range", key=parameter.name, value=value, allowed=allowed))
    return tuple(values.tolist())


def _unknown(what: str, name: str, known: Sequence[str]) -> ValidationIssue:
    return ValidationIssue(f"unknown {what}", value=name, allowed=", ".join(known), nearest=nearest(name, known))
