"""Evaluation of one filter beside RGGB, the CFA that it changes, and the upper bound of any filter in its place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..base.types import DesignCurves, PerWavelength
from ..camera.exposure import may_be_brightest
from ..camera.mosaic import Mosaic
from ..designs.space import Space
from ..designs.tolerance import Tolerance
from ..metrics.bound import FEASIBLE
from ..metrics.columns.sensitivity import CFA_SENSITIVITY, reference_of
from ..metrics.objective import Objective
from ..metrics.quantity import Column, Columns
from ..metrics.separation import csd_name
from ..metrics.smooth import smooth_csd
from ..search.upper_bound import gap_between
from ..spectra.lights import Pair
from ..study import Study
from ..study.goals import brightness_note
from ..study.schema import CfaSection
from .own_designs import columns_of
from .user_filters import (
    any_filter_search,
    table_of_results,
    upper_bound_or_reason,
    with_exposure_unchanged,
    with_lower_bound,
)

if TYPE_CHECKING:
    import pandas as pd

PLAIN_TILE = "RGGB"
_FIRST = ("yellow", "red")
_SAME = 1e-9


@dataclass(frozen=True)
class FilterEvaluation:
    """Evaluation of one filter.

    Parameters
    ----------
    study : Study
        Scene, CFAs and lights of the evaluation, and the constraints that the filter is held against.
    rows : mapping of str to quantities
        Quantities of each CFA; the one with the filter is the last.
    notes : tuple of str
        Notes on the way files were read.
    before_quantization_dn : float or None
        CSD of the filter before quantization, DN, of yellow and red or else of the first pair.
    upper_bound : float or None
        Upper bound on that CSD, DN, for any filter between 0 and the curve `below`, of the same technology and with at
        least as much light. None if `no_upper_bound` states a reason.
    below : str
        Curve below which the bound holds.
    no_upper_bound : str
        Reason why there is no bound.
    """

    study: Study = field(repr=False)
    rows: Mapping[str, Columns] = field(repr=False)
    notes: tuple[str, ...]
    before_quantization_dn: float | None = None
    upper_bound: float | None = None
    below: str = ""
    no_upper_bound: str = ""

    @property
    def violated(self) -> list[str]:
        """Constraints that the filter does not meet, or of which it is not known, each with its value."""
        columns, violated = [*self.rows.values()][-1], []
        for name, bound in self.study.constraints.items():
            if not (bound.violation(columns[name]) <= FEASIBLE).all():
                value = f"{columns[name][0]:.4g}" if np.isfinite(columns[name][0]) else "unknown"
                violated.append(f"{name} {value} ({bound})")
        return violated

    @cached_property
    def table(self) -> pd.DataFrame:
        """Quantities with one row per CFA; units and meanings are in ``attrs``."""
        (scene,) = self.study.scenarios
        return table_of_results(self.study, [(cfa, cfa, scene, columns) for cfa, columns in self.rows.items()])

    @property
    def gap(self) -> float | None:
        """Distance of the filter to its upper bound, relative to the bound."""
        if self.upper_bound is None or self.before_quantization_dn is None or not self.upper_bound > 0:
            return None
        return gap_between(self.before_quantization_dn, self.upper_bound)

    problem: ClassVar[None] = None
    """An evaluation is no problem of the command, however bad the filter."""

    @property
    def lines(self) -> list[str]:
        """The text of `sweep evaluate`."""
        return [*(f"{note}." for note in self.notes), *self._lines()]

    @property
    def facts(self) -> dict[str, Any]:
        """The same as plain values."""
        return {
            "rows": self.table.to_dict("records"),
            "upper_bound_of": csd_name(_pair(self.study)),
            "upper_bound": self.upper_bound,
            "before_quantization_dn": self.before_quantization_dn,
            "gap": self.gap,
            "no_upper_bound": self.no_upper_bound,
            "constraints_of": self.study.name,
            "violated": self.violated,
            "notes": self.notes,
        }

    def __str__(self) -> str:
        """Return the text of `sweep evaluate`."""
        return "\n".join(self.lines)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"

    def _lines(self) -> Iterator[str]:
        study, first = self.study, _pair(self.study)
        pairs = sorted(study.pairs, key=lambda pair: pair != first)
        goal, *others = [study.quantities[csd_name(pair)].column for pair in pairs]
        yield from _aligned(self.rows, (goal, *others))
        if study.constraints:
            met = f"not met: {', '.join(self.violated)}" if self.violated else "met"
            stated = ", ".join(f"{name} {bound}" for name, bound in study.constraints.items())
            yield f"Constraints of the study {study.name} ({stated}): {met}."
        if brightest := study.sensor.brightest:
            yield f"Light: 1 = {reference_of(brightest)}."
        if self.upper_bound is None or self.before_quantization_dn is None:
            yield f"No upper bound is computed: {self.no_upper_bound}."
            return
        gap = "" if self.gap is None else f", {100 * self.gap:.1f} % below"
        bound, has = goal.format_bound(self.upper_bound), goal.amount(self.before_quantization_dn, 1)
        technology = study.spaces[-1].filter and study.spaces[-1].filter.technology
        alike = f" that works by {technology.description}" if technology else ""
        yield (
            f"{goal.words[:1].upper()}{goal.words[1:]} before quantization: no filter between 0 and "
            f"{self.below} with as much light{alike} exceeds {bound} (proven); this one has {has}{gap}."
        )


def _aligned(rows: Mapping[str, Columns], columns: Sequence[Column]) -> Iterator[str]:
    """Yield one line per CFA: CSDs and CFA sensitivity."""
    head = ["CFA", *("/".join(column.pair or ()) for column in columns), "light"]
    cells = [
        [cfa, *(c.amount(float(values[c.name][0]), 1) for c in columns), f"{values[CFA_SENSITIVITY][0]:.3f}"]
        for cfa, values in rows.items()
    ]
    widths = [max(map(len, column)) for column in zip(head, *cells, strict=True)]
    for name, *numbers in (head, *cells):
        right = [f"{cell:>{width}}" for cell, width in zip(numbers, widths[1:], strict=True)]
        yield "  ".join([f"{name:<{widths[0]}}", *right])


def with_base(mosaic: Mosaic, bases: Mapping[str, str]) -> Mosaic:
    """Return the CFA that a filter changes: each modified channel is named like the curve that it replaces."""
    rows = [[bases.get(channel, channel) for channel in row] for row in mosaic.rows]
    return Mosaic.from_rows("".join(name for row in rows for name in row), rows)


def evaluate_filter(
    study: Study, mosaic: Mosaic, space: Space, curve_names: Mapping[str, str], notes: Sequence[str]
) -> FilterEvaluation:
    """Evaluate the one filter of a space on a CFA in the one scenario of a study, with every effect of the scene.

    `curve_names`: curves of channels whose names differ.
    """
    assert space.filter is not None
    base, bases = with_base(mosaic, space.filter.bases), space.filter.bases
    mosaics = {PLAIN_TILE: Mosaic.from_name(PLAIN_TILE)} if {*"RGB"} <= study.sensor.qe.keys() else {}
    mosaics[base.name] = base
    changed = mosaic.name if mosaic.name not in mosaics else f"own {mosaic.name}"
    mosaics[changed] = replace(mosaic, name=changed)
    others = CfaSection(curves={c: name for c, name in curve_names.items() if c not in bases})
    cfas = {name: others if name in (base.name, changed) else CfaSection() for name in mosaics}
    spaces = (*(Space("reference", cfa, cfa) for cfa in mosaics if cfa != changed), replace(space, cfa=changed))
    section = study.section.model_copy(update={"cfas": cfas})
    goal = csd_name(_pair(study))
    study = replace(study, section=section, mosaics=mosaics, spaces=spaces, search=None)
    study = replace(study, objective=Objective(minimum={goal: 1.0}))
    constraints = {name: bound for name, bound in study.constraints.items() if name in study.quantities}
    notes = [*notes, *study.warnings, *brightness_note([goal], study.scenarios.values(), study.requested)]
    notes += [f"{name} is not computed here" for name in study.constraints if name not in constraints]
    study = replace(study, constraints=constraints)
    (scene,) = study.scenarios
    rows = {candidate.cfa: columns_of(study, candidate, scene) for candidate in spaces}
    bound = _upper_bound(study, spaces[-1], float(rows[changed][CFA_SENSITIVITY][0]))
    return FilterEvaluation(study, rows, tuple(notes), *bound)


def _pair(study: Study) -> Pair:
    """Return the signal types of the upper bound: yellow and red if both are present."""
    return _FIRST if _FIRST in study.pairs else study.pairs[0]


def _upper_bound(study: Study, space: Space, light: float) -> tuple[float | None, float | None, str, str]:
    """Return CSD before quantization, upper bound, the curve below which it holds, and a reason if there is none.

    The bound is for filters below the curve that this one replaces, else below the clear pixel, else below the larger
    of that curve and this one among filters that are not the brightest channel on white.
    """
    assert space.filter is not None
    if len(space.filter.bases) > 1:
        return None, None, "", "more than one modified channel"
    (scene,) = study.scenarios
    setup, pair = study.setup(space, scene), _pair(study)
    curves: DesignCurves = space.curves(space.points(0, 1), study.grid.size)
    ((base,), clear_name) = space.filter.bases.values(), study.sensor.clear
    curve, replaced, clear = curves[0, 0], study.sensor.curve(base), study.sensor.curve(clear_name)
    csd_dn = float(smooth_csd(setup, curves, pair)[0])
    larger = base if _is_below(curve, replaced) else f"the larger of {base} and itself"
    reason = ""
    for below, ceiling, exposed in (
        (base, replaced, False),
        (clear_name, clear, False),
        (f"{larger}, which leaves the exposure to other pixels,", np.maximum(replaced, curve), True),
    ):
        if _is_below(curve, ceiling):
            qe = setup.camera.qe.copy()
            qe[setup.camera.modified[0]] = ceiling
            of_any = any_filter_search(study, setup.with_camera(qe=qe))
            as_designed = replace(of_any, constraints={}, tolerance=Tolerance())
            problem = with_lower_bound(as_designed, CFA_SENSITIVITY, light)
            if exposed and may_be_brightest(
                problem.setup, float(study.grid.integrate(curve) / study.grid.integrate(ceiling))
            ):
                return None, None, "", "the filter is the brightest on white, and sets the exposure"
            limit, reason = upper_bound_or_reason(with_exposure_unchanged(problem) if exposed else problem)
            if limit is not None:
                return csd_dn, limit.proven, below, ""
    return None, None, "", reason


def _is_below(curve: PerWavelength, ceiling: PerWavelength) -> bool:
    """Return whether a curve is nowhere above another one, except for rounding."""
    return bool((curve <= ceiling * (1 + _SAME)).all())
