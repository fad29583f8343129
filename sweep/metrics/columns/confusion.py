"""Confusion of signal types by noise: d' and errors of each pair of states."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base.types import Array, Float
from ...camera.noise import errors
from ...camera.readout import light_of_elements
from ...spectra.lights import Pair, class_pairs, pair_name
from ..batch import Batch
from ..discrimination import detectability, dprime, error_of
from ..metric import Metric
from ..quantity import Columns, Quantity, RequestedQuantities
from ..smooth_noise import error_decades, pair_rows

D_PRIME, ERROR, STATE_ERROR = "dprime", "error", "state_error"
_MEANINGS = {
    D_PRIME: "smallest distance over the pairs of two types in units of the noise (d'), on both sides of the best "
    "plane; where both noises are alike it is the Mahalanobis distance that is discussed for IEEE P2020",
    ERROR: "largest probability that noise turns a signal of one of two types into one of the other, pair by pair; "
    "of at most 16 pixels a channel (of merged captures 4) a sum over digital numbers, of more Q(d'/2)",
    STATE_ERROR: "error of the worst pair of states: how often noise makes one of two look like the other",
}


class Confusion(Metric):
    """The worst over sampling phases and moments."""

    order = 5
    needs = "noise"

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        if not requested.states:
            return ()
        pairwise = [
            _quantity(metric, pair_name(metric, pair), pair)
            for pair in class_pairs(requested.states)
            for metric in (D_PRIME, ERROR)
        ]
        return (*pairwise, _quantity(STATE_ERROR, STATE_ERROR, requested.states))

    def of_cases(self, batch: Batch) -> Columns:
        """Compute d', and errors by exact sums over the digital numbers of few pixels, else from d'."""
        read, members = batch.read_with_noise, batch.confused
        shape = read.mean.shape
        mean, variance = (values.reshape(-1, *shape[2:]) for values in (read.mean, read.variance))
        exact, columns, worst = _exact(batch), Columns(), np.zeros((shape[1], shape[0]))
        for pair in class_pairs(list(members)):
            values = detectability(mean, variance, members[pair[0]], members[pair[1]]).reshape(shape[:2]).T
            error = error_of(values) if exact is None else exact[pair]
            columns |= {pair_name(D_PRIME, pair): values, pair_name(ERROR, pair): error}
            worst = np.maximum(worst, error)
        return columns | {STATE_ERROR: worst}


def _quantity(metric: str, name: str, types: tuple[str, ...]) -> Quantity:
    less, pairs = metric != D_PRIME, class_pairs(types)
    return Quantity(
        name=name,
        metric=metric,
        meaning=_MEANINGS[metric],
        pair=None if metric == STATE_ERROR else pairs[0],
        states=types,
        label="" if less else f"{'/'.join(types)} d'",
        direction="less" if less else "more",
        goal=True,
        nominal=True,  # each shift would take an evaluation with noise
        infinite=True,  # signals without noise are separated with certainty
        scale="log10" if less else "squared",
        distance_kind="" if less else "noise",
        smooth=partial(pair_rows, of=error_decades if less else dprime, pairs=pairs, squared=not less),
    )


def _exact(batch: Batch) -> dict[Pair, Float[Array, "cases designs"]] | None:
    """Return errors in each case by exact sums; None if these are too many."""
    model, pixel = batch.model, batch.setup.camera.pixel
    if not errors.few_pixels(batch.setup.scene, pixel, batch.setup.camera.mosaic):
        return None
    view = model.own_views[0]
    channels, light = view.image.pixels_of_channels(), None
    if pixel.captures:
        light = light_of_elements(model.exposures, view.image.channel)
    of_exposures = model.pixel_electrons(batch.curves)
    electrons = np.moveaxis(of_exposures if pixel.captures else of_exposures[0], -3, 0)
    of_cases = [errors.errors(case, channels, pixel, batch.confused, light) for case in electrons]
    return {pair: np.array([of_case[pair] for of_case in of_cases]) for pair in of_cases[0]}
