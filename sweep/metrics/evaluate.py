"""Evaluation of a batch of designs in a scene: every column of light and filters."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..base.types import DesignCurves, DesignParameters
from ..camera.model import SceneModel
from ..camera.noise.errors import few_pixels
from ..camera.setup import Setup
from ..designs.block import Block, CurveBlock
from ..designs.family import Family
from ..spectra.lights import Pair, class_pairs, pair_name
from .batch import Batch, DistanceKind
from .brightness import Walk
from .columns.chromatic import CHROMATIC_CSD, CHROMATIC_DPRIME, CHROMATIC_ERROR
from .columns.color_separation import ColorSeparation
from .columns.confusion import D_PRIME, ERROR, STATE_ERROR
from .columns.exposure import EXPOSURE
from .columns.pixel_separation import CHROMATIC_PIXEL_CSD
from .columns.user import UserColumns
from .metric import Metric
from .places import Sought, can_refine, over_cases, refine
from .quantity import Columns, Quantity, RequestedQuantities, asked_of
from .registry import METRICS, quantities_of
from .separation import csd_name
from .user_metrics import UserMetric

CHROMATIC: dict[DistanceKind, str] = {
    "DN": CHROMATIC_CSD,
    "pixel": CHROMATIC_PIXEL_CSD,
    "noise": CHROMATIC_DPRIME,
}
"""Metrics of distances of lamps of any brightness."""
_CSD = next(metric for metric in METRICS if isinstance(metric, ColorSeparation))


def evaluate(
    model: SceneModel,
    designs: DesignCurves | Block,
    states: Sequence[str] = (),
    *,
    user_metrics: Sequence[UserMetric] = (),
    metrics: Collection[Metric] = METRICS,
    chromatic: Sequence[Pair] | None = None,
    family: Family | None = None,
    points: DesignParameters | None = None,
    refined: Collection[str] | None = None,
) -> Columns:
    """Evaluate a batch of designs as the camera reads them out.

    `metrics`: those whose columns are wanted, beside the CSDs; `chromatic`: the pairs whose chromatic CSD is wanted;
    left out, all of them; `points`: parameters of designs of the `family`, for the columns that these determine;
    `refined`: columns that are, and no others are wanted.

    CSDs are the smallest over sampling phases, field positions and moments of a pulse; ``best_phase_csd_<a>_<b>`` is
    the largest over the phases of the smallest over the moments. Where all phases or field positions count, distances
    and errors are refined.
    """
    block = _block(designs)
    pairs = class_pairs(model.setup.lights.classes) if chromatic is None else chromatic
    has = _available(model.setup, states, points)
    others = [of for of in metrics if of.needs in has and not isinstance(of, ColorSeparation | UserColumns)]
    needs = {of.needs for of in others}
    wanted = "noise" in needs, "any brightness" in needs
    batch = Batch(model, block, states, tuple(pairs), family, points, *wanted)
    of_readings = [_CSD, *others, *map(UserColumns, user_metrics)]
    requested = RequestedQuantities(
        model.setup.lights.classes, tuple(states), any_place=True, user_metrics=tuple(user_metrics)
    )
    batch.by_case = _by_case(batch, of_readings)
    readings = tuple(batch.by_case)
    for metric in others:
        batch.by_case |= metric.of_cases(batch)
    quantities = quantities_of(requested)
    batch.columns = over_cases(model, batch.by_case, quantities) | {EXPOSURE: batch.exposure_s}
    if can_refine(model):
        wanted_names = frozenset(batch.by_case if refined is None else refined)
        wanted_names |= {name.replace(CHROMATIC_ERROR, CHROMATIC_DPRIME) for name in wanted_names}
        parts = [(sought, model) for sought in _of_readings(batch, readings, of_readings, wanted_names)]
        parts += [(sought, model) for sought in _under_noise(batch, others, wanted_names)]
        parts += [(sought, batch.bright_model) for sought in _of_any_brightness(batch, wanted_names)]
        for sought, of in parts:
            refine(sought, of, batch.exposure_s, batch.by_case, batch.columns, quantities)
    # Last those of any brightness: their errors are at least those of equal brightness.
    for metric in sorted(others, key=lambda metric: metric.needs == "any brightness"):
        batch.columns |= metric.of_batch(batch)
    return batch.columns


def _of_readings(batch: Batch, names: Sequence[str], metrics: Sequence[Metric], wanted: frozenset[str]) -> list[Sought]:
    """Return what is sought of each design's readings; chromatic distances where they have a closed form."""
    csds = {csd_name(pair) for pair in class_pairs(batch.setup.lights.classes)}

    def read(design: int, model: SceneModel) -> Columns:
        return _by_case(replace(batch.of(model, design), noisy=False), metrics)

    designs: dict[tuple[str, ...], list[int]] = {}
    for design in batch.finite if wanted & set(names) else ():
        walked = {
            pair_name(CHROMATIC[kind], pair) for kind in CHROMATIC for pair in batch.walks.get((design, kind), {})
        }
        own = tuple(name for name in names if name in wanted and name not in walked)
        designs.setdefault(own, []).append(design)
    best = {own: tuple(number for number, name in enumerate(own) if name in csds) for own in designs}
    return [Sought(tuple(of), own, read, fine=True, best=best[own]) for own, of in designs.items() if own]


def _under_noise(batch: Batch, metrics: Sequence[Metric], wanted: Collection[str]) -> list[Sought]:
    """Return what is sought of each design under noise."""
    noisy = [metric for metric in metrics if metric.needs == "noise"] if batch.noisy else []

    def read(design: int, model: SceneModel) -> Columns:
        at = batch.of(model, design)
        return {name: values for metric in noisy for name, values in metric.of_cases(at).items()}

    pairs = class_pairs(list(batch.states))
    known = (*(pair_name(metric, pair) for metric in (D_PRIME, ERROR) for pair in pairs), STATE_ERROR)
    names = tuple(name for name in known if noisy and name in wanted)
    return [Sought(tuple(batch.finite), names, read)] if names else []


def _of_any_brightness(batch: Batch, wanted: Collection[str]) -> list[Sought]:
    """Return what is sought of each two types of lamps of any brightness in a design, each for itself."""

    def read(kind: DistanceKind, name: str, walk: Walk, design: int, model: SceneModel) -> Columns:
        return {name: batch.followed(model, design, kind, walk)[:, None]}

    sought = []
    for (design, kind), walks in batch.walks.items():
        for pair, walk in walks.items():
            name = pair_name(CHROMATIC[kind], pair)
            if name in wanted and walk.distances.min() > 0:
                sought.append(Sought((design,), (name,), partial(read, kind, name, walk)))
    return sought


def evaluate_some(
    model: SceneModel, curves: DesignCurves, quantities: Sequence[Quantity], states: Sequence[str]
) -> dict[str, float]:
    """Return quantities of one design, by no more than they need."""
    metrics, names = {quantity.metric for quantity in quantities}, {quantity.name for quantity in quantities}
    camera = model.setup.camera
    has_sums = few_pixels(model.setup.scene, camera.pixel, camera.mosaic)
    if CHROMATIC_ERROR in metrics and has_sums:  # exact sums may be larger
        metrics.add(ERROR)
    requested = RequestedQuantities(model.setup.lights.classes, tuple(states), features=asked_of(model.setup.features))
    of_metrics = [of for of in METRICS if metrics & {quantity.metric for quantity in of.quantities(requested)}]
    chromatic = [quantity.pair for quantity in quantities if quantity.metric in CHROMATIC.values() and quantity.pair]
    columns = evaluate(model, curves, states, metrics=of_metrics, chromatic=chromatic, refined=names)
    return {quantity.name: float(columns[quantity.name][0]) for quantity in quantities}


def designed_quantities(setup: Setup, designs: DesignCurves | Block, metrics: Collection[Metric] = METRICS) -> Columns:
    """Return the quantities of designs without light."""
    has = _available(setup)
    without_light = [metric for metric in metrics if metric.needs in has and not metric.of_scene]
    return _of_batch(Batch(SceneModel(setup), _block(designs)), without_light)


def _available(
    setup: Setup,
    states: Sequence[str] = (),
    points: DesignParameters | None = None,
) -> set[str]:
    """Return what metrics may be computed from."""
    needs = {
        "readings": True,
        "filters": True,
        "noise": bool(states),
        "any brightness": bool(states),
        "pulses": setup.scene.drive is not None and bool(setup.camera.pixel.captures),
        "parameters": points is not None,
    }
    return {need for need, available in needs.items() if available} | setup.features.keys()


def _of_batch(batch: Batch, metrics: Collection[Metric]) -> Columns:
    return {name: values for metric in metrics for name, values in metric.of_batch(batch).items()}


def _block(designs: DesignCurves | Block) -> Block:
    return CurveBlock(np.asarray(designs, dtype=float)) if isinstance(designs, np.ndarray) else designs


def _by_case(batch: Batch, metrics: Sequence[Metric]) -> Columns:
    """Return columns of metrics of readings, in each case."""
    columns: Columns = {}
    for designs, cases, readings in batch.readings():
        for metric in metrics:
            for name, values in metric.of_readings(readings).items():
                if name not in columns:
                    columns[name] = np.empty((batch.n_cases, batch.size))
                columns[name][cases, designs] = values.reshape(-1, designs.size)
    return columns
