"""Color separation distance (CSD): distance of two signal types in the digital numbers of a CFA."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from ...spectra.lights import class_pairs
from ..batch import CaseReadings
from ..metric import Metric
from ..quantity import BEST_PHASE, DN, Columns, Quantity, RequestedQuantities
from ..separation import csd_name, separations, separations_along
from ..smooth import SmoothDesign

CSD = "csd"
"""Metric of the separations, without those at the best place."""


class ColorSeparation(Metric):
    """CSD of each pair of signal types, and the best one over all sampling phases."""

    order = 0

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        nearest = [
            Quantity(
                name=csd_name(pair),
                metric=CSD,
                meaning="color separation distance (CSD) of two signal types: the distance of the two nearest lights, "
                "one of each type, over the CFA's distinct channels",
                unit=DN,
                label=f"{pair[0]}/{pair[1]} CSD",
                digits=1,
                direction="more",
                role="separation",
                ends=("min",),
                goal=True,
                has_error_bound=True,
                pair=pair,
                scale="squared",
                distance_kind="DN",
                smooth=partial(SmoothDesign.squared_distances, pair=pair),
                smooth_members=partial(SmoothDesign.squared_distances_of_members, pair=pair),
                yield_rows=partial(SmoothDesign.distance_of_a_share, pair=pair),
            )
            for pair in class_pairs(requested.classes)
        ]
        best = [
            replace(
                csd,
                name=BEST_PHASE + csd.name,
                metric="best_phase_csd",
                meaning="where a scene asks for `any` sampling phase: the largest CSD over all real "
                "sampling phases, and over the positions of a `field`, each at its worst moment of a pulsed light; "
                "`csd_<a>_<b>` is then the smallest",
                label=f"{csd.words} at its best sampling phase",
                extreme="best place",
                of=csd.name,
                ends=(),
                goal=False,
                scale="linear",
                distance_kind="",
                smooth=None,
                smooth_members=None,
                yield_rows=None,
            )
            for csd in nearest
        ]
        return (*nearest, *best) if requested.any_place else tuple(nearest)

    def of_readings(self, readings: CaseReadings) -> Columns:
        """Compute the columns; see `separation.separations`."""
        members = readings.setup.members
        if readings.whole is not None:
            return {csd_name(pair): distances for pair, distances in separations(readings.whole, members).items()}
        assert readings.fixed is not None
        assert readings.values is not None
        along = separations_along(readings.fixed, readings.channel, readings.values, members)
        return {csd_name(pair): distances for pair, distances in along.items()}
