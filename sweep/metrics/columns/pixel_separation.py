"""Separations in which every pixel of the tile counts: RGGB's two greens are two, as noise sees them."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base.types import PerChannel, PerDesign
from ...camera.brightness import room_dn
from ...spectra.lights import Pair, class_pairs, pair_name
from ..batch import Batch, CaseReadings
from ..chromatic import chromatic_along, chromatic_rows, chromatic_separations
from ..metric import Metric
from ..quantity import DN, Columns, Quantity, RequestedQuantities
from ..separation import pixel_roots, separations, separations_along
from ..smooth import SmoothDesign
from .chromatic import room_along

PIXEL_CSD, CHROMATIC_PIXEL_CSD = "pixel_csd", "chromatic_pixel_csd"
_COUNTED = (
    "with each channel counted as often as it has pixels (per four pixels, those of RGGB's tile), and not once: the "
    "mean of two pixels has half the variance of one"
)
_LATTICE = "where phases, field positions or moments count, the smallest over their lattice"


class PixelSeparation(Metric):
    """CSD and chromatic CSD of each pair of signal types, with every pixel counted."""

    order = 98

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        return tuple(
            quantity
            for pair in class_pairs(requested.classes)
            for quantity in (
                Quantity(
                    name=pair_name(PIXEL_CSD, pair),
                    metric=PIXEL_CSD,
                    meaning=f"the CSD {_COUNTED}; {_LATTICE}",
                    unit=DN,
                    label=f"{pair[0]}/{pair[1]} CSD by pixel",
                    digits=1,
                    direction="more",
                    goal=True,
                    nominal=True,
                    pair=pair,
                    scale="squared",
                    distance_kind="DN",
                    per_pixel=True,
                    smooth=partial(SmoothDesign.squared_distances, pair=pair, per_pixel=True),
                ),
                Quantity(
                    name=pair_name(CHROMATIC_PIXEL_CSD, pair),
                    metric=CHROMATIC_PIXEL_CSD,
                    meaning=f"the chromatic separation {_COUNTED}; {_LATTICE}",
                    unit=DN,
                    label=f"chromatic {pair[0]}/{pair[1]} CSD by pixel",
                    digits=1,
                    direction="more",
                    goal=True,
                    nominal=True,
                    pair=pair,
                    scale="squared",
                    distance_kind="chromatic",
                    per_pixel=True,
                    smooth=partial(chromatic_rows, pairs=(pair,), noise=False, per_pixel=True),
                ),
            )
        )

    def of_readings(self, readings: CaseReadings) -> Columns:
        """Compute the columns in closed form; chromatic ones are NaN where a pixel may fill before."""
        roots, members = pixel_roots(readings.setup.camera.mosaic), readings.setup.members
        if readings.whole is not None:
            apart = separations(readings.whole * roots, members)
        else:
            assert readings.fixed is not None
            assert readings.values is not None
            channel = readings.channel
            apart = separations_along(readings.fixed * roots, channel, readings.values * roots[channel], members)
        columns = {pair_name(PIXEL_CSD, pair): distances for pair, distances in apart.items()}
        if readings.pairs:
            distances, room = _far_apart(readings, roots)
            for pair in readings.pairs:
                far = np.where(distances[pair] <= room * roots.min(), distances[pair], np.nan)
                columns[pair_name(CHROMATIC_PIXEL_CSD, pair)] = far
        return columns

    def of_batch(self, batch: Batch) -> Columns:
        """Compute columns that have no closed form from brightness curves."""
        closed = {pair: batch.columns[pair_name(CHROMATIC_PIXEL_CSD, pair)] for pair in batch.pairs}
        return {
            pair_name(CHROMATIC_PIXEL_CSD, pair): np.where(np.isnan(values), walked[pair], values)
            for walked in [_walked(batch, closed)]
            for pair, values in closed.items()
        }


def _far_apart(readings: CaseReadings, roots: PerChannel) -> tuple[dict[Pair, PerDesign], PerDesign]:
    """Return distances with every pixel counted, DN, and up to which of those without it the closed form holds."""
    setup, dark, pairs = readings.setup, readings.dark, readings.pairs
    if readings.whole is not None:
        room = room_dn(setup, readings.dn, dark)
        distances = dict.fromkeys(pairs, np.full(len(dark), np.nan))
        if (room > 0).any():
            distances = chromatic_separations((readings.dn - dark[:, None]) * roots, setup.members)
        return distances, room
    assert readings.fixed is not None
    assert readings.values is not None
    channel, counted = readings.channel, (readings.fixed * roots, readings.values * roots[readings.channel])
    distances, _, _ = chromatic_along(counted[0], channel, counted[1], dark * roots, setup.members, pairs)
    return distances, room_along(readings)


def _walked(batch: Batch, closed: dict[Pair, PerDesign]) -> dict[Pair, PerDesign]:
    """Return the distances of the designs for which one is missing."""
    if not closed:
        return {}
    missing = np.any([np.isnan(values) for values in closed.values()], axis=0)
    return batch.over_brightness_by_pixel(missing)
