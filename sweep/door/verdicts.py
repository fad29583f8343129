"""One filter judged beside RGGB, the CFA that it changes, and what any filter in its place could reach."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import DataError, Fault
from ..base.types import FloatArray
from ..camera.exposure import may_set_exposure
from ..camera.mosaic import Mosaic
from ..curves.lights import Pair, class_pairs
from ..designs.technology import Technology
from ..metrics.columns.sensitivity import CFA_SENSITIVITY, reference_of
from ..metrics.quantity import Column, Columns
from ..metrics.separation import csd_name
from ..metrics.smooth import smooth_csd
from ..search.limit import gap_between
from ..study import Study
from .opening import Given, made_study
from .own_filters import any_filter, as_exposed, at_least, judged, limit_or_reason, table_of

if TYPE_CHECKING:
    import pandas as pd

OWN = "own "
"""How the names of the curves that are judged begin."""
PLAIN_TILE = "RGGB"
_FIRST = ("yellow", "red")
_SAME = 1e-9


@dataclass(frozen=True)
class Judged:
    """What is to be judged: a filter for channels of a CFA, whose curves the sensor has as `own <channel>`.

    `bases`: channel -> the curve that it replaces; `types`: signal types of the lights; `named`: other channels of the
    CFA whose curve has another name; `keys`: further keys of the study that judges; `notes`: how files were taken;
    `technology`: by what the filter works, where that is stated.
    """

    mosaic: Mosaic
    bases: Mapping[str, str]
    sensor: Given
    lights: Given
    types: tuple[str, ...]
    named: Mapping[str, str] = field(default_factory=dict)
    keys: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    technology: Technology | None = None

    @property
    def pair(self) -> Pair:
        """The signal types that the limit is of: yellow and red where there are both."""
        pairs = class_pairs(self.types)
        return _FIRST if _FIRST in pairs else pairs[0]


@dataclass(frozen=True)
class Verdict:
    """`study`: what judged; `rows`: scene, CFA and quantities of each, the filter's own last in each scene; `goal`: the
    separation that the limit is of.

    `limit`: what no filter in its place with as much light exceeds in the first scene, before quantization, between 0
    and the curve `below`; None where `no_limit` says why. `smooth`: what the filter has before quantization. The limit
    is of filters of the same `technology`, where that is stated.
    """

    study: Study = field(repr=False)
    rows: tuple[tuple[str, str, Columns], ...] = field(repr=False)
    goal: Column
    own: str
    smooth: float | None
    limit: float | None
    below: str
    no_limit: str
    notes: tuple[str, ...]
    others: tuple[Column, ...] = ()
    technology: Technology | None = None

    @cached_property
    def table(self) -> pd.DataFrame:
        """A row per scene and CFA, the filter's own last; units and meanings of its quantities are in `attrs`."""
        study = self.study
        return table_of(study, [(cfa, cfa, scene, c) for scene, cfa, c in self.rows])

    @property
    def gap(self) -> float | None:
        """How far the filter is below the limit, relative."""
        if self.limit is None or self.smooth is None or not self.limit > 0:
            return None
        return gap_between(self.smooth, self.limit)

    def __str__(self) -> str:
        """What a person reads of it."""
        return "\n".join([*(f"{note}." for note in self.notes), *self._lines()])

    def _lines(self) -> Iterator[str]:
        scenes = list(dict.fromkeys(scene for scene, *_ in self.rows))
        for scene in scenes:
            rows = {cfa: columns for own, cfa, columns in self.rows if own == scene}
            yield from _aligned(rows, (self.goal, *self.others), scene if len(scenes) > 1 else "CFA")
        if brightest := self.study.sensor.brightest:
            yield f"Light: 1 = {reference_of(brightest)}."
        if self.limit is None or self.smooth is None:
            yield f"No limit is computed: {self.no_limit}."
            return
        gap = "" if self.gap is None else f", {100 * self.gap:.1f} % below"
        bound, has = self.goal.told_bound(self.limit), self.goal.amount(self.smooth, 1)
        alike = "" if self.technology is None else f" that works by {self.technology.told}"
        where = f" in {scenes[0]}" if len(scenes) > 1 else ""
        yield (
            f"{self.goal.words[:1].upper()}{self.goal.words[1:]} before quantization{where}: no filter between 0 and "
            f"{self.below} with as much light{alike} exceeds {bound} (proven); this one has {has}{gap}."
        )


def _aligned(rows: Mapping[str, Columns], columns: Sequence[Column], corner: str) -> Iterator[str]:
    """A line per CFA of one scene: its separations, and the light of the whole tile (see `reference_of`)."""
    head = [corner, *("/".join(column.pair or ()) for column in columns), "light"]
    cells = [
        [cfa, *(column.amount(float(own[column.name][0]), 1) for column in columns), f"{own[CFA_SENSITIVITY][0]:.3f}"]
        for cfa, own in rows.items()
    ]
    wide = [max(map(len, column)) for column in zip(head, *cells, strict=True)]
    for line in (head, *cells):
        yield "  ".join(
            f"{cell:<{w}}" if i == 0 else f"{cell:>{w}}" for i, (cell, w) in enumerate(zip(line, wide, strict=True))
        )


def with_base(mosaic: Mosaic, bases: Mapping[str, str]) -> Mosaic:
    """The CFA that a filter changes: its channels are those of the curves that it replaces."""
    channels = [bases.get(channel, channel) for channel in mosaic.channels]
    rows = [[channels[at] for at in row] for row in mosaic.tile]
    return Mosaic.from_rows("".join(name for row in rows for name in row), rows)


def judge(asked: Judged) -> Verdict:
    """Judge a filter in every scene, by everything that the scenes call for.

    Raises SweepError for curves and names that do not fit together.
    """
    base = with_base(asked.mosaic, asked.bases)
    own = asked.mosaic.name if asked.mosaic.name != base.name else OWN + base.name
    known = {*"RGB"} if "builtin" in asked.sensor.keys else set()
    known |= {name for entry in asked.sensor.keys["files"] for name in entry["columns"]}
    cfas: dict[str, Any] = {PLAIN_TILE: {}} if known >= {*"RGB"} else {}
    others = {channel: name for channel, name in asked.named.items() if channel not in asked.bases}
    cfas[base.name] = {"tile": _rows(base), "curves": others}
    cfas[own] = {"tile": _rows(asked.mosaic), "curves": others | {c: OWN + c for c in asked.bases}}
    keys = {"objective": csd_name(asked.pair), **asked.keys}
    study = made_study("evaluate", sensor=asked.sensor, lights=asked.lights, cfas=cfas, **keys).study
    curves = np.stack([study.sensor.curve(OWN + channel) for channel in asked.bases])[None]
    nothing = np.empty((1, 0, study.grid.size))
    rows = []
    for scene in study.scenarios:
        for cfa in study.mosaics:
            bases, made = (asked.bases, curves) if cfa == own else ({}, nothing)
            rows.append((scene, cfa, judged(study, study.setup_of(cfa, scene, bases, asked.technology), made)))
    first = next(columns for _, cfa, columns in rows if cfa == own)
    light = float(first[CFA_SENSITIVITY][0])
    smooth, limit, below, reason = _limit(study, own, asked, curves, light)
    every = [study.quantities[csd_name(pair)].column for pair in study.pairs]
    goal = next(column for column in every if column.pair == asked.pair)
    further = tuple(column for column in every if column is not goal)
    notes = (*asked.notes, *study.warnings)
    return Verdict(study, tuple(rows), goal, own, smooth, limit, below, reason, notes, further, asked.technology)


def _rows(mosaic: Mosaic) -> list[list[str]]:
    return [[mosaic.channels[at] for at in row] for row in mosaic.tile]


def _limit(
    study: Study, own: str, asked: Judged, curves: FloatArray, light: float
) -> tuple[float | None, float | None, str, str]:
    """The filter before quantization, the limit, the curve below which it holds, and why there is none.

    Of filters below the curve that this one replaces, or else the clear pixel; or else below that curve and this one,
    whichever is larger, that are not the brightest on white, where this one is not.
    """
    scenario, bases = next(iter(study.scenarios)), asked.bases
    if len(bases) > 1:
        return None, None, "", "more than one modified channel"
    ((channel, base),) = bases.items()
    clear_name = study.sensor.clear
    curve, replaced, clear = curves[0, 0], study.sensor.curve(base), study.sensor.curve(clear_name)
    setup = study.setup_of(own, scenario, {channel: base}, asked.technology)
    smooth = float(smooth_csd(setup, curves, asked.pair)[0])
    larger = base if _below(curve, replaced) else f"the larger of {base} and itself"
    for below, ceiling, exposed in (
        (base, replaced, False),
        (clear_name, clear, False),
        (f"{larger}, which leaves the exposure to other pixels,", np.maximum(replaced, curve), True),
    ):
        if _below(curve, ceiling):
            qe = setup.camera.qe.copy()
            qe[setup.camera.modified[0]] = ceiling
            problem = at_least(any_filter(study, setup.with_camera(qe=qe)), CFA_SENSITIVITY, light)
            if exposed and may_set_exposure(problem.setup, float(curve.sum() / ceiling.sum())):
                return None, None, "", "the filter is the brightest on white, and sets the exposure"
            found, reason = limit_or_reason(as_exposed(problem) if exposed else problem)
            if found is not None:
                return smooth, found.proven, below, ""
    return None, None, "", reason


def _below(curve: FloatArray, ceiling: FloatArray) -> bool:
    """Whether a curve is nowhere above another one, but for rounding."""
    return bool((curve <= ceiling * (1 + _SAME)).all())


def opposite(mosaic: Mosaic, channel: str, known: Mapping[str, FloatArray]) -> str:
    """The curve that a channel of a 2x2 tile replaces: that of the pixel diagonal to it, as both Y of RYYCy.

    Raises DataError where that has no curve.
    """
    rows = _rows(mosaic)
    at = [(r, c) for r, row in enumerate(rows) for c, name in enumerate(row) if name == channel]
    if len(rows) == len(rows[0]) == 2 and len(at) == 1:
        other = rows[1 - at[0][0]][1 - at[0][1]]
        if other in known:
            return other
    raise DataError(Fault(f"which curve does {channel} replace?", None, None, "--base", allowed=", ".join(known)))
