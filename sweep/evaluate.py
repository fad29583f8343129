"""Pure evaluation: a block of designs in a scene -> color separation distances, sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .arrays import FloatArray, IndexArray
from .datasets.lights import Lights
from .discrimination import (
    STATE_ERROR_BOUND,
    contrast_to_noise,
    detectability,
    error_bound,
    noise_names,
    pairwise_error,
    state_error_bound,
)
from .imaging import Imager, smooth_imager
from .metrics import Pair, cfa_sensitivity, channel_sensitivity, class_pairs, csd_name, separation, separations
from .setup import Setup

DESIGNED = ("sensitivity", "cfa_sensitivity", "slope_per_nm", "min_transmission")
"""Quantities of a design that do not depend on the lights."""
WORST = "worst_"
"""Prefix of a quantity that is the smallest over the shifts of the edges in production."""
STATE_ERROR = "state_error"
"""Name of the largest pairwise error over all pairs of states."""
BEST_PLACE = "best_place_"
"""Prefix of a CSD that is the largest over the places where the light may fall on the mosaic."""


def quantities(lights: Lights) -> tuple[str, ...]:
    """Names of the columns that `evaluate` gives for a scene with one place of the light."""
    distances = (csd_name(pair) for pair in class_pairs(lights.classes))
    return (*distances, *DESIGNED, "exposure_s")


def noise_quantities(states: Sequence[str]) -> tuple[str, ...]:
    """Names of the columns that `evaluate` adds for `states`, the signal types that noise may confuse."""
    each = (name for pair in class_pairs(states) for name in noise_names(pair))
    return (*each, STATE_ERROR, STATE_ERROR_BOUND) if states else ()


def shiftable(lights: Lights) -> tuple[str, ...]:
    """Quantities whose worst case over an edge shift is known: all CSDs and both sensitivities."""
    distances = (csd_name(pair) for pair in class_pairs(lights.classes))
    return (*distances, "sensitivity", "cfa_sensitivity")


def all_channels(setup: Setup, curves: FloatArray) -> FloatArray:
    """Put the modified channels among the fixed ones.

    `curves`: ndarray[n_designs, n_modified, n_wavelengths]. Returns ndarray[n_designs, n_channels, n_wavelengths].
    """
    qe = np.repeat(setup.qe[None], len(curves), axis=0)
    qe[:, list(setup.modified)] = curves
    return qe


def smooth_response(setup: Setup, curves: FloatArray) -> FloatArray:
    """Unquantized, unclipped response, DN: ndarray[n_designs, n_cases, n_signals, n_channels]; `curves` as above."""
    return smooth_imager(setup).smooth(curves)


def smooth_csd(setup: Setup, curves: FloatArray, pair: Pair) -> FloatArray:
    """CSD of the smooth response, the smallest over the cases, DN, ndarray[n_designs]."""
    response = smooth_response(setup, curves)
    first, second = (setup.members[name] for name in pair)
    over = [separation(response[:, case], first, second) for case in range(response.shape[1])]
    return np.asarray(np.min(over, axis=0), dtype=float)


def designed_quantities(setup: Setup, curves: FloatArray) -> dict[str, FloatArray]:
    """What a design gives without any light, each ndarray[n_designs]; `curves` as in `all_channels`.

    `sensitivity`: total QE of the modified channels over that of the curves they replace; of several modified channels
    it is that of their sum. `cfa_sensitivity`: see `metrics.cfa_sensitivity`. `slope_per_nm`: the steepest slope of a
    modified channel's QE. `min_transmission`: the smallest ratio of a modified channel to the curve it replaces.
    Without a modified channel all but `cfa_sensitivity` are NaN.
    """
    curves, base_qe = np.asarray(curves, dtype=float), np.asarray(setup.base_qe, dtype=float)
    none = np.full(len(curves), np.nan)
    qe = all_channels(setup, curves)
    found = dict.fromkeys(DESIGNED, none)
    found["cfa_sensitivity"] = cfa_sensitivity(qe, setup.mosaic.counts, setup.clear_qe)
    if setup.modified:
        found["sensitivity"] = channel_sensitivity(curves.sum(axis=1), base_qe.sum(axis=0))
        found["slope_per_nm"] = np.abs(np.diff(curves, axis=-1)).max(axis=(1, 2)) / setup.grid.step_nm
        ratio = np.divide(curves, base_qe, out=np.ones_like(curves), where=base_qe > 0)
        found["min_transmission"] = ratio.min(axis=(1, 2))
    return found


def sensitivities_gradient(setup: Setup, curves_gradient: FloatArray) -> dict[str, FloatArray]:
    """Exact derivatives of `sensitivity` and `cfa_sensitivity`, ndarray[n_parameters].

    `curves_gradient`: ndarray[n_parameters, n_modified, n_wavelengths].
    """
    total = curves_gradient.sum(axis=-1)
    counts = setup.mosaic.counts
    return {
        "sensitivity": total.sum(axis=1) / setup.base_qe.sum(),
        "cfa_sensitivity": total @ counts[list(setup.modified)] / (counts.sum() * setup.clear_qe.sum()),
    }


def _told_apart(mean: FloatArray, variance: FloatArray, members: Mapping[str, IndexArray]) -> dict[str, FloatArray]:
    """The columns of `noise_quantities`, the worst over the cases; `mean`, `variance` as of `read_with_noise`."""
    cases = [(mean[:, case], variance[:, case]) for case in range(mean.shape[1])]

    def over(quantity: Callable[..., FloatArray], worst: Callable[..., FloatArray], *of: Any) -> FloatArray:
        return worst([quantity(*case, *of) for case in cases], axis=0)

    found: dict[str, FloatArray] = {}
    errors = []
    for pair in class_pairs(list(members)):
        both = members[pair[0]], members[pair[1]]
        errors.append(over(pairwise_error, np.max, *both))
        values = (
            over(contrast_to_noise, np.min, *both),
            over(detectability, np.min, *both),
            errors[-1],
            over(error_bound, np.max, *both),
        )
        found |= dict(zip(noise_names(pair), values, strict=True))
    found[STATE_ERROR] = np.max(errors, axis=0)
    found[STATE_ERROR_BOUND] = over(state_error_bound, np.max, members)
    return found


def evaluate(imager: Imager, curves: FloatArray, states: Sequence[str] = ()) -> dict[str, FloatArray]:
    """Evaluate a block of designs as the camera reads them out, as far as the scene's methods go.

    `curves` as in `all_channels`. Returns columns, each ndarray[n_designs]: `csd_<a>_<b>` (DN) of every pair of
    signal types, the smallest over the places of the light; `best_place_csd_<a>_<b>`, the largest, where a scene has
    several; those of `designed_quantities` and `exposure_s`; with `states`, those of `noise_quantities`, the worst over
    the places.
    """
    apart: dict[str, FloatArray] = {}
    if states:
        response, variance, exposure_s = imager.read_with_noise(curves)
        apart = _told_apart(response, variance, {name: imager.setup.members[name] for name in states})
    else:
        response, exposure_s = imager.read(curves)
    columns: dict[str, FloatArray] = {}
    best: dict[str, FloatArray] = {}
    members = imager.setup.members
    cases = [separations(response[:, case], members) for case in range(response.shape[1])]
    for pair in class_pairs(list(members)):
        over = np.stack([case[pair] for case in cases])
        columns[csd_name(pair)] = over.min(axis=0)
        best[BEST_PLACE + csd_name(pair)] = over.max(axis=0)
    return columns | best | apart | designed_quantities(imager.setup, curves) | {"exposure_s": exposure_s}
