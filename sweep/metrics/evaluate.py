"""Evaluation of a batch of designs in a scene: every column of light and filters."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from ..base.types import DesignCurves, DesignParameters
from ..camera.model import SceneModel
from ..camera.setup import Setup
from ..designs.block import Block, CurveBlock
from ..designs.family import Family
from ..spectra.lights import Pair, class_pairs
from ..vision.section import SeededVision
from .batch import Batch
from .columns.chromatic import CHROMATIC_DPRIME
from .columns.color_separation import ColorSeparation
from .columns.exposure import EXPOSURE
from .columns.user import UserColumns
from .metric import Metric
from .places import over_cases, refine
from .quantity import Columns, Quantity, RequestedQuantities
from .registry import METRICS
from .user_metrics import UserMetric

_CSD = next(metric for metric in METRICS if isinstance(metric, ColorSeparation))


def evaluate(
    model: SceneModel,
    designs: DesignCurves | Block,
    states: Sequence[str] = (),
    *,
    probabilities: bool = False,
    user_metrics: Sequence[UserMetric] = (),
    metrics: Collection[Metric] = METRICS,
    chromatic: Sequence[Pair] | None = None,
    family: Family | None = None,
    points: DesignParameters | None = None,
    images: SeededVision | None = None,
) -> Columns:
    """Evaluate a batch of designs as the camera reads them out.

    `metrics`: those whose columns are wanted, beside the CSDs; `chromatic`: the pairs whose chromatic CSD is wanted;
    left out, all of them; `points`: parameters of designs of the `family`, for the columns that these determine.

    CSDs are the smallest over sampling phases, field positions and moments of a pulse; ``best_phase_csd_<a>_<b>`` is
    the largest over the phases of the smallest over the moments. Where all phases or field positions count, CSDs are
    refined; other metrics are the worst over the lattice.
    """
    block = _block(designs)
    pairs = class_pairs(model.setup.lights.classes) if chromatic is None else chromatic
    needs = {metric.needs for metric in metrics} if states else set()
    wanted = "noise" in needs, "any brightness" in needs
    batch = Batch(model, block, states, tuple(pairs), probabilities, family, points, images, *wanted)
    others = [metric for metric in metrics if not isinstance(metric, ColorSeparation | UserColumns)]
    by_case = _by_case(batch, [_CSD, *others, *map(UserColumns, user_metrics)])
    batch.columns = over_cases(model, by_case, user_metrics) | {EXPOSURE: batch.exposure_s}
    # Last those of any brightness: their errors are at least those of equal brightness.
    for metric in sorted(others, key=lambda metric: metric.needs == "any brightness"):
        batch.columns |= metric.of_batch(batch)
    return batch.columns | refine(batch, by_case)


def evaluate_some(
    model: SceneModel, curves: DesignCurves, quantities: Sequence[Quantity], states: Sequence[str]
) -> dict[str, float]:
    """Return quantities of one design, by no more than their own metrics where these need none of the other columns."""
    wanted, alone = {quantity.metric for quantity in quantities}, Batch(model, CurveBlock(curves), states)
    alone.any_brightness = wanted == {CHROMATIC_DPRIME}
    requested = RequestedQuantities(model.setup.lights.classes, tuple(states), flicker=True)
    owners = [metric for metric in METRICS if wanted & {of.metric for of in metric.quantities(requested)}]
    if alone.any_brightness or {metric.needs for metric in owners} == {"pulses"}:
        columns = _of_batch(alone, owners)
    else:
        columns = evaluate(model, curves, states)
    return {quantity.name: float(columns[quantity.name][0]) for quantity in quantities}


def designed_quantities(setup: Setup, designs: DesignCurves | Block, metrics: Collection[Metric] = METRICS) -> Columns:
    """Return the quantities of designs without light."""
    batch = Batch(SceneModel(setup), _block(designs))
    return _of_batch(batch, [metric for metric in metrics if metric.needs == "filters"])


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
