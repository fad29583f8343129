"""Separations in which every pixel of the tile counts: RGGB's two greens are two, as noise sees them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from ...spectra.lights import pair_name
from ..batch import Batch, CaseReadings
from ..metric import Metric
from ..quantity import Columns, Quantity, RequestedQuantities
from ..separation import pixel_roots
from ..smooth import Rows
from .chromatic import CHROMATIC_CSD, ChromaticSeparation, closed, completed
from .color_separation import CSD, ColorSeparation

PIXEL_CSD, CHROMATIC_PIXEL_CSD = "pixel_csd", "chromatic_pixel_csd"
_BY_PIXEL = {CSD: PIXEL_CSD, CHROMATIC_CSD: CHROMATIC_PIXEL_CSD}
_COUNTED = (
    "with each channel counted as often as it has pixels (per four pixels, those of RGGB's tile), and not once: the "
    "mean of two pixels has half the variance of one"
)
_ONCE = ColorSeparation()


class PixelSeparation(Metric):
    """CSD and chromatic CSD of each pair of signal types, with every pixel counted."""

    order = 98

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        plain = RequestedQuantities(requested.classes)
        return tuple(
            _by_pixel(quantity) for metric in (_ONCE, ChromaticSeparation()) for quantity in metric.quantities(plain)
        )

    def of_readings(self, readings: CaseReadings) -> Columns:
        """Compute the columns in closed form; chromatic ones are NaN where a pixel may fill before."""
        roots = pixel_roots(readings.setup.camera.mosaic)
        counted = readings.times(roots)
        once = _ONCE.of_readings(counted)
        columns = {name.replace(CSD, PIXEL_CSD, 1): distances for name, distances in once.items()}
        by_pair = closed(counted, readings.room_dn * roots.min())
        return columns | {pair_name(CHROMATIC_PIXEL_CSD, pair): values for pair, values in by_pair.items()}

    def of_cases(self, batch: Batch) -> Columns:
        """Compute columns of designs that have no closed form from brightness curves."""
        return completed(batch, CHROMATIC_PIXEL_CSD, "pixel")


def _by_pixel(once: Quantity) -> Quantity:
    """Return the quantity in which every pixel counts, from the one that counts each channel once."""
    assert once.pair is not None
    assert once.smooth is not None
    smooth: Callable[..., Rows] = once.smooth
    metric = _BY_PIXEL[once.metric]
    return replace(
        once,
        name=pair_name(metric, once.pair),
        metric=metric,
        meaning=f"`{once.name}` {_COUNTED}",
        label=f"{once.label} by pixel",
        role="",
        nominal=True,
        per_pixel=True,
        smooth=partial(smooth, per_pixel=True),
        smooth_members=None,
        yield_rows=None,
    )
