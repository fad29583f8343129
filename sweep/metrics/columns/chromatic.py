"""Chromatic separation of two signal types: that of lamps of unknown brightness, in DN and under noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from ...base.types import Array, DesignSignals, Float, MemberNumbers
from ...camera.brightness import room_dn, room_of
from ...camera.setup import Setup
from ...spectra.lights import Pair, class_pairs, pair_name
from ..brightness import BrightnessCurves, chromatic_distance, error_of
from ..chromatic import chromatic_along, chromatic_rows, chromatic_separations
from ..metric import LampMetric, ReadoutMetric
from ..quantity import DN, Columns, Quantity, RequestedQuantities
from .confusion import ERROR

CHROMATIC_CSD, CHROMATIC_DPRIME, CHROMATIC_ERROR = "chromatic_csd", "chromatic_dprime", "chromatic_error"


class ChromaticSeparation(ReadoutMetric, LampMetric):
    """Chromatic CSD of each pair of signal types: in closed form where readings are linear in the light."""

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
                ends=("min",),
                goal=True,
                pair=pair,
                scale="squared",
                distance_kind="chromatic",
                smooth=partial(chromatic_rows, pairs=(pair,), noise=False),
            )
            for pair in class_pairs(requested.classes)
        )

    def of_readout(self, setup: Setup, response: DesignSignals, unlit: Float[Array, "designs channels"]) -> Columns:
        """Compute the columns in closed form; NaN where a pixel may fill before lamps look most alike."""
        room = room_dn(setup, response, unlit)
        if not (room > 0).any():
            distances = {pair: np.full(len(response), np.nan) for pair in class_pairs(list(setup.members))}
        else:
            distances = chromatic_separations(response - unlit[:, None], setup.members)
        return {
            pair_name(CHROMATIC_CSD, pair): np.where(distance <= room, distance, np.nan)
            for pair, distance in distances.items()
        }

    def along(
        self,
        setup: Setup,
        fixed: Float[Array, "signals channels"],
        channel: int,
        values: Float[Array, "designs signals"],
        unlit: Float[Array, "designs channels"],
        pairs: Sequence[Pair],
    ) -> Columns:
        """Compute columns as `of_readout`, for designs that differ in one channel alone.

        `fixed`: shared channels, DN, whose response without lamps is the same too; `values`: those of that channel, DN.
        """
        if not pairs:
            return {}
        distances, most_dn, least_dn = chromatic_along(fixed, channel, values, unlit, setup.members, pairs)
        dark_dn, others_dn = unlit[:, channel], np.delete(unlit[0], channel)
        darkest_dn = np.minimum(dark_dn, others_dn.min(initial=np.inf))
        room = room_of(setup, most_dn, least_dn, darkest_dn, np.maximum(dark_dn, others_dn.max(initial=-np.inf)))
        return {
            pair_name(CHROMATIC_CSD, pair): np.where(distance <= room, distance, np.nan)
            for pair, distance in distances.items()
        }

    def of_lamps(
        self, cases: Sequence[BrightnessCurves], members: Mapping[str, MemberNumbers], pairs: Sequence[Pair]
    ) -> dict[str, float]:
        """Compute the columns from brightness curves."""
        return {
            pair_name(CHROMATIC_CSD, (a, b)): chromatic_distance(cases, members[a], members[b], noise=False)
            for a, b in pairs
        }


class ChromaticConfusion(LampMetric):
    """d' and error of each pair of states of lamps of unknown brightness, the worst over phases and moments."""

    order = 5
    of_states = True

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
                    ends=("min",),
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
                    "two: the error of Gaussians at the smallest chromatic d', Q(d'/2), and at least that of equal "
                    "brightness, `error_<a>_<b>`",
                    label=f"chromatic {pair[0]}/{pair[1]} error",
                    direction="less",
                    ends=("max",),
                    pair=pair,
                    states=pair,
                    scale="log10",
                    smooth=partial(chromatic_rows, pairs=(pair,), noise=True, decades=True),
                    goal=True,
                    nominal=True,  # each shift would take an evaluation with noise
                ),
            )
        )

    def of_lamps(
        self, cases: Sequence[BrightnessCurves], members: Mapping[str, MemberNumbers], pairs: Sequence[Pair]
    ) -> dict[str, float]:
        """Compute the columns from brightness curves; see `with_equal_brightness`."""
        columns = {}
        for pair in pairs:
            dprime = chromatic_distance(cases, members[pair[0]], members[pair[1]], noise=True)
            columns[pair_name(CHROMATIC_DPRIME, pair)] = dprime
            columns[pair_name(CHROMATIC_ERROR, pair)] = float(error_of(np.array(dprime)))
        return columns


def with_equal_brightness(columns: Columns, states: Sequence[str]) -> Columns:
    """Return errors of lamps of unknown brightness that are at least those of equal brightness."""
    names = {pair_name(CHROMATIC_ERROR, pair): pair_name(ERROR, pair) for pair in class_pairs(list(states))}
    return {chromatic: np.maximum(columns[chromatic], columns[equal]) for chromatic, equal in names.items()}
