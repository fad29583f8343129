"""Pure evaluation: a block of designs in a scene -> every column that its light and its filters give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import FloatArray
from ..camera.effects import phase
from ..camera.effects.image_height import HEIGHTS
from ..camera.electrons import Changing
from ..camera.field import scene_at
from ..camera.imager import Imager, imager_of
from ..camera.registry import EFFECTS
from ..camera.sensor_places import SensorPlaces
from ..camera.view import View
from ..curves.lights import Pair, class_pairs
from ..designs.block import Block, CurveBlock
from ..designs.family import Family
from ..vision.section import Vision
from .columns.color_separation import ColorSeparation
from .columns.exposure import EXPOSURE
from .own import OwnMetric
from .quantity import (
    BEST_PLACE,
    Columns,
    DesignMetric,
    FamilyMetric,
    NoiseMetric,
    VisionMetric,
)
from .registry import METRICS
from .separation import csd_name, separations, separations_along, separations_by_edges
from .whole_readout import Spent, WholeReadout, by_case, over_cases

if TYPE_CHECKING:
    from ..camera.places import Extremes

_CSD = [metric for metric in METRICS if isinstance(metric, ColorSeparation)]


def designed_quantities(view: View, designs: FloatArray | Block) -> Columns:
    """What designs give without any light, each ndarray[n_designs].

    `designs`: a block, or the QE of its modified channels, ndarray[n_designs, n_modified, n_wavelengths].
    """
    block = _block(designs)
    return _joined([metric.of_designs(view, block) for metric in METRICS if isinstance(metric, DesignMetric)])


def family_quantities(family: Family | None, points: FloatArray) -> Columns:
    """What the parameters of designs say, each ndarray[n_designs]; `points`: ndarray[n_designs, n_parameters]."""
    return _joined([metric.of_parameters(family, points) for metric in METRICS if isinstance(metric, FamilyMetric)])


def image_quantities(view: View, curves: FloatArray, vision: Vision | None, seed: int) -> Columns:
    """What images of signal heads give, each ndarray[n_designs]; nothing where a study does not ask.

    `curves`: ndarray[n_designs, n_modified, n_wavelengths]; `seed`: the study's.
    """
    if vision is None:
        return {}
    metrics = [metric for metric in METRICS if isinstance(metric, VisionMetric)]
    return _joined([metric.of_images(view, curves, vision, seed) for metric in metrics])


def _block(designs: FloatArray | Block) -> Block:
    return CurveBlock(np.asarray(designs, dtype=float)) if isinstance(designs, np.ndarray) else designs


def _joined(parts: Sequence[Columns]) -> Columns:
    return {name: values for part in parts for name, values in part.items()}


def _over_all_places(
    imager: Imager,
    curves: FloatArray,
    exposure_s: FloatArray,
    columns: Columns,
) -> None:
    """Put the extremes over all places into the columns, which hold those over the lattice.

    In the darkest moment of a light that goes dark all distances are 0, there and everywhere.
    """
    for design in np.flatnonzero(np.isfinite(exposure_s)):
        light = imager.light.light_dn(curves[design], exposure_s[design])
        if not np.isfinite(light).all() or not light.any():
            continue
        assert imager.anywhere is not None
        found = imager.anywhere.extremes(light)
        found = _as_read(imager, curves[design : design + 1], found)
        for pair, extremes in found.items():
            name = csd_name(pair)
            smallest, largest = (np.nan, np.nan) if extremes is None else (extremes.smallest, extremes.largest)
            best = columns[BEST_PLACE + name]
            columns[name][design] = np.minimum(columns[name][design], smallest)
            best[design] = np.maximum(best[design], largest)


def _by_search(imager: Imager, curves: FloatArray) -> Columns | None:
    """CSDs and exposure where a straight response is read out: the search for the worst place tells them all.

    The lattice's places are nodes of its first cells. In the darkest moment of a light that goes dark all distances are
    0. None where light or exposure are not finite.
    """
    exposure_s = imager.light.exposure_s(curves)
    if not np.isfinite(exposure_s).all():
        return None
    pairs = class_pairs(imager.view.lights.classes)
    columns = {start + csd_name(pair): np.full(len(curves), np.nan) for pair in pairs for start in ("", BEST_PLACE)}
    for design, time_s in enumerate(exposure_s.tolist()):
        light = imager.light.light_dn(curves[design], time_s)
        if not np.isfinite(light).all():
            return None
        if not light.any():
            for values in columns.values():
                values[design] = 0.0
            continue
        assert imager.anywhere is not None
        for pair, extremes in imager.anywhere.extremes(light).items():
            if extremes is not None:
                columns[csd_name(pair)][design] = extremes.smallest
                columns[BEST_PLACE + csd_name(pair)][design] = extremes.largest
    return columns | {EXPOSURE: exposure_s}


def _over_all_heights(imager: Imager, curves: FloatArray, exposure_s: FloatArray, columns: Columns) -> None:
    """Put the smallest distances over all places of the sensor into the columns, which hold those of a few.

    They are looked for in the straight response, and read out where they are.
    """
    view = imager.view
    asked = EFFECTS[HEIGHTS].limit_dn(view.methods.field)
    assert asked is not None
    places = SensorPlaces(view, asked, imager.work)
    for design in np.flatnonzero(np.isfinite(exposure_s)):
        found = places.worst(curves[design])
        for pair in (pair for pair, worst in found.items() if worst is None):
            columns[csd_name(pair)][design] = np.nan
        for height in {worst.height for worst in found.values() if worst is not None}:
            there = imager_of(replace(view, scenario=scene_at(view.scenario, height)))
            for moment in np.moveaxis(there.read(curves[design : design + 1])[0], 1, 0):
                for pair, distance in separations(moment, view.members).items():
                    own = columns[csd_name(pair)]
                    own[design] = np.minimum(own[design], distance[0])


def _as_read(imager: Imager, curves: FloatArray, found: Mapping[Pair, Extremes | None]) -> dict[Pair, Extremes | None]:
    """Extremes of one design at the places where those of the straight response are, as the camera reads them out.

    Where the readout is not straight, another pair's place may be the better one.
    """
    kept = {pair: extremes for pair, extremes in found.items() if extremes is not None}
    at = [case for extremes in kept.values() for case in (extremes.at_smallest, extremes.at_largest)]
    if not at:
        return dict(found)
    cases, which = phase.different_places(imager.view, phase.Cases(*np.moveaxis(np.array(at), 1, 0)))
    there = Imager(imager.view, imager.work, cases=cases, once=True)
    every = separations(there.read(curves)[0][0], imager.view.members)
    moments = {pair: distances.reshape(len(cases.places_px), -1)[which] for pair, distances in every.items()}
    read = [{pair: distances[place] for pair, distances in moments.items()} for place in range(len(at))]
    for number, (pair, extremes) in enumerate(kept.items()):
        own = read[2 * number : 2 * number + 2] if imager.view.methods.straight else read
        distances = [float(each[pair].min()) for each in own]
        kept[pair] = replace(extremes, smallest=min(distances), largest=max(distances))
    return {pair: kept.get(pair) for pair in found}


def evaluate(
    imager: Imager,
    designs: FloatArray | Block,
    states: Sequence[str] = (),
    *,
    probabilities: bool = False,
    own: Sequence[OwnMetric] = (),
    spent: Spent | None = None,
) -> Columns:
    """Evaluate a block of designs as the camera reads them out, as far as the scene's methods go.

    `designs`: see `designed_quantities`. Returns the columns of all metrics but those of a family, each
    ndarray[n_designs]; `states`: signal types that noise may confuse, `probabilities`: with their CDP; `own`:
    metrics of a user's own; `spent` is added to. CSDs are the smallest over the places of the light and the moments of
    its pulses; `best_place_csd_<a>_<b>` is the largest over the places of the smallest over the moments. All metrics
    but CSDs are the worst over the places of the lattice. Distances are NaN where the extremes over all places take
    more cells than `places` allows, or `sensor_places`.
    """
    block, extra = _block(designs), WholeReadout(imager, own, spent or Spent())
    anywhere = phase.all_count(imager.view, imager.view.methods)
    if anywhere and imager.view.methods.straight and not states:
        curves = block.curves()
        found = _by_search(imager, curves)
        if found is not None:
            more = extra.of(len(curves), lambda part: imager.read(curves[part])[0])
            return found | more | designed_quantities(imager.view, block)
    changing = None if states else imager.read_changing(block)
    if changing is None:
        columns = _read(imager, block, extra, states, probabilities=probabilities)
    elif changing.which.all():
        columns = _distances_along(imager, changing, extra)
    else:
        along = _distances_along(imager, changing, extra)
        rest = _read(imager, block.some(np.flatnonzero(~changing.which)), extra)
        columns = {name: np.empty(len(block)) for name in along}
        for name, values in columns.items():
            values[changing.which], values[~changing.which] = along[name], rest[name]
    if anywhere:
        _over_all_places(imager, block.curves(), columns[EXPOSURE], columns)
    if EFFECTS[HEIGHTS].all_count(imager.view, imager.view.methods):
        _over_all_heights(imager, block.curves(), columns[EXPOSURE], columns)
    return columns | designed_quantities(imager.view, block)


def _distances_along(imager: Imager, changing: Changing, extra: WholeReadout) -> Columns:
    """CSDs and exposure of designs that differ in one channel alone, and what needs their whole readout."""
    by_edges = separations_by_edges(changing, imager.view.members)
    cases = (
        [by_edges]
        if by_edges is not None
        else [
            separations_along(fixed, changing.channel, changing.values[:, case], imager.view.members)
            for case, fixed in enumerate(changing.fixed)
        ]
    )
    each = {csd_name(pair): np.stack([case[pair] for case in cases]) for pair in cases[0]}
    n = int(changing.which.sum())
    return over_cases(imager, each) | {EXPOSURE: np.full(n, changing.exposure_s)} | extra.of(n, changing.whole_of)


def _read(
    imager: Imager, block: Block, extra: WholeReadout, states: Sequence[str] = (), *, probabilities: bool = False
) -> Columns:
    """What the readout of any designs gives; with `states`, what noise does to them, too."""
    curves, members, apart = block.curves(), imager.view.members, Columns()
    if states:
        read = imager.read_with_noise(curves)
        response, exposure_s = read.mean, read.exposure_s
        confused = {name: members[name] for name in states}
        noisy = [m for m in METRICS if isinstance(m, NoiseMetric) and (probabilities or not m.extra)]
        apart = _joined([metric.of_noise(imager, curves, read, confused) for metric in noisy])
    else:
        response, exposure_s = imager.read(curves)
    apart |= extra.of(len(curves), response.__getitem__)
    return over_cases(imager, by_case(response, members, _CSD)) | apart | {EXPOSURE: exposure_s}
