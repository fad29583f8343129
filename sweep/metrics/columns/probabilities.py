"""Contrast transfer accuracy (CTA) of IEEE 2020-2024, formerly contrast detection probability (CDP).

The probability that the Weber contrast K of two noisy readouts, bright over dark less 1, is within a share of the
contrast of their means: P(K (1 - e) <= K measured <= K (1 + e)); Geese, Seger, Paolillo, "Detection probabilities:
performance prediction for sensors of autonomous vehicles" (Electronic Imaging 2018); Artmann, Geese, Gaede, "Contrast
detection probability: implementation and use cases" (2019). Here the pedestal is subtracted, noise is Gaussian, e is
1/2, and the channel with the largest CTA counts.
"""

from __future__ import annotations

import numpy as np

from ...base.types import Array, IndexArray, Int, Num, PerDesign, SameShape
from ...camera.noise.gaussian import share_below
from ...spectra.lights import class_pairs, pair_name
from ..batch import Batch
from ..discrimination import NoiseShape
from ..metric import Metric
from ..quantity import Columns, Quantity, RequestedQuantities

CTA = "cta"
_MOST = 1e12
"""Contrast to a dark readout of 0."""
_SHARE = 0.5
"""How far a measured contrast may be from that of the means, of it."""
_MEANING = (
    "contrast detection probability: that the Weber contrast of two readouts is within half of that of their means, in "
    "the best channel, for the worst two signals of two types"
)


class Probabilities(Metric):
    """The least over sampling phases and moments."""

    order = 6
    needs = "noise"

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        if not requested.probabilities:
            return ()
        return tuple(
            Quantity(
                name=pair_name(CTA, pair),
                metric=CTA,
                meaning=_MEANING,
                pair=pair,
                direction="more",
                most=1.0,
            )
            for pair in class_pairs(requested.states)
        )

    def of_cases(self, batch: Batch) -> Columns:
        """Compute the columns from mean and variance of the digital numbers."""
        if not (batch.noisy and batch.probabilities):
            return {}
        columns, read, members = Columns(), batch.read_with_noise, batch.confused
        mean, variance, _ = NoiseShape.of_cases(read)
        for pair in class_pairs(list(members)):
            pair_members = members[pair[0]], members[pair[1]]
            detected = detection(mean - batch.setup.camera.pixel.offset_dn, variance, *pair_members)
            columns[pair_name(CTA, pair)] = detected.reshape(read.mean.shape[:2]).T
        return columns


def detection(
    mean: Num[Array, "designs signals channels"],
    variance: Num[Array, "designs signals channels"],
    first: Int[IndexArray, " first"],
    second: Int[IndexArray, " second"],
) -> PerDesign:
    """Return the CTA of the worst two signals of two types in their best channel.

    If the darker readout is above 0, the contrast of two Gaussians is within its ends if bright - r dark is above 0
    for the lower ratio r and below it for the higher one. Darker readouts below 0 count against it.

    `mean`, `variance`: mean without pedestal, DN, and variance, DN^2.
    """
    least = np.ones(len(mean))
    for signal in first:
        own, others = mean[:, signal, None], mean[:, second]
        variance_one, other = variance[:, signal, None], variance[:, second]
        bright, dark = np.maximum(own, others), np.minimum(own, others)
        bright_noise = np.where(own >= others, variance_one, other)
        dark_noise = np.where(own >= others, other, variance_one)
        contrast_dn = bright - dark
        contrast = np.divide(contrast_dn, dark, out=np.full(contrast_dn.shape, _MOST), where=dark > 0)
        ratios = [1 + contrast * (1 + side * _SHARE) for side in (1, -1)]
        above, below = (_beyond(_SHARE * contrast_dn, bright_noise, dark_noise, ratio) for ratio in ratios)
        inside = np.maximum(share_below(above) - share_below(-below), 0.0)
        least = np.minimum(least, inside.max(axis=2).min(axis=1))
    return least


def _beyond(
    contrast_dn: SameShape, bright: Num[Array, "*batch"], dark: Num[Array, "*batch"], ratio: SameShape
) -> SameShape:
    """Return a distance over the noise of bright - ratio times dark; 0 for no distance, infinite without noise."""
    noise = np.sqrt(bright + np.where(dark > 0, ratio**2 * dark, 0.0))
    return np.where(
        contrast_dn > 0, np.divide(contrast_dn, noise, out=np.full(contrast_dn.shape, np.inf), where=noise > 0), 0.0
    )
