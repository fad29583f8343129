"""Confusion of signal types by noise: contrast to noise, d', errors and their bounds, for each pair of states."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ...base.types import Array, Float
from ...camera.noise import errors
from ...camera.readout import NoisyReadout
from ...spectra.lights import Pair, class_pairs, pair_name
from ..batch import Batch
from ..discrimination import (
    NoiseShape,
    contrast,
    contrast_to_noise,
    detectability,
    dprime,
    error_bounds,
    pairwise_error,
)
from ..metric import Metric
from ..quantity import Columns, Quantity, RequestedQuantities
from ..smooth_noise import error_decades, pair_rows

CNR, D_PRIME, ERROR, ERROR_BOUND = "cnr", "dprime", "error", "error_bound"
STATE_ERROR, STATE_ERROR_BOUND = "state_error", "state_error_bound"
_MEANINGS = {
    CNR: "CSD over the noise along the line of the nearest pair",
    D_PRIME: "smallest distance in units of the noise (d') over the pairs of two types: the Mahalanobis distance "
    "that is discussed for IEEE P2020",
    ERROR: "largest probability that noise turns a signal of one of two types into one of the other, pair by pair; "
    "in a patch of few pixels within 6.5 % of the exact sum over digital numbers, of many the error of Gaussians",
    ERROR_BOUND: "bound on how often the best rule takes a signal of one of two types for the other, for the worst "
    "signal",
    STATE_ERROR: "error of the worst pair of states: how often noise makes one of two look like the other",
    STATE_ERROR_BOUND: "bound on how often the best rule misclassifies, for the worst signal",
}
_TOLD = {CNR: "contrast to noise", D_PRIME: "d'"}
_ByPair = dict[Pair, Float[Array, "cases designs"]]
_LESS = (ERROR, ERROR_BOUND, STATE_ERROR, STATE_ERROR_BOUND)


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
            for metric in (CNR, D_PRIME, ERROR, ERROR_BOUND)
        ]
        return (
            *pairwise,
            *(_quantity(metric, metric, requested.states) for metric in (STATE_ERROR, STATE_ERROR_BOUND)),
        )

    def of_cases(self, batch: Batch) -> Columns:
        """Compute exact sums over the digital numbers of a few pixels, else Gaussian errors, and bounds beside both."""
        if not batch.noisy:
            return {}
        read, members = batch.read_with_noise, batch.confused
        mean, variance, _ = NoiseShape.of_cases(read)
        exact = _exact(batch)
        columns = _gaussian_bounds(batch) if exact is None and batch.bounds else _exact_bounds(exact or [])
        errors: _ByPair = {}
        for pair in class_pairs(list(members)):
            of_pair = mean, variance, members[pair[0]], members[pair[1]]
            columns[pair_name(CNR, pair)] = _in_cases(contrast_to_noise(*of_pair), read)
            columns[pair_name(D_PRIME, pair)] = _in_cases(detectability(*of_pair), read)
            if exact is None:
                errors[pair] = _in_cases(pairwise_error(*of_pair), read)
            else:
                errors[pair] = np.array([case.error[pair] for case in exact])
            columns[pair_name(ERROR, pair)] = errors[pair]
        columns[STATE_ERROR] = np.max(list(errors.values()), axis=0)
        return columns


def _quantity(metric: str, name: str, types: tuple[str, ...]) -> Quantity:
    less, pairs, is_bound = metric in _LESS, class_pairs(types), metric in (ERROR_BOUND, STATE_ERROR_BOUND)
    of = {CNR: contrast, D_PRIME: dprime}.get(metric, error_decades)
    return Quantity(
        name=name,
        metric=metric,
        meaning=_MEANINGS[metric],
        pair=pairs[0] if metric in (CNR, D_PRIME, ERROR, ERROR_BOUND) else None,
        states=types,
        label=f"{'/'.join(types)} {_TOLD[metric]}" if metric in _TOLD else "",
        direction="less" if less else "more",
        goal=not is_bound,
        constrained=not is_bound,
        nominal=True,  # each shift would take an evaluation with noise
        infinite=True,  # signals without noise are separated with certainty
        scale="log10" if less else "squared",
        distance_kind="noise" if metric == D_PRIME else "",
        smooth=None if is_bound else partial(pair_rows, of=of, pairs=pairs, squared=not less),
    )


def _in_cases(values: Float[Array, " rows"], read: NoisyReadout) -> Float[Array, "cases designs"]:
    return values.reshape(read.mean.shape[:2]).T


def _exact(batch: Batch) -> list[errors.Errors] | None:
    """Return errors and bounds in each case by exact sums; None if these are too many."""
    readout = batch.model.readout
    pixels = readout.few_pixels
    if pixels is None or not errors.affordable(readout.pixel, pixels):
        return None
    light = readout.of_pixels(readout.capture_light) if readout.pixel.captures else None
    electrons = np.moveaxis(batch.model.pixel_electrons(batch.curves), -3, 0)
    return [errors.errors(case, pixels, readout.pixel, batch.confused, light) for case in electrons]


def _exact_bounds(exact: Sequence[errors.Errors]) -> Columns:
    """Return the bounds of exact sums in each case."""
    if not exact:
        return {}
    columns = {pair_name(ERROR_BOUND, pair): np.array([case.bound[pair] for case in exact]) for pair in exact[0].bound}
    return columns | {STATE_ERROR_BOUND: np.array([case.state_bound for case in exact])}


def _gaussian_bounds(batch: Batch) -> Columns:
    """Return the bounds of many pixels in each case."""
    read = batch.read_with_noise
    mean, variance, shape = NoiseShape.of_cases(read)
    bounds, state_bound = error_bounds(mean, variance, batch.confused, shape)
    columns = {pair_name(ERROR_BOUND, pair): _in_cases(values, read) for pair, values in bounds.items()}
    return columns | {STATE_ERROR_BOUND: _in_cases(state_bound, read)}
