"""Sensitivity: light that a design's filters transmit."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base.types import CurvesGradient, PerRow
from ...camera.setup import Setup
from ...designs.block import Block, CurveBlock
from ..batch import Batch
from ..metric import Metric
from ..quantity import Columns, LinearRows, Quantity, RequestedQuantities
from ..separation import cfa_sensitivity
from ..smooth import Rows, SmoothDesign

SENSITIVITY, CFA_SENSITIVITY = "sensitivity", "cfa_sensitivity"


def reference_of(brightest: str) -> str:
    """Return the name of the sensor whose CFA sensitivity is 1.

    `brightest`: brightest curve, if the study has no clear pixel.
    """
    alone = f"a sensor of {brightest} pixels alone, its brightest curve"
    return alone if brightest else "a sensor without color filters"


class Sensitivity(Metric):
    """Total QE of the modified channels relative to the replaced curves, and of the CFA relative to a clear sensor."""

    order = 1
    needs = "filters"

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        of_filter = Quantity(
            name=SENSITIVITY,
            metric=SENSITIVITY,
            meaning="sensitivity of the modified channel (1 = the channel it replaces)",
            direction="more",
            role="light",
            ends=("min", "max"),
            goal=True,
            needs="modified",
            most=1.0,
            smooth=partial(_row, name=SENSITIVITY),
            linear=_modified_share,
        )
        of_cfa = Quantity(
            name=CFA_SENSITIVITY,
            metric=CFA_SENSITIVITY,
            meaning=f"sensitivity of the CFA: the light of the whole tile (1 = {reference_of(requested.brightest)})",
            label="CFA sensitivity",
            direction="more",
            role="light",
            ends=("min", "max"),
            goal=True,
            smooth=partial(_row, name=CFA_SENSITIVITY),
            linear=_whole_share,
        )
        return of_filter, of_cfa

    def of_batch(self, batch: Batch) -> Columns:
        """Compute the sensitivity of N relative to Y, NaN without a modified channel, and that of the CFA."""
        return sensitivities(batch.setup, batch.block)


def sensitivities(setup: Setup, block: Block) -> Columns:
    """Return the sensitivities of designs."""
    modified, counts = list(setup.camera.modified), setup.camera.mosaic.counts
    grid = setup.camera.grid
    integrals = np.asarray(np.kron(np.eye(len(modified)), grid.bins_nm[:, None]), dtype=float)
    totals = block.product(integrals, np.arange(grid.size)) if modified else np.empty((len(block), 0))
    every = np.empty((len(block), len(counts)))
    every[:] = grid.integrate(setup.camera.qe)
    every[:, modified] = totals
    sensitivity = (
        totals.sum(axis=1) / grid.integrate(setup.camera.base_qe).sum() if modified else np.full(len(block), np.nan)
    )
    return {
        SENSITIVITY: sensitivity,
        CFA_SENSITIVITY: cfa_sensitivity(every, counts, grid.integrate(setup.camera.clear_qe)),
    }


def sensitivities_gradient(setup: Setup, curves_gradient: CurvesGradient) -> Columns:
    """Return exact derivatives of `sensitivity` and `cfa_sensitivity`."""
    grid, counts = setup.camera.grid, setup.camera.mosaic.counts
    total = grid.integrate(curves_gradient)
    clear_light = counts.sum() * grid.integrate(setup.camera.clear_qe)
    return {
        SENSITIVITY: total.sum(axis=1) / grid.integrate(setup.camera.base_qe).sum(),
        CFA_SENSITIVITY: total @ counts[list(setup.camera.modified)] / clear_light,
    }


def cfa_sensitivity_at(setup: Setup, sensitivity: float) -> float | None:
    """Return the CFA sensitivity for a sensitivity of the only modified channel.

    None if several channels are modified.
    """
    if len(setup.camera.modified) != 1:
        return None
    share_rows = _whole_share(setup)
    return float(share_rows.rows.toarray()[0] @ setup.camera.base_qe[0] * sensitivity + share_rows.constant)


def light_of(design: SmoothDesign) -> Columns:
    """Return both sensitivities of one design."""
    block = CurveBlock(design.curves[None])
    return design.cached("light", lambda: sensitivities(design.setup, block))


def _row(design: SmoothDesign, *, name: str) -> Rows:
    slopes = design.cached("slopes of light", lambda: sensitivities_gradient(design.setup, design.by_u))
    return Rows(light_of(design)[name], slopes[name][None])


def _modified_share(setup: Setup) -> LinearRows:
    """Return the linear rows of the sensitivity of the only modified channel."""
    grid = setup.camera.grid
    return _one_row(grid.bins_nm / grid.integrate(setup.camera.base_qe[0]))


def _whole_share(setup: Setup) -> LinearRows:
    """Return the linear rows of the CFA sensitivity."""
    counts, modified = setup.camera.mosaic.counts, setup.camera.modified[0]
    grid = setup.camera.grid
    clear_light = counts.sum() * grid.integrate(setup.camera.clear_qe)
    others = float(np.delete(grid.integrate(setup.camera.qe) * counts, modified).sum())
    return _one_row(grid.bins_nm * (counts[modified] / clear_light), others / clear_light)


def _one_row(weights: PerRow, constant: float = 0.0) -> LinearRows:
    from scipy.sparse import csr_matrix  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return LinearRows(csr_matrix(weights[None]), constant)
