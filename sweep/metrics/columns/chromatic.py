"""Chromatic separation of two signal types: that of lamps of unknown brightness, in DN and under noise."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base.types import PerDesign
from ...camera.brightness import room_dn, room_of
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
        pairs = readings.pairs
        if not pairs:
            return {}
        if readings.whole is None:
            distances, holds_dn = _along(readings)
        else:
            holds_dn = room(readings)
            distances = dict.fromkeys(pairs, np.full(len(readings.dn), np.nan))
            if (holds_dn > 0).any():
                distances = in_closed_form(readings)
        closed = {pair: np.where(distances[pair] <= holds_dn, distances[pair], np.nan) for pair in pairs}
        return {pair_name(CHROMATIC_CSD, pair): values for pair, values in closed.items()}

    def of_cases(self, batch: Batch) -> Columns:
        """Compute columns of designs that have no closed form from brightness curves."""
        return completed(batch, CHROMATIC_CSD, "DN")


def in_closed_form(readings: CaseReadings) -> dict[Pair, PerDesign]:
    """Return distances as if no pixel filled, DN."""
    if readings.whole is None:
        return _along(readings)[0]
    return chromatic_separations(readings.dn - readings.dark[:, None], readings.setup.members)


def room(readings: CaseReadings) -> PerDesign:
    """Return the chromatic distance up to which the closed form holds, DN."""
    if readings.whole is not None:
        return room_dn(readings.setup, readings.dn, readings.dark)
    assert readings.fixed is not None
    assert readings.values is not None
    others = np.delete(readings.fixed, readings.channel, axis=1)
    lit = np.delete(readings.fixed - readings.dark[0], readings.channel, axis=1).max(axis=1, initial=-np.inf)
    own = readings.values - readings.dark[:, readings.channel, None]
    least_dn = np.maximum(own, lit).min(axis=1)
    return _room(readings, np.maximum(readings.values.max(axis=1), others.max(initial=-np.inf)), least_dn)


def completed(batch: Batch, metric: str, kind: DistanceKind) -> Columns:
    """Return distances in each case, of designs that have no closed form everywhere from brightness curves."""
    closed = {pair: batch.by_case[pair_name(metric, pair)] for pair in batch.pairs}
    if not closed:
        return {}
    missing = np.any([np.isnan(values).any(axis=0) for values in closed.values()], axis=0)
    walked = batch.walked(kind, missing)
    return {pair_name(metric, pair): np.where(missing, walked[pair], values) for pair, values in closed.items()}


def _along(readings: CaseReadings) -> tuple[dict[Pair, PerDesign], PerDesign]:
    """Return distances, DN, of designs that differ in one channel, and up to which of them the closed form holds."""
    assert readings.fixed is not None
    assert readings.values is not None
    of_designs = readings.fixed, readings.channel, readings.values, readings.dark
    distances, most_dn, least_dn = chromatic_along(*of_designs, readings.setup.members, readings.pairs)
    return distances, _room(readings, most_dn, least_dn)


def _room(readings: CaseReadings, most_dn: PerDesign, least_dn: PerDesign) -> PerDesign:
    dark, channel = readings.dark, readings.channel
    dark_dn, others_dn = dark[:, channel], np.delete(dark[0], channel)
    darkest_dn = np.minimum(dark_dn, others_dn.min(initial=np.inf))
    brightest_dn = np.maximum(dark_dn, others_dn.max(initial=-np.inf))
    return room_of(readings.setup, most_dn, least_dn, darkest_dn, brightest_dn)


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
        if not batch.any_brightness:
            return {}
        walked = batch.walked("noise", np.ones(batch.size, dtype=bool))
        return {pair_name(CHROMATIC_DPRIME, pair): dprime for pair, dprime in walked.items()}

    def of_batch(self, batch: Batch) -> Columns:
        """Compute errors from the smallest d'; they are at least those of equal brightness, if known."""
        columns: Columns = {}
        for pair in class_pairs(list(batch.states)) if batch.any_brightness else ():
            error = error_of(batch.columns[pair_name(CHROMATIC_DPRIME, pair)])
            equal = batch.columns.get(pair_name(ERROR, pair))
            columns[pair_name(CHROMATIC_ERROR, pair)] = error if equal is None else np.maximum(error, equal)
        return columns
