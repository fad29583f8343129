"""Chromatic separation of two signal types: without the part that is brightness."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from ...base.types import FloatArray, IndexArray
from ...camera.forward import ForwardModel
from ...camera.readout import NoisyReadout
from ...camera.setup import Setup
from ...spectra.lights import class_pairs, pair_name
from ..chromatic import chromatic_rows, chromatic_separations, noise_referred
from ..metric import NoiseMetric, ReadoutMetric
from ..quantity import DN, Columns, Quantity, RequestedQuantities

CHROMATIC_CSD, CHROMATIC_DPRIME = "chromatic_csd", "chromatic_dprime"


class ChromaticSeparation(ReadoutMetric):
    """Chromatic CSD of each pair of signal types."""

    order = 1

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        return tuple(
            Quantity(
                name=pair_name(CHROMATIC_CSD, pair),
                metric=CHROMATIC_CSD,
                meaning="chromatic separation: the distance of the two nearest lights of two types if either may have "
                "any brightness, min(|y1|, |y2|) sin(angle) of their responses less those without lamps (black level, "
                "dark current, background)",
                unit=DN,
                label=f"chromatic {pair[0]}/{pair[1]} CSD",
                digits=1,
                wanted="more",
                ends=("min",),
                goal=True,
                pair=pair,
                rows="squares",
                apart="chromatic",
                smooth=partial(chromatic_rows, pairs=(pair,), noise=False),
            )
            for pair in class_pairs(requested.classes)
        )

    def of_readout(self, setup: Setup, response: FloatArray, unlit: FloatArray) -> Columns:
        """Compute the columns; see `chromatic.chromatic_separations`."""
        distances = chromatic_separations(response - unlit[:, None], setup.members)
        return {pair_name(CHROMATIC_CSD, pair): distance_dn for pair, distance_dn in distances.items()}


class ChromaticDetectability(NoiseMetric):
    """Chromatic distance of each pair of states in units of the noise, the worst over sampling phases and moments."""

    order = 5

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        return tuple(
            Quantity(
                name=pair_name(CHROMATIC_DPRIME, pair),
                metric=CHROMATIC_DPRIME,
                meaning="chromatic separation in units of the noise: as `dprime_<a>_<b>`, if either lamp may have any "
                "brightness",
                label=f"chromatic {pair[0]}/{pair[1]} d'",
                wanted="more",
                ends=("min",),
                goal=True,
                nominal=True,  # each shift would take an evaluation with noise
                pair=pair,
                states=pair,
                rows="squares",
                smooth=partial(chromatic_rows, pairs=(pair,), noise=True),
            )
            for pair in class_pairs(requested.states)
        )

    def of_noise(
        self, imager: ForwardModel, curves: FloatArray, read: NoisyReadout, members: Mapping[str, IndexArray]
    ) -> Columns:
        """Compute the columns from mean and variance of the digital numbers."""
        shape = (-1, *read.mean.shape[2:])
        mean = (read.mean - imager.unlit(curves, read.exposure_s)[:, :, None]).reshape(shape)
        variance = read.variance.reshape(shape)
        return {
            pair_name(CHROMATIC_DPRIME, (a, b)): noise_referred(mean, variance, members[a], members[b])
            .reshape(read.mean.shape[:2])
            .min(axis=1)
            for a, b in class_pairs(list(members))
        }
