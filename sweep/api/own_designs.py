"""Designs that are no part of a study: by the parameters of one of its families, or by their curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import SweepError, ValidationIssue, nearest
from ..base.types import DesignCurves, DesignParameters
from ..designs.family import Family, Parameter
from ..designs.space import Filter, Space
from ..designs.technology import Technology
from ..metrics.bound import total_violation
from ..metrics.objective import COMBINED
from ..metrics.quantity import Columns
from ..study import Study
from .user_filters import table_of_results

if TYPE_CHECKING:
    import pandas as pd

OWN = "own"
"""Name of designs that are no part of the study."""
_MOST_QE = 1 + 1e-9


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
    return table_of_results(
        study, [(space.name, space.cfa, name, columns_of(study, space, name)) for name in scenarios for space in spaces]
    )


def columns_of(study: Study, space: Space, scenario: str) -> Columns:
    """Return parameters, every quantity and the violation of the designs of a space; NaN where one is unknown.

    Raises SweepError for a design that fails.
    """
    from ..runs.routes import Wanted, quantities_at
    from ..runs.rows import rules_of

    rules, points = rules_of(study), space.points(0, space.size)
    given = space.filter is not None and isinstance(space.filter.family, GivenCurves)
    wanted = rules.wanted
    if given and study.tolerance:  # what production makes of edges that are not known
        known = {name: quantity for name, quantity in rules.quantities.items() if not quantity.extreme}
        if not study.objective.weights.keys() <= known.keys():
            known.pop(COMBINED, None)
        wanted = Wanted.of(known, rules.requested, rules.shown)
    values, issues = quantities_at(space, np.arange(space.size), study.setup(space, scenario), rules, wanted)
    for text in issues.values():
        raise SweepError(ValidationIssue(f"{space.name} in {scenario}: {text}"))
    unknown = np.full(space.size, np.nan)  # of a lamp that is not pulsed in this scenario, of a width of no edges
    columns = dict(zip(space.parameters, points.T, strict=True)) if space.name == OWN and not given else {}
    columns |= {quantity: values.get(quantity, unknown) for quantity in study.quantities}
    return columns | {"violation": total_violation(columns, study.constraints, space.violation(points))}


class GivenCurves(Family):
    """Filters by their curves, one after another."""

    kind = "curves"

    def __init__(self, curves: DesignCurves) -> None:
        if not curves.max(initial=0.0) <= _MOST_QE:
            allowed = "0 to 1; a transmission is relative to a curve (`relative_to`), percent are divided by 100"
            raise SweepError(ValidationIssue("a QE above 1", value=round(float(curves.max()), 6), allowed=allowed))
        self._curves, self.parameters = curves, (Parameter("number", 0, len(curves) - 1),)

    def curves(self, x: DesignParameters) -> DesignCurves:
        """Return those of these numbers."""
        return self._curves[x[:, 0].astype(np.intp)]


def designs_of_curves(study: Study, cfa: str, bases: Mapping[str, str], curves: DesignCurves) -> Space:
    """Return designs by their QE in channels of a CFA, with the technology that the study states for these.

    `bases`: modified channel -> curve that it replaces.
    """
    filters = [s.filter for s in study.spaces if s.filter is not None and s.cfa == cfa]
    stated = {repr(f.technology): f.technology for f in filters if bases.keys() & set(f.channels)}
    if len(stated) > 1:
        several = ", ".join("none" if technology is None else technology.description for technology in stated.values())
        problem = f"several technologies are stated for {' and '.join(bases)} of {cfa}"
        raise SweepError(ValidationIssue(problem, value=several))
    return space_of_curves(cfa, bases, curves, next(iter(stated.values()), None))


def space_of_curves(cfa: str, bases: Mapping[str, str], curves: DesignCurves, technology: Technology | None) -> Space:
    """Return designs by their QE in channels of a CFA."""
    filter_ = Filter(GivenCurves(curves), bases, "", technology)
    return Space("design", OWN, cfa, filter_, (tuple(map(float, range(len(curves)))),))


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
    return Space("design", OWN, space.cfa, space.filter, tuple(axes), gridded=False, listed=size)


def _values(parameter: Parameter, stated: Any) -> tuple[float, ...]:
    """Return the values of a parameter, its default where none is stated."""
    allowed, stated = f"{parameter.low:g} to {parameter.high:g}", parameter.default if stated is None else stated
    if stated is None:
        raise SweepError(ValidationIssue("missing", key=parameter.name, allowed=allowed))
    try:
        values = np.asarray(stated, dtype=float).ravel()
    except (TypeError, ValueError, OverflowError):
        issue = ValidationIssue("not a number, nor several", key=parameter.name, value=stated, allowed=allowed)
        raise SweepError(issue) from None
    outside = values[~((values >= parameter.low) & (values <= parameter.high))]
    if outside.size or not values.size:
        value = outside[:1].tolist()
        raise SweepError(ValidationIssue("out of range", key=parameter.name, value=value, allowed=allowed))
    return tuple(values.tolist())


def _unknown(what: str, name: str, known: Sequence[str]) -> ValidationIssue:
    return ValidationIssue(f"unknown {what}", value=name, allowed=", ".join(known), nearest=nearest(name, known))
