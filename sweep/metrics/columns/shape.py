"""Shape of a filter: steepest slope, and smallest transmission relative to its base."""

from __future__ import annotations

import numpy as np

from ...camera.setup import Setup
from ..batch import Batch
from ..metric import Metric
from ..quantity import Columns, LinearRows, Quantity, RequestedQuantities
from ..smooth import Rows, SmoothDesign

_SLOPE, _LEAST = "slope_per_nm", "min_transmission"


class Shape(Metric):
    """Slope and smallest transmission."""

    order = 2
    needs = "filters"

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        slope = Quantity(
            name=_SLOPE,
            metric=_SLOPE,
            meaning="steepest slope of a modified channel's QE, per nm",
            unit="1/nm",
            label="slope",
            direction="less",
            needs="modified",
            smooth=_slopes,
            linear=_steps,
        )
        least = Quantity(
            name=_LEAST,
            metric=_LEAST,
            meaning="smallest ratio of a modified channel to the curve it replaces",
            label="least transmission",
            direction="more",
            needs="modified",
            most=1.0,
            share=True,
            smooth=_ratios,
        )
        return slope, least

    def of_batch(self, batch: Batch) -> Columns:
        """Compute the steepest slope and the smallest ratio over the wavelengths; NaN without a modified channel."""
        camera = batch.setup.camera
        if not camera.modified:
            return dict.fromkeys((_SLOPE, _LEAST), np.full(batch.size, np.nan))
        steepest, lowest = batch.block.shapes(np.asarray(camera.base_qe, dtype=float))
        return {_SLOPE: steepest / camera.grid.step_nm, _LEAST: lowest}


def _slopes(design: SmoothDesign) -> Rows:
    """Return slopes up and down at every wavelength, 1/nm."""
    step = design.setup.camera.grid.step_nm
    steep = np.diff(design.curves, axis=-1).ravel() / step
    by_u = np.diff(design.by_u, axis=-1).reshape(len(design.by_u), -1).T / step
    return Rows(np.concatenate([steep, -steep]), np.vstack([by_u, -by_u]))


def _ratios(design: SmoothDesign) -> Rows:
    """Return curve over base at every wavelength with a base above 0."""
    base = design.setup.camera.base_qe.ravel()
    has_base = base > 0
    by_u = design.by_u.reshape(len(design.by_u), -1).T
    return Rows(design.curves.ravel()[has_base] / base[has_base], by_u[has_base] / base[has_base, None])


def _steps(setup: Setup) -> LinearRows:
    """Return differences of neighboring wavelengths, down and up."""
    from scipy.sparse import csr_matrix, diags_array, vstack  # noqa: PLC0415  (slow to import: kept off the start-up path)

    size = setup.camera.grid.size
    up = csr_matrix(diags_array([-1.0, 1.0], offsets=[0, 1], shape=(size - 1, size)))
    return LinearRows(vstack([-up, up]).tocsr(), scale=setup.camera.grid.step_nm)
