"""Evaluate filters given as curves by the forward model, quantities and constraints of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import DataError, SweepError, ValidationIssue, nearest
from ..camera.exposure import largest_sensitivity_not_brightest
from ..camera.setup import Setup
from ..designs.families.stopband import Stopband
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.columns.sensitivity import SENSITIVITY
from ..metrics.quantity import Column, Columns
from ..search.problem import Problem
from ..search.upper_bound import UpperBound, reason_without_bound, upper_bound_of
from ..study import Study

if TYPE_CHECKING:
    import pandas as pd


def with_units(table: pd.DataFrame, columns: Mapping[str, Column]) -> pd.DataFrame:
    """Add units and meanings of the quantities to the attributes of a table."""
    present = {name: column for name, column in columns.items() if name in table}
    table.attrs["units"] = {name: column.unit for name, column in present.items()}
    table.attrs["meanings"] = {name: column.meaning for name, column in present.items()}
    return table


def replaced_curves(study: Study, cfa: str, channels: Sequence[str], base: str | None) -> dict[str, str]:
    """Return the curve that each modified channel replaces."""
    stated = {
        channel: curve
        for space in study.spaces
        if space.filter is not None and space.cfa == cfa
        for channel, curve in space.filter.bases.items()
    }
    curve_names = dict(study.section.cfas[cfa].curves)
    bases = {}
    for channel in channels:
        default = curve_names.get(channel, study.sensor.curve_name(cfa, channel))
        curve = base or stated.get(channel) or (default if default in study.sensor.qe else None)
        if curve is None:
            known = ", ".join(study.sensor.qe)
            raise DataError(ValidationIssue(f"which curve does {channel} of {cfa} replace?", key="base", allowed=known))
        study.sensor.curve(curve)  # raises for an unknown name
        bases[channel] = curve
    return bases


def known_scenario(study: Study, name: str) -> str:
    """Return the name of a scenario; raises SweepError for an unknown one."""
    known = list(study.scenarios)
    if name not in known:
        issue = ValidationIssue("unknown scenario", value=name, allowed=", ".join(known), nearest=nearest(name, known))
        raise SweepError(issue)
    return name


def known_cfa(study: Study, name: str, channels: Sequence[str]) -> str:
    """Return the name of a CFA that has some channels; raises SweepError for another one."""
    known = [cfa for cfa, mosaic in study.mosaics.items() if set(channels) <= set(mosaic.channels)]
    if name not in known:
        problem, near = f"no CFA of the study with a channel {' and '.join(channels)}", nearest(name, study.mosaics)
        raise SweepError(ValidationIssue(problem, value=name, allowed=", ".join(known), nearest=near))
    return name


def find_cfa(study: Study, channels: Sequence[str]) -> str:
    """Return the CFA with these channels: the one that the study modifies in them, or the only one."""
    candidates = [name for name, mosaic in study.mosaics.items() if set(channels) <= set(mosaic.channels)]
    modified = {s.cfa for s in study.spaces if s.filter is not None and set(s.filter.channels) == set(channels)}
    channel_names = " and ".join(channels)
    if not candidates:
        known = list(dict.fromkeys(channel for mosaic in study.mosaics.values() for channel in mosaic.channels))
        near = nearest(channels[0], known)
        raise DataError(
            ValidationIssue(
                f"no CFA of the study has a channel {channel_names}", None, None, None, None, ", ".join(known), near
            )
        )
    chosen = [name for name in candidates if name in modified] or candidates
    if len(chosen) > 1:
        raise DataError(
            ValidationIssue(f"several CFAs have a channel {channel_names}", key="cfa", allowed=", ".join(chosen))
        )
    return chosen[0]


def table_of_results(study: Study, rows: Sequence[tuple[str, str, str, Columns]]) -> pd.DataFrame:
    """Return the quantities of evaluated designs as a table, one row per design."""
    import pandas as pd  # noqa: PLC0415  (slow to import: kept off the start-up path)

    parts = []
    for name, cfa, scenario, columns in rows:
        labels: dict[str, Any] = {"name": name, "cfa": cfa, "scenario": scenario}
        feasible = {"feasible": columns["violation"] <= FEASIBLE}
        parts.append(pd.DataFrame(labels | columns | feasible | {"violated": _violated(study, columns)}))
    return with_units(pd.concat(parts, ignore_index=True), study.quantities)


def _violated(study: Study, columns: Columns) -> list[str]:
    """Return the names of the constraints that each design does not meet, or of which it is not known."""
    unmet = {name: ~(bound.violation(columns[name]) <= FEASIBLE) for name, bound in study.constraints.items()}
    return [", ".join(name for name in unmet if unmet[name][row]) for row in range(len(columns["violation"]))]


def any_filter_search(study: Study, setup: Setup) -> Problem:
    """Return the problem of the best filter of any shape below the curve that it replaces."""
    base = setup.camera.base_qe[0]
    # The upper bound uses only the range of a family's filters.
    family = Stopband(study.grid.nodes_nm, base, np.zeros_like(base))
    low, high = (np.array([getattr(p, end) for p in family.parameters], dtype=float) for end in ("low", "high"))
    return Problem(
        setup,
        family,
        low,
        high,
        study.objective,
        study.constraints,
        tolerance=study.tolerance,
        states=study.states,
        user_metrics=study.user_metrics,
    )


def with_lower_bound(problem: Problem, quantity: str, value: float) -> Problem:
    """Return a problem with one more lower bound."""
    old = problem.constraints.get(quantity)
    lower = value if old is None or old.min is None else max(value, old.min)
    bound = Bound(min=lower, max=None if old is None else old.max)
    return replace(problem, constraints={**problem.constraints, quantity: bound})


def with_exposure_unchanged(problem: Problem) -> Problem:
    """Restrict a problem to filters that are not the brightest channel on white, which would set the exposure."""
    most = min(1.0, largest_sensitivity_not_brightest(problem.setup))
    old = problem.constraints.get(SENSITIVITY)
    upper = most if old is None or old.max is None else min(most, old.max)
    bound = Bound(min=None if old is None else old.min, max=upper)
    return replace(problem, constraints={**problem.constraints, SENSITIVITY: bound})


def upper_bound_or_reason(problem: Problem) -> tuple[UpperBound | None, str]:
    """Compute the upper bound of a problem, or state why there is none."""
    reason = reason_without_bound(problem)
    return (upper_bound_of(problem), "") if reason is None else (None, reason)
