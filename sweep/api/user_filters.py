"""Evaluate filters given as curves by the forward model, quantities and constraints of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import DataError, SweepError, ValidationIssue, nearest
from ..base.types import DesignCurves
from ..camera.exposure import largest_sensitivity_not_brightest
from ..camera.model import scene_model
from ..camera.setup import Setup
from ..designs.families.stopband import Stopband
from ..metrics.bound import FEASIBLE, Bound, total_violation
from ..metrics.columns.sensitivity import SENSITIVITY
from ..metrics.evaluate import evaluate
from ..metrics.objective import COMBINED
from ..metrics.quantity import WORST, YIELD, Column, Columns
from ..search.limit import Limit, limit_of, reason_without_bound
from ..search.problem import Problem
from ..spectra.lights import class_pairs
from ..study import Study
from ..vision.section import SeededVision

if TYPE_CHECKING:
    import pandas as pd

_MOST_QE = 1 + 1e-9


def with_units(table: pd.DataFrame, columns: Mapping[str, Column]) -> pd.DataFrame:
    """Add units and meanings of the quantities to the attributes of a table.

    Parameters
    ----------
    table : pandas.DataFrame
        One column per quantity; changed in place.
    columns : mapping of str to Column
        Definitions of quantities.

    Returns
    -------
    pandas.DataFrame
        The same table, with ``attrs["units"]`` and ``attrs["meanings"]``.
    """
    present = {name: column for name, column in columns.items() if name in table}
    table.attrs["units"] = {name: column.unit for name, column in present.items()}
    table.attrs["meanings"] = {name: column.meaning for name, column in present.items()}
    return table


def replaced_curves(study: Study, cfa: str, channels: Sequence[str], base: str | None) -> dict[str, str]:
    """Return the curve that each modified channel replaces.

    Parameters
    ----------
    study : Study
        Sensor and design spaces.
    cfa : str
        CFA with the channels.
    channels : sequence of str
        Modified channels.
    base : str, optional
        Curve that is replaced. Left out, the one that the study states for the channel, or the channel's own curve.

    Returns
    -------
    dict of str to str
        Channel to name of a sensor curve.

    Raises
    ------
    DataError
        If the curve of a channel is not stated, or unknown.
    """
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


def user_filter_setup(study: Study, cfa: str, scenario: str, bases: Mapping[str, str]) -> Setup:
    """Return scene and camera for user filters, with the technology that the study states for these channels.

    Parameters
    ----------
    study : Study
        Sensor, scenes and design spaces.
    cfa, scenario : str
        Names of a CFA and a scenario of the study.
    bases : mapping of str to str
        Modified channel to the curve that it replaces.

    Returns
    -------
    Setup
        Input of the forward model.

    Raises
    ------
    DataError
        If the study states several technologies for these channels.
    """
    filters = [s.filter for s in study.spaces if s.filter is not None and s.cfa == cfa]
    stated = {repr(f.technology): f.technology for f in filters if bases.keys() & set(f.channels)}
    if len(stated) > 1:
        several = ", ".join("none" if technology is None else technology.description for technology in stated.values())
        raise DataError(
            ValidationIssue(f"several technologies are stated for {' and '.join(bases)} of {cfa}", value=several)
        )
    return study.setup_of(cfa, scenario, bases, next(iter(stated.values()), None))


def find_cfa(study: Study, channels: Sequence[str]) -> str:
    """Return the CFA with these channels: the one that the study modifies in them, or the only one.

    Parameters
    ----------
    study : Study
        CFAs and design spaces.
    channels : sequence of str
        Names of channels.

    Returns
    -------
    str
        Name of the CFA.

    Raises
    ------
    DataError
        If no CFA, or more than one, has these channels.
    """
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


def evaluate_curves(study: Study, setup: Setup, curves: DesignCurves) -> Columns:
    """Compute every quantity of filters in the modified channels, and their violation of the constraints.

    Parameters
    ----------
    study : Study
        Quantities requested, objective and constraints.
    setup : Setup
        Scene and camera.
    curves : ndarray of shape (n_designs, n_modified, n_wavelengths)
        QE of each modified channel.

    Returns
    -------
    dict of str to ndarray of shape (n_designs,)
        Quantities by column name, and ``violation``. NaN where only the parameters of a family determine a quantity
        (widths of edges and bands, their shifts in production).

    Raises
    ------
    DataError
        If a QE exceeds 1.
    """
    if not curves.max(initial=0.0) <= _MOST_QE:
        allowed = "0 to 1; a transmission is relative to a curve (`relative_to`), percent are divided by 100"
        raise DataError(ValidationIssue("a QE above 1", value=round(float(curves.max()), 6), allowed=allowed))
    requested = study.requested
    values = evaluate(
        scene_model(setup),
        curves,
        requested.states,
        probabilities=requested.probabilities,
        user_metrics=requested.user_metrics,
        images=None if study.section.vision is None else SeededVision(study.section.vision, study.section.seed),
    )
    if setup.lights.population is not None and not study.tolerance:
        from ..metrics.members import population_model  # noqa: PLC0415  (only where lights have a population)

        values |= {WORST + name: worst for name, worst in population_model(setup).worst(curves).items()}
        if requested.wanted_yield:
            from ..metrics.drawn import LampsAndCameras  # noqa: PLC0415

            draws = LampsAndCameras(population_model(setup), study.tolerance, study.section.seed)
            yield_columns = draws.columns(
                lambda _, subset: curves[subset], len(curves), class_pairs(setup.lights.classes)
            )
            values |= {YIELD + name: column for name, column in yield_columns.items()}
    unknown = np.full(len(curves), np.nan)
    columns = {name: values.get(name, unknown) for name in study.quantities if name != COMBINED}
    if COMBINED in study.quantities:
        columns[COMBINED] = study.objective.of(columns)
    return columns | {"violation": total_violation(columns, study.constraints, np.zeros(len(curves)))}


def table_of_results(study: Study, rows: Sequence[tuple[str, str, str, Columns]]) -> pd.DataFrame:
    """Return the quantities of evaluated designs as a table, one row per design.

    Parameters
    ----------
    study : Study
        Definitions of the quantities.
    rows : sequence of (name, CFA, scenario, columns)
        Quantities of each block of designs, with ``violation``.

    Returns
    -------
    pandas.DataFrame
        Quantities, labels, ``feasible``, and the constraints that are ``violated``. A design with an unknown
        constrained quantity is not feasible.
    """
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
    """Return the problem of the best filter of any shape below the curve that it replaces.

    Parameters
    ----------
    study : Study
        Objective and constraints.
    setup : Setup
        Scene and camera with one modified channel.

    Returns
    -------
    Problem
        Input of the upper bound.
    """
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
        vision=study.images,
    )


def with_lower_bound(problem: Problem, quantity: str, value: float) -> Problem:
    """Return a problem with one more lower bound.

    Parameters
    ----------
    problem : Problem
        Problem with constraints.
    quantity : str
        Column name of the constrained quantity.
    value : float
        Lower bound, in the unit of the quantity.

    Returns
    -------
    Problem
        The problem under both constraints.
    """
    old = problem.constraints.get(quantity)
    lower = value if old is None or old.min is None else max(value, old.min)
    bound = Bound(min=lower, max=None if old is None else old.max)
    return replace(problem, constraints={**problem.constraints, quantity: bound})


def with_exposure_unchanged(problem: Problem) -> Problem:
    """Restrict a problem to filters that are not the brightest channel on white, which would set the exposure.

    Parameters
    ----------
    problem : Problem
        Problem with one modified channel.

    Returns
    -------
    Problem
        The problem with an upper bound on the sensitivity.
    """
    most = min(1.0, largest_sensitivity_not_brightest(problem.setup))
    old = problem.constraints.get(SENSITIVITY)
    upper = most if old is None or old.max is None else min(most, old.max)
    bound = Bound(min=None if old is None else old.min, max=upper)
    return replace(problem, constraints={**problem.constraints, SENSITIVITY: bound})


def upper_bound_or_reason(problem: Problem) -> tuple[Limit | None, str]:
    """Compute the upper bound of a problem, or state why there is none.

    Parameters
    ----------
    problem : Problem
        Problem with one modified channel.

    Returns
    -------
    limit : Limit or None
        The upper bound.
    reason : str
        Empty, or the reason why there is no bound.
    """
    reason = reason_without_bound(problem)
    return (limit_of(problem), "") if reason is None else (None, reason)
