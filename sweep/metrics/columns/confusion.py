"""Confusion of signal types by noise: contrast to noise, d', errors and their bounds, for each pair of states."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from ...base.types import FloatArray, MemberNumbers, PerDesign
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
from ..smooth_noise import bound_rows, error_decades, pair_rows

CNR, D_PRIME, ERROR, ERROR_BOUND = "cnr", "dprime", "error", "error_bound"
STATE_ERROR, STATE_ERROR_BOUND = "state_error", "state_error_bound"
_MEANINGS = {
    CNR: "CSD over the noise along the line of the nearest pair",
    D_PRIME: "smallest distance in units of the noise (d') over the pairs of two types: the Mahalanobis distance "
    "that is discussed for IEEE P2020",
    ERROR: "largest probability that noise turns a signal of one of two types into one of the other, pair by pair; "
    "in a patch of few pixels within 6.5 % of the exact sum over digital numbers",
    ERROR_BOUND: "bound on how often the best rule takes a signal of one of two types for the other, for the worst "
    "signal",
    STATE_ERROR: "error of the worst pair of states: how often noise makes one of two look like the other",
    STATE_ERROR_BOUND: "bound on how often the best rule misclassifies, for the worst signal",
}
_TOLD = {CNR: "contrast to noise", D_PRIME: "d'"}
_ByPair = dict[Pair, FloatArray]
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

    def of_batch(self, batch: Batch) -> Columns:
        """Compute exact sums over the digital numbers of a few pixels, else Gaussian errors or bounds."""
        if not batch.noisy:
            return {}
        read, members = batch.read_with_noise, batch.confused
        mean, variance, _ = NoiseShape.of_cases(read)
        error, bound, state_bound = _errors(batch, members)
        columns: Columns = {}
        for pair in class_pairs(list(members)):
            pair_members = members[pair[0]], members[pair[1]]
            for metric, quantity in ((CNR, contrast_to_noise), (D_PRIME, detectability)):
                values = quantity(mean, variance, *pair_members)
                columns[pair_name(metric, pair)] = values.reshape(read.mean.shape[:2]).min(axis=1)
            columns[pair_name(ERROR, pair)] = error[pair]
            columns[pair_name(ERROR_BOUND, pair)] = bound[pair]
        columns[STATE_ERROR] = np.max(list(error.values()), axis=0)
        columns[STATE_ERROR_BOUND] = state_bound
        return columns


def _quantity(metric: str, name: str, types: tuple[str, ...]) -> Quantity:
    less, pairs = metric in _LESS, class_pairs(types)
    if metric in (ERROR_BOUND, STATE_ERROR_BOUND):
        smooth = partial(bound_rows, types=types)
    else:
        of = {CNR: contrast, D_PRIME: dprime}.get(metric, error_decades)
        smooth = partial(pair_rows, of=of, pairs=pairs, squared=not less)
    return Quantity(
        name=name,
        metric=metric,
        meaning=_MEANINGS[metric],
        pair=pairs[0] if metric in (CNR, D_PRIME, ERROR, ERROR_BOUND) else None,
        states=types,
        label=f"{'/'.join(types)} {_TOLD[metric]}" if metric in _TOLD else "",
        direction="less" if less else "more",
        goal=True,
        nominal=True,  # each shift would take an evaluation with noise
        infinite=True,  # signals without noise are separated with certainty
        scale="log10" if less else "squared",
        distance_kind="noise" if metric == D_PRIME else "",
        smooth=smooth,
    )


def state_errors(batch: Batch) -> PerDesign:
    """Return the error of the worst pair of states alone."""
    exact, members = _exact(batch), batch.confused
    if exact is not None:
        return np.asarray(np.max([error for case in exact for error in case.error.values()], axis=0), dtype=float)
    return np.asarray(np.max(list(_gaussian(batch.read_with_noise, members).values()), axis=0), dtype=float)


def _exact(batch: Batch) -> list[errors.Errors] | None:
    """Return errors and bounds in each case by exact sums; None if these are too many."""
    readout = batch.model.readout
    pixels = readout.few_pixels
    if pixels is None or not errors.affordable(readout.pixel, pixels):
        return None
    light = readout.of_pixels(readout.capture_light) if readout.pixel.captures else None
    electrons = np.moveaxis(batch.model.pixel_electrons(batch.curves), -3, 0)
    return [errors.errors(case, pixels, readout.pixel, batch.confused, light) for case in electrons]


def _gaussian(read: NoisyReadout, members: Mapping[str, MemberNumbers]) -> _ByPair:
    """Return the error of each pair, Gaussian or a bound: the largest over the cases."""
    mean, variance, shape = NoiseShape.of_cases(read)
    return {
        (a, b): pairwise_error(mean, variance, members[a], members[b], shape).reshape(read.mean.shape[:2]).max(axis=1)
        for a, b in class_pairs(list(members))
    }


def _errors(batch: Batch, members: Mapping[str, MemberNumbers]) -> tuple[_ByPair, _ByPair, PerDesign]:
    """Return error and bound of each pair, and the bound of all states, the largest over the cases."""
    exact, pairs = _exact(batch), class_pairs(list(members))
    if exact is not None:
        return (
            {pair: np.max([errors.error[pair] for errors in exact], axis=0) for pair in pairs},
            {pair: np.max([errors.bound[pair] for errors in exact], axis=0) for pair in pairs},
            np.max([errors.state_bound for errors in exact], axis=0),
        )
    read = batch.read_with_noise
    mean, variance, shape = NoiseShape.of_cases(read)
    bounds, state_bound = error_bounds(mean, variance, members, shape)
    cases = read.mean.shape[:2]
    bound = {pair: values.reshape(cases).max(axis=1) for pair, values in bounds.items()}
    return _gaussian(read, members), bound, state_bound.reshape(cases).max(axis=1)
