"""Evaluation of one filter beside RGGB, the CFA that it changes, and the upper bound of any filter in its place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..base.errors import DataError, ValidationIssue
from ..base.types import DesignCurves, PerWavelength
from ..camera.exposure import may_be_brightest
from ..camera.mosaic import Mosaic
from ..designs.space import Space
from ..designs.technology import Technology
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.columns.sensitivity import CFA_SENSITIVITY, reference_of
from ..metrics.quantity import Column, Columns
from ..metrics.separation import csd_name
from ..metrics.smooth import smooth_csd
from ..search.upper_bound import gap_between
from ..spectra.lights import Pair, class_pairs
from ..study import Study
from .loading import CurveSource, make_study
from .own_designs import columns_of, space_of_curves
from .user_filters import (
    any_filter_search,
    table_of_results,
    upper_bound_or_reason,
    with_exposure_unchanged,
    with_lower_bound,
)

if TYPE_CHECKING:
    import pandas as pd

USER_CURVE = "own "
"""Prefix of the names of the filter's curves."""
PLAIN_TILE = "RGGB"
_FIRST = ("yellow", "red")
_SAME = 1e-9


@dataclass(frozen=True)
class FilterUnderTest:
    """A filter for channels of a CFA, with sensor and lights to evaluate it.

    `bases`: modified channel -> curve that it replaces. Curves of the filter in `sensor` are named ``own <channel>``.
    `types`: signal types of the lights. `curve_names`: curves of other channels whose names differ. `keys`: further
    keys of the study. `notes`: how files were read.
    """

    mosaic: Mosaic
    bases: Mapping[str, str]
    sensor: CurveSource
    lights: CurveSource
    types: tuple[str, ...]
    curve_names: Mapping[str, str] = field(default_factory=dict)
    keys: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    technology: Technology | None = None
    study: Study | None = None

    @property
    def pair(self) -> Pair:
        """Signal types of the upper bound: yellow and red if both are present."""
        pairs = class_pairs(self.types)
        return _FIRST if _FIRST in pairs else pairs[0]


@dataclass(frozen=True)
class FilterEvaluation:
    """Evaluation of one filter.

    Parameters
    ----------
    study : Study
        Study that evaluated the filter.
    rows : tuple of (scenario, CFA, quantities)
        Quantities of each CFA; in each scenario the filter's row is the last one.
    goal : Column
        CSD that the upper bound is for.
    cfa : str
        CFA with the filter.
    before_quantization_dn : float or None
        CSD of the filter before quantization, DN.
    upper_bound : float or None
        Upper bound on that CSD, DN, for any filter between 0 and the curve `below`, of the same technology and with at
        least as much light, in the first scenario. None if `no_upper_bound` states a reason.
    below : str
        Curve below which the bound holds.
    no_upper_bound : str
        Reason why there is no bound.
    notes : tuple of str
        Notes on the way files were read.
    others : tuple of Column
        Further CSDs of the printed table.
    technology : Technology, optional
        Physical principle of the filter.
    constraints : mapping of str to Bound
        Constraints of the study `of_study`, which the filter is held against.
    of_study : str
        Name of that study.
    """

    study: Study = field(repr=False)
    rows: tuple[tuple[str, str, Columns], ...] = field(repr=False)
    goal: Column
    cfa: str
    before_quantization_dn: float | None
    upper_bound: float | None
    below: str
    no_upper_bound: str
    notes: tuple[str, ...]
    others: tuple[Column, ...] = ()
    technology: Technology | None = None
    constraints: Mapping[str, Bound] = field(default_factory=dict)
    of_study: str = ""

    @property
    def violated(self) -> list[str]:
        """Constraints that the filter does not meet in a scenario, or of which it is not known, each with its value."""
        missed = []
        for name, bound in self.constraints.items():
            for scene, cfa, columns in self.rows:
                value = columns.get(name, np.array([np.nan]))
                if cfa == self.cfa and not (bound.violation(value) <= FEASIBLE).all():
                    where = f" in {scene}" if len(self.study.scenarios) > 1 else ""
                    known = f"{value[0]:.4g}" if np.isfinite(value[0]) else "unknown"
                    missed.append(f"{name} {known}{where} ({bound})")
        return missed

    @cached_property
    def table(self) -> pd.DataFrame:
        """Quantities with one row per scenario and CFA; units and meanings are in ``attrs``."""
        table = table_of_results(self.study, [(cfa, cfa, scene, columns) for scene, cfa, columns in self.rows])
        return table.drop(columns=["violation", "feasible", "violated"])  # these CFAs have no constraints

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
            "upper_bound_of": self.goal.name,
            "upper_bound": self.upper_bound,
            "before_quantization_dn": self.before_quantization_dn,
            "gap": self.gap,
            "no_upper_bound": self.no_upper_bound,
            "constraints_of": self.of_study,
            "violated": self.violated,
            "notes": self.notes,
        }

    def __str__(self) -> str:
        """Return the text of `sweep evaluate`."""
        return "\n".join(self.lines)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"

    def _lines(self) -> Iterator[str]:
        scenes = list(dict.fromkeys(scene for scene, *_ in self.rows))
        for scene in scenes:
            rows = {cfa: columns for name, cfa, columns in self.rows if name == scene}
            yield from _aligned(rows, (self.goal, *self.others), scene if len(scenes) > 1 else "CFA")
        if self.constraints:
            met = f"not met: {', '.join(self.violated)}" if self.violated else "met"
            stated = ", ".join(f"{name} {bound}" for name, bound in self.constraints.items())
            yield f"Constraints of the study {self.of_study} ({stated}): {met}."
        if brightest := self.study.sensor.brightest:
            yield f"Light: 1 = {reference_of(brightest)}."
        if self.upper_bound is None or self.before_quantization_dn is None:
            yield f"No upper bound is computed: {self.no_upper_bound}."
            return
        gap = "" if self.gap is None else f", {100 * self.gap:.1f} % below"
        bound, has = self.goal.format_bound(self.upper_bound), self.goal.amount(self.before_quantization_dn, 1)
        alike = "" if self.technology is None else f" that works by {self.technology.description}"
        where = f" in {scenes[0]}" if len(scenes) > 1 else ""
        yield (
            f"{self.goal.words[:1].upper()}{self.goal.words[1:]} before quantization{where}: no filter between 0 and "
            f"{self.below} with as much light{alike} exceeds {bound} (proven); this one has {has}{gap}."
        )


def _aligned(rows: Mapping[str, Columns], columns: Sequence[Column], corner: str) -> Iterator[str]:
    """Yield one line per CFA of a scene: CSDs and CFA sensitivity."""
    head = [corner, *("/".join(column.pair or ()) for column in columns), "light"]
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
    channels = [bases.get(channel, channel) for channel in mosaic.channels]
    rows = [[channels[at] for at in row] for row in mosaic.tile]
    return Mosaic.from_rows("".join(name for row in rows for name in row), rows)


def evaluate_filter(filter_: FilterUnderTest) -> FilterEvaluation:
    """Evaluate a filter in every scenario, with every effect that the scene calls for."""
    base = with_base(filter_.mosaic, filter_.bases)
    changed = filter_.mosaic.name if filter_.mosaic.name != base.name else USER_CURVE + base.name
    known = {*"RGB"} if "builtin" in filter_.sensor.keys else set()
    known |= {name for entry in filter_.sensor.keys["files"] for name in entry["columns"]}
    cfas: dict[str, Any] = {PLAIN_TILE: {}} if known >= {*"RGB"} else {}
    others = {channel: name for channel, name in filter_.curve_names.items() if channel not in filter_.bases}
    cfas[base.name] = {"tile": _rows(base), "curves": others}
    cfas[changed] = {"tile": _rows(filter_.mosaic), "curves": others | {c: USER_CURVE + c for c in filter_.bases}}
    keys = {"objective": csd_name(filter_.pair), **filter_.keys}
    study = make_study("evaluate", sensor=filter_.sensor, lights=filter_.lights, cfas=cfas, **keys).study
    curves = np.stack([study.sensor.curve(USER_CURVE + channel) for channel in filter_.bases])[None]
    spaces = {cfa: Space("reference", cfa, cfa) for cfa in study.mosaics}
    spaces[changed] = space_of_curves(changed, filter_.bases, curves, filter_.technology)
    rows = [(scene, cfa, columns_of(study, space, scene)) for scene in study.scenarios for cfa, space in spaces.items()]
    first = next(columns for _, cfa, columns in rows if cfa == changed)
    light = float(first[CFA_SENSITIVITY][0])
    csd_dn, limit, below, reason = _upper_bound(study, changed, filter_, curves, light)
    columns = [study.quantities[csd_name(pair)].column for pair in study.pairs]
    goal = next(column for column in columns if column.pair == filter_.pair)
    further = tuple(column for column in columns if column is not goal)
    notes = (*filter_.notes, *study.warnings)
    of = filter_.study
    constraints, name = ({}, "") if of is None else (dict(of.constraints), of.name)
    result = study, tuple(rows), goal, changed, csd_dn, limit, below, reason, notes, further, filter_.technology
    return FilterEvaluation(*result, constraints, name)


def _rows(mosaic: Mosaic) -> list[list[str]]:
    return [[mosaic.channels[at] for at in row] for row in mosaic.tile]


def _upper_bound(
    study: Study, cfa: str, filter_: FilterUnderTest, curves: DesignCurves, light: float
) -> tuple[float | None, float | None, str, str]:
    """Return CSD before quantization, upper bound, the curve below which it holds, and a reason if there is none.

    The bound is for filters below the curve that this one replaces, else below the clear pixel, else below the larger
    of that curve and this one among filters that are not the brightest channel on white.
    """
    scenario, bases = next(iter(study.scenarios)), filter_.bases
    if len(bases) > 1:
        return None, None, "", "more than one modified channel"
    ((channel, base),) = bases.items()
    clear_name = study.sensor.clear
    curve, replaced, clear = curves[0, 0], study.sensor.curve(base), study.sensor.curve(clear_name)
    setup = study.setup_of(cfa, scenario, {channel: base}, filter_.technology)
    csd_dn = float(smooth_csd(setup, curves, filter_.pair)[0])
    larger = base if _is_below(curve, replaced) else f"the larger of {base} and itself"
    for below, ceiling, exposed in (
        (base, replaced, False),
        (clear_name, clear, False),
        (f"{larger}, which leaves the exposure to other pixels,", np.maximum(replaced, curve), True),
    ):
        if _is_below(curve, ceiling):
            qe = setup.camera.qe.copy()
            qe[setup.camera.modified[0]] = ceiling
            with_ceiling = any_filter_search(study, setup.with_camera(qe=qe))
            problem = with_lower_bound(with_ceiling, CFA_SENSITIVITY, light)
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


def diagonal_curve(mosaic: Mosaic, channel: str, curves: Mapping[str, DesignCurves]) -> str:
    """Return the curve that a channel of a 2 x 2 tile replaces: that of the pixel diagonal to it."""
    rows = _rows(mosaic)
    at = [(r, c) for r, row in enumerate(rows) for c, name in enumerate(row) if name == channel]
    if len(rows) == len(rows[0]) == 2 and len(at) == 1:
        other = rows[1 - at[0][0]][1 - at[0][1]]
        if other in curves:
            return other
    raise DataError(
        ValidationIssue(f"which curve does {channel} replace?", None, None, "--base", allowed=", ".join(curves))
    )
