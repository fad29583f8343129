"""Chromatic separation of two signal types: that of lamps of unknown brightness, in DN and under noise."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base.types import PerDesign
from ...spectra.lights import Pair, class_pairs, pair_name
from ..batch import Batch, CaseReadings, DistanceKind
from ..chromatic import chromatic_along, chromatic_rows, chromatic_separations
from ..discrimination import error_of
from ..metric import Metric
from ..quantity import DN, Columns, Quantity, RequestedQuantities
from .confusion import ERROR

CHROMATIC_CSD, CHROMATIC_DPRIME, CHROMATIC_ERROR = "chromatic_csd", "chromatic_dprime", "chromatic_error"


class ChromaticSeparation(Metric):
    """Chromatic CSD of each pair of signal types."""

    order = 1

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        return tuple(
            Quantity(
                name=pair_name(CHROMATIC_CSD, pair),
                metric=CHROMATIC_CSD,
                meaning="chromatic separation: the smallest distance between the reading of a light and that of one of "
                "another type of any brightness, from dark to beyond saturation, or within `brightness`; "
                "min(|y1|, |y2|) sin(angle) of the responses less those without lamps where nothing saturates",
                unit=DN,
                label=f"chromatic {pair[0]}/{pair[1]} CSD",
                digits=1,
                direction="more",
                goal=True,
                pair=pair,
                scale="squared",
                distance_kind="chromatic",
                smooth=partial(chromatic_rows, pairs=(pair,), noise=False),
            )
            for pair in class_pairs(requested.classes)
        )

    def of_readings(self, readings: CaseReadings) -> Columns:
        """Compute the columns in closed form; NaN where a pixel may fill before lamps look most alike."""
        return {pair_name(CHROMATIC_CSD, pair): values for pair, values in closed(readings, readings.room_dn).items()}

    def of_cases(self, batch: Batch) -> Columns:
        """Compute columns of designs that have no closed form from brightness curves."""
        return completed(batch, CHROMATIC_CSD, "DN")


def closed(readings: CaseReadings, room_dn: PerDesign) -> dict[Pair, PerDesign]:
    """Return distances as if no pixel filled, DN; NaN beyond some distance."""
    members, pairs = readings.setup.members, readings.pairs
    if not pairs or not (room_dn > 0).any():
        return dict.fromkeys(pairs, np.full(len(readings.dark), np.nan))
    if readings.whole is None:
        assert readings.fixed is not None
        assert readings.values is not None
        of_designs = readings.fixed, readings.channel, readings.values, readings.dark
        distances = chromatic_along(*of_designs, members, pairs)
    else:
        distances = chromatic_separations(readings.whole - readings.dark[:, None], members)
    return {pair: np.where(distances[pair] <= room_dn, distances[pair], np.nan) for pair in pairs}


def completed(batch: Batch, metric: str, kind: DistanceKind) -> Columns:
    """Return distances in each case of designs that have no closed form everywhere: from brightness curves."""
    by_pair = {pair: batch.by_case[pair_name(metric, pair)] for pair in batch.pairs}
    missing = np.any([np.isnan(values).any(axis=0) for values in by_pair.values()], axis=0)
    if not missing.any():
        return {}
    walked = batch.walked(kind, missing)
    return {pair_name(metric, pair): np.where(missing, walked[pair], values) for pair, values in by_pair.items()}


class ChromaticConfusion(Metric):
    """d' and error of each pair of states of lamps of unknown brightness, the worst over phases and moments."""

    order = 5
    needs = "any brightness"

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        return tuple(
            quantity
            for pair in class_pairs(requested.states)
            for quantity in (
                Quantity(
                    name=pair_name(CHROMATIC_DPRIME, pair),
                    metric=CHROMATIC_DPRIME,
                    meaning="smallest distance between the reading of a light and that of one of another type of any "
                    "brightness, in units of the noise of both readings",
                    label=f"chromatic {pair[0]}/{pair[1]} d'",
                    direction="more",
                    pair=pair,
                    states=pair,
                    scale="squared",
                    smooth=partial(chromatic_rows, pairs=(pair,), noise=True),
                    goal=True,
                    nominal=True,  # each shift would take an evaluation with noise
                ),
                Quantity(
                    name=pair_name(CHROMATIC_ERROR, pair),
                    metric=CHROMATIC_ERROR,
                    meaning="how often noise turns a light into one of another type of any brightness, for the worst "
                    "two: Q(d'/2) of the smallest chromatic d', which of few pixels beside a full well or a handover "
                    "may be too small; at least the error of equal brightness, `error_<a>_<b>`",
                    label=f"chromatic {pair[0]}/{pair[1]} error",
                    direction="less",
                    pair=pair,
                    states=pair,
                    scale="log10",
                    smooth=partial(chromatic_rows, pairs=(pair,), noise=True, decades=True),
                    goal=True,
                    nominal=True,  # each shift would take an evaluation with noise
                ),
            )
        )

    def of_cases(self, batch: Batch) -> Columns:
        """Compute d' in each case from brightness curves."""
        walked = batch.walked("noise", np.ones(batch.size, dtype=bool))
        return {pair_name(CHROMATIC_DPRIME, pair): dprime for pair, dprime in walked.items()}

    def of_batch(self, batch: Batch) -> Columns:
        """Compute errors from the smallest d'; they are at least those of equal brightness, if known."""
        columns: Columns = {}
        for pair in class_pairs(list(batch.states)):
            error = error_of(batch.columns[pair_name(CHROMATIC_DPRIME, pair)])
            equal = batch.columns.get(pair_name(ERROR, pair))
            columns[pair_name(CHROMATIC_ERROR, pair)] = error if equal is None else np.maximum(error, equal)
        return columns
