"""Extremes of CSDs over sampling phases, field positions and moments of a pulse: of a lattice, then refined."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..base.errors import SweepError, ValidationIssue
from ..base.types import Array, DesignCurves, Float, IndexArray, Int, PerValue
from ..camera.memory import blocks
from ..camera.model import SceneModel, View
from ..camera.phases import fine_lattice, phases_at
from ..camera.pwm import phases_of
from ..camera.refine import Lattice, in_lockstep, search
from ..camera.setup import Setup
from ..spectra.lights import class_pairs
from .batch import Batch
from .quantity import BEST_PHASE, Columns, RequestedQuantities
from .registry import quantities_of
from .separation import csd_name, separations
from .user_metrics import UserMetric

_FINER_MOMENTS, _MOMENT_ROUNDS, _MOMENTS_FINER = 8, 3, 4
"""Factor by which moments of a pulse are finer at one place; rounds around the worst, each so many times finer."""
HEIGHT_ROUNDS = 4
_TOGETHER = 64
"""Designs that are refined side by side."""
_Values = Float[Array, "values _places"]
_At = Callable[[Sequence[DesignCurves], Sequence[Float[Array, "_places axes"]]], list[_Values]]
"""From designs, and places of each, to their CSDs there."""


def over_cases(model: SceneModel, cases: Columns, user_metrics: Sequence[UserMetric] = ()) -> Columns:
    """Return the worst of all cases, and for CSDs the largest over the places of the smallest over the moments."""
    classes = model.setup.lights.classes
    quantities = quantities_of(RequestedQuantities(classes, any_place=True, user_metrics=tuple(user_metrics)))
    best = {quantity.of: name for name, quantity in quantities.items() if quantity.extreme == "best place"}
    columns: Columns = {}
    for name, values in cases.items():
        if name not in quantities:
            raise SweepError(ValidationIssue("a metric gives a column that is none of its `quantities`", value=name))
        if len(values) == 1:
            columns |= {column: values[0].copy() for column in (name, best.get(name)) if column is not None}
            continue
        moments = quantities[name].worse(np.swapaxes(values.reshape(model.n_cases, -1, values.shape[1]), 0, 1))
        columns[name] = quantities[name].worse(moments)
        if name in best:
            columns[best[name]] = moments.max(axis=0)
    return columns


def refine(batch: Batch, cases: Columns) -> Columns:
    """Return CSDs refined over phases, field positions and moments, and the largest at a place."""
    setup, model = batch.setup, batch.model
    names = [csd_name(pair) for pair in class_pairs(setup.lights.classes)]
    known = np.flatnonzero(np.isfinite(batch.columns[names[0]])) if names else np.empty(0, dtype=np.intp)
    refined = {name: batch.columns[name].copy() for name in (*names, *(BEST_PHASE + name for name in names))}
    fine, pulsed = setup.accuracy.finest_phase_px > 0, _bends_over_pulse(setup)
    if not (pulsed or (fine and (setup.all_phases or setup.all_heights))):
        return {}
    for start in range(0, known.size, _TOGETHER):
        designs = known[start : start + _TOGETHER]
        curves = [batch.curves_of(int(design)) for design in designs]
        if setup.all_phases and fine:
            lattice, at = fine_lattice(setup), _at_phases(model)
            on_lattice = at(curves, [lattice.places] * len(curves))
            extremes = _extremes(lattice, curves, on_lattice, at)
            if pulsed:
                extremes = [_pulsed(model, *of, len(names)) for of in zip(curves, extremes, strict=True)]
            _keep(refined, names, designs, [least for least, _ in extremes], best=True)
        elif pulsed and not setup.all_heights:
            views = [*model.own_views()]
            for design, of_design in zip(designs, curves, strict=True):
                for name, least in zip(names, _over_pulse(model, of_design, views, np.arange(len(names))), strict=True):
                    for column in (name, BEST_PHASE + name) if model.n_cases == 1 else (name,):
                        refined[column][design] = min(refined[column][design], least)
        if setup.all_heights and fine:
            heights, at = np.array(model.heights), _at_heights(model)
            places = np.stack([cases[name].reshape(heights.size, -1, batch.size).min(axis=1) for name in names], axis=1)
            on_lattice = [_both_ends(places[..., design].T) for design in designs]
            extremes = _extremes(Lattice.along(heights, HEIGHT_ROUNDS), curves, on_lattice, at)
            at_phases = np.array([[refined[name][design] for name in names] for design in designs])
            least = [
                np.append(np.minimum(of[: len(names)], own), of[len(names) :])
                for (of, _), own in zip(extremes, at_phases, strict=True)
            ]
            _keep(refined, names, designs, least, best=model.n_cases == heights.size)
    return refined


def _keep(
    refined: Columns,
    names: Sequence[str],
    designs: Int[IndexArray, " designs"],
    extremes: Sequence[PerValue],
    *,
    best: bool,
) -> None:
    """Put the smallest value of each pair, and the largest, into the columns."""
    for design, both in zip(designs, extremes, strict=True):
        for number, name in enumerate(names):
            refined[name][design] = both[number]
            if best:
                refined[BEST_PHASE + name][design] = -both[number + len(names)]


def _both_ends(csds: Float[Array, "pairs places"]) -> _Values:
    return np.concatenate([csds, -csds])


def _extremes(
    lattice: Lattice, curves: Sequence[DesignCurves], on_lattice: Sequence[_Values], at: _At
) -> list[tuple[PerValue, Float[Array, "values axes"]]]:
    """Return the smallest CSD of each pair of designs and the negative of the largest, and their places."""
    searches = [search(lattice, values) for values in on_lattice]
    return in_lockstep(searches, lambda numbers, places: at([curves[number] for number in numbers], places))


def _csds(
    model: SceneModel, curves: DesignCurves, views: Sequence[View], n_heights: int, moments: PerValue | None = None
) -> Float[Array, "pairs heights phases moments"]:
    """Return the CSDs of one design in each case of some views, a height's after those of the one before."""
    response = model.read(curves, views, moments)[0][0]
    csds = np.stack([*separations(response, model.setup.members).values()])
    phases = sum(view.readout.n_cases for view in views) // n_heights
    return np.asarray(csds.reshape(len(csds), n_heights, phases, -1))


def _at_phases(model: SceneModel) -> _At:
    """Return the function of both ends of designs' CSDs at sampling phases, over field positions and moments."""

    def at(curves: Sequence[DesignCurves], places: Sequence[Float[Array, "_places axes"]]) -> list[_Values]:
        centers, which = np.unique(np.concatenate(places), axis=0, return_inverse=True)
        phases, choices = phases_at(model.setup, centers)
        numbers = choices[:, which.ravel()]
        known = [np.empty((0, len(phases)))] * len(curves)
        numbers_of = np.split(numbers, np.cumsum([len(of_design) for of_design in places])[:-1], axis=1)
        begin = 0
        for block in [phases] if model.setup.linear else blocks(model.setup, phases):
            views = [*model.views(block)]
            for design, of_design in enumerate(curves):
                wanted = np.unique(numbers_of[design]) - begin
                wanted = wanted[(wanted >= 0) & (wanted < len(block))]
                if wanted.size:
                    some = [view.subset(wanted) for view in views]
                    values = _both_ends(_csds(model, of_design, some, len(model.heights)).min(axis=(1, 3)))
                    if not known[design].size:
                        known[design] = np.full((len(values), len(phases)), np.inf)
                    known[design][:, begin + wanted] = values
            begin += len(block)
        return [values[:, number].min(axis=1) for values, number in zip(known, numbers_of, strict=True)]

    return at


def _at_heights(model: SceneModel) -> _At:
    """Return the function of both ends of designs' CSDs at field positions, over phases and moments."""

    def at(curves: Sequence[DesignCurves], places: Sequence[Float[Array, "_places axes"]]) -> list[_Values]:
        heights = np.unique(np.concatenate(places))
        of_heights = []
        for height in heights.tolist():
            views = [*model.views(heights=[height])]
            wanted = [height in of_design for of_design in places]
            asked = zip(curves, wanted, strict=True)
            of_heights.append([_csds(model, c, views, 1).min(axis=(1, 2, 3)) if asks else None for c, asks in asked])
        rows = [np.searchsorted(heights, of_design[:, 0]) for of_design in places]
        return [
            _both_ends(np.stack([np.asarray(of_heights[row][design]) for row in of_design], axis=1))
            for design, of_design in enumerate(rows)
        ]

    return at


def _bends_over_pulse(setup: Setup) -> bool:
    """Return whether a CSD may be smallest at any moment of a pulse.

    Of whole numbers: only where they may clip, too, and the worst places are refined.
    """
    drive, rounds = setup.scene.drive, setup.scene.noise is None and setup.computes("quantization")
    clips = setup.computes("saturation") and setup.accuracy.finest_phase_px > 0
    bends = not setup.linear and (not rounds or clips)
    return drive is not None and setup.computes("flicker") and bends


def _pulsed(
    model: SceneModel, curves: DesignCurves, extremes: tuple[PerValue, Float[Array, "values axes"]], n_pairs: int
) -> tuple[PerValue, Float[Array, "values axes"]]:
    """Return extremes at the worst moment of a pulse, at the place of each."""
    least = extremes[0].copy()
    places, which = np.unique(extremes[1], axis=0, return_inverse=True)
    for at, place in enumerate(places):
        views = [*model.views(phases_at(model.setup, place[None])[0])]
        numbers = np.flatnonzero(which.ravel() == at)
        there = _over_pulse(model, curves, views, numbers % n_pairs)
        least[numbers] = np.where(
            numbers < n_pairs, np.minimum(least[numbers], there), np.maximum(least[numbers], -there)
        )
    return least, extremes[1]


def _over_pulse(
    model: SceneModel, curves: DesignCurves, views: Sequence[View], pairs: Int[IndexArray, " pairs"]
) -> Float[Array, " pairs"]:
    """Return the smallest CSDs of some pairs of one design at any moment of a pulse over some views."""

    def at(_: list[int], moments: list[Float[Array, "_places axes"]]) -> list[_Values]:
        response = model.read(curves, views, moments[0][:, 0])[0][0]
        csds = [values.reshape(-1, len(moments[0])).min(axis=0) for values in separations(response, members).values()]
        return [np.stack(csds)[pairs]]

    members, finer = model.setup.members, _FINER_MOMENTS * (model.setup.accuracy.pwm_moments - 1)
    first = np.linspace(0.0, 1.0, finer + 1)
    if model.setup.camera.pixel.captures:
        first = phases_of(model.setup, model.exposure_s(curves), finer)[0]
    lattice = Lattice.along(first, _MOMENT_ROUNDS, _MOMENTS_FINER)
    return in_lockstep([search(lattice, at([0], [lattice.places])[0])], at)[0][0]
