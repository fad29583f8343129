"""Pure evaluation: a block of designs in a scene -> color separation distances, sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..camera.effects.phase import Cases
from ..camera.electrons import Changing
from ..camera.imager import Imager, smooth_imager
from ..camera.noisy_readout import NoisyReadout
from ..camera.places import Extremes
from ..camera.view import Setup
from ..curves.lights import Lights, Pair, class_pairs
from ..designs.block import Block, Curves
from ..types import FloatArray, IndexArray
from . import confusion
from .discrimination import (
    STATE_ERROR_BOUND,
    NoiseShape,
    contrast_to_noise,
    detectability,
    error_bound,
    noise_names,
    pairwise_error,
    state_error_bound,
)
from .separation import CSD, cfa_sensitivity, csd_name, separation, separations, separations_along

DESIGNED = ("sensitivity", "cfa_sensitivity", "slope_per_nm", "min_transmission")
"""Quantities of a design that do not depend on the lights."""
WORST = "worst_"
"""Prefix of a quantity that is the smallest over the shifts of the edges in production."""
STATE_ERROR = "state_error"
"""Name of the largest pairwise error over all pairs of states."""
BEST_PLACE = "best_place_"
"""Prefix of a CSD that is the largest over the places where the light may fall on the mosaic, each at its worst moment
of a pulsed light."""
Columns = dict[str, FloatArray]


def is_promised(column: str) -> bool:
    """Whether a plan's promise holds for a column: each CSD, that of the best place, and that of the worst edges."""
    return column.removeprefix(WORST).removeprefix(BEST_PLACE).startswith(CSD)


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


def smooth_response(setup: Setup, curves: FloatArray) -> FloatArray:
    """Unquantized, unclipped response, DN: ndarray[n_designs, n_cases, n_signals, n_channels].

    `curves`: ndarray[n_designs, n_modified, n_wavelengths].
    """
    return smooth_imager(setup).smooth(curves)


def smooth_csd(setup: Setup, curves: FloatArray, pair: Pair) -> FloatArray:
    """CSD of the smooth response, the smallest over the cases, DN, ndarray[n_designs]."""
    response = smooth_response(setup, curves)
    first, second = (setup.members[name] for name in pair)
    over = [separation(response[:, case], first, second) for case in range(response.shape[1])]
    return np.asarray(np.min(over, axis=0), dtype=float)


def designed_quantities(setup: Setup, curves: FloatArray) -> dict[str, FloatArray]:
    """`block_quantities` of any filters; `curves`: ndarray[n_designs, n_modified, n_wavelengths]."""
    return block_quantities(setup, Curves(np.asarray(curves, dtype=float)))


def block_quantities(setup: Setup, block: Block) -> dict[str, FloatArray]:
    """What a design gives without any light, each ndarray[n_designs].

    `sensitivity`: total QE of the modified channels over that of the curves they replace (the paper's sensitivity of N,
    with Y as the reference). `cfa_sensitivity`: see `separation`. `slope_per_nm`: the steepest slope of a
    modified channel's QE. `min_transmission`: the smallest ratio of a modified channel to the curve it replaces.
    Without a modified channel all but `cfa_sensitivity` are NaN.
    """
    modified, counts = list(setup.modified), setup.mosaic.counts
    each = np.repeat(np.eye(len(modified)), setup.grid.size, axis=0)  # the sum over wavelengths of each channel
    totals = block.product(each, np.arange(setup.grid.size)) if modified else np.empty((len(block), 0))
    found = dict.fromkeys(DESIGNED, np.full(len(block), np.nan))
    every = np.empty((len(block), len(counts)))
    every[:] = setup.qe.sum(axis=1, dtype=float)
    every[:, modified] = totals
    found["cfa_sensitivity"] = cfa_sensitivity(every, counts, setup.clear_qe)
    if modified:
        base_qe = np.asarray(setup.base_qe, dtype=float)
        steepest, lowest = block.shapes(base_qe)
        found["sensitivity"] = totals.sum(axis=1) / base_qe.sum()
        found["slope_per_nm"] = steepest / setup.grid.step_nm
        found["min_transmission"] = lowest
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


def _told_apart(
    imager: Imager, curves: FloatArray, read: NoisyReadout, members: Mapping[str, IndexArray]
) -> dict[str, FloatArray]:
    """The columns of `noise_quantities`, the worst over the cases; `read`: of these curves.

    Errors of a few pixels are exact sums over their digital numbers, those of many are Gaussian or bounds.
    """
    cases = [(read.mean[:, case], read.variance[:, case]) for case in range(read.mean.shape[1])]
    shapes = [NoiseShape(read.gaussian[:, case], read.reach_dn[:, case]) for case in range(len(cases))]

    def over(quantity: Callable[..., FloatArray], worst: Callable[..., FloatArray], *of: Any) -> FloatArray:
        return worst([quantity(*case, *of) for case in cases], axis=0)

    def errors_over(quantity: Callable[..., FloatArray], *of: Any) -> FloatArray:
        shaped = zip(cases, shapes, strict=True)
        return np.asarray(np.max([quantity(*case, *of, shape) for case, shape in shaped], axis=0), dtype=float)

    few = imager.readout.few_pixels
    found: dict[str, FloatArray] = {}
    if few is None:
        error = {}
        bound = {}
        for pair in class_pairs(list(members)):
            both = members[pair[0]], members[pair[1]]
            error[pair], bound[pair] = errors_over(pairwise_error, *both), errors_over(error_bound, *both)
        state_bound = errors_over(state_error_bound, members)
    else:
        electrons = imager.pixel_electrons(curves)
        exact = [confusion.errors(electrons[:, case], few, imager.readout.pixel, members) for case in range(len(cases))]
        error = {pair: np.max([each.error[pair] for each in exact], axis=0) for pair in exact[0].error}
        bound = {pair: np.max([each.bound[pair] for each in exact], axis=0) for pair in exact[0].bound}
        state_bound = np.max([each.state_bound for each in exact], axis=0)
    for pair in class_pairs(list(members)):
        both = members[pair[0]], members[pair[1]]
        floor = over(contrast_to_noise, np.min, *both), over(detectability, np.min, *both)
        found |= dict(zip(noise_names(pair), (*floor, error[pair], bound[pair]), strict=True))
    found[STATE_ERROR] = np.max(list(error.values()), axis=0)
    found[STATE_ERROR_BOUND] = state_bound
    return found


def _over_all_places(
    imager: Imager,
    curves: FloatArray,
    exposure_s: FloatArray,
    columns: Columns,
) -> None:
    """Put the extremes over all places into the columns, which hold those over the lattice."""
    assert imager.anywhere is not None
    for design in np.flatnonzero(np.isfinite(exposure_s)):
        light = imager.electrons.light_dn(curves[design], exposure_s[design])
        if not np.isfinite(light).all():
            continue
        found = imager.anywhere.extremes(light)
        if not imager.setup.methods.straight:
            found = _as_read(imager, curves[design : design + 1], found)
        for pair, extremes in found.items():
            name = csd_name(pair)
            smallest, largest = (np.nan, np.nan) if extremes is None else (extremes.smallest, extremes.largest)
            best = columns[BEST_PLACE + name]
            columns[name][design] = np.minimum(columns[name][design], smallest)
            best[design] = np.maximum(best[design], largest)


def _as_read(imager: Imager, curves: FloatArray, found: Mapping[Pair, Extremes | None]) -> dict[Pair, Extremes | None]:
    """Extremes of one design at the places where those of the straight response are, as the camera reads them out."""
    kept = [extremes for extremes in found.values() if extremes is not None]
    at = [case for extremes in kept for case in (extremes.at_smallest, extremes.at_largest)]
    if not at:
        return dict(found)
    there = Imager(imager.setup, imager.work, cases=Cases(*np.moveaxis(np.array(at), 1, 0)))
    response = there.read(curves)[0]
    response = response.reshape(len(at), -1, *response.shape[2:])
    read = [separations(moments, imager.setup.members) for moments in response]
    return {
        pair: None
        if extremes is None
        else replace(
            extremes,
            smallest=min(float(distances[pair].min()) for distances in read),
            largest=max(float(distances[pair].min()) for distances in read),
        )
        for pair, extremes in found.items()
    }


def evaluate(imager: Imager, designs: FloatArray | Block, states: Sequence[str] = ()) -> dict[str, FloatArray]:
    """Evaluate a block of designs as the camera reads them out, as far as the scene's methods go.

    `designs`: a block, or the QE of its modified channels, ndarray[n_designs, n_modified, n_wavelengths]. Returns
    columns, each ndarray[n_designs]: `csd_<a>_<b>` (DN) of every pair of signal types, the smallest over the places of
    the light and the moments of its pulses; `best_place_csd_<a>_<b>`, where a scene has several places, the largest
    over the places of the smallest over the moments; those of `block_quantities` and `exposure_s`; with `states`, those
    of `noise_quantities`, the worst over the places of the lattice. Distances are NaN where the extremes over all
    places take more cells than `places` allows.
    """
    block = Curves(designs) if isinstance(designs, np.ndarray) else designs
    changing = None if states else imager.read_changing(block)
    if changing is None:
        columns = _distances(imager, block, states)
    elif changing.which.all():
        columns = _distances_along(imager, changing)
    else:
        columns = {name: np.empty(len(block)) for name in (*_distance_names(imager), "exposure_s")}
        rest = block.some(np.flatnonzero(~changing.which))
        parts = ((changing.which, _distances_along(imager, changing)), (~changing.which, _distances(imager, rest)))
        for which, part in parts:
            for name, values in part.items():
                columns[name][which] = values
    exposure_s = columns.pop("exposure_s")
    if imager.anywhere is not None:
        _over_all_places(imager, block.curves(), exposure_s, columns)
    return columns | block_quantities(imager.setup, block) | {"exposure_s": exposure_s}


def _distances_along(imager: Imager, changing: Changing) -> Columns:
    """CSDs and exposure of designs that differ in one channel alone."""
    cases = [
        separations_along(fixed, changing.channel, changing.values[:, case], imager.setup.members)
        for case, fixed in enumerate(changing.fixed)
    ]
    return _over(imager, cases) | {"exposure_s": np.full(len(changing.values), changing.exposure_s)}


def _distances(imager: Imager, block: Block, states: Sequence[str] = ()) -> Columns:
    """CSDs and exposure of any designs; with `states`, `noise_quantities`, too."""
    apart: Columns = {}
    if states:
        curves = block.curves()
        read = imager.read_with_noise(curves)
        response, exposure_s = read.mean, read.exposure_s
        apart = _told_apart(imager, curves, read, {name: imager.setup.members[name] for name in states})
    else:
        response, exposure_s = imager.read(block.curves())
    cases = [separations(response[:, case], imager.setup.members) for case in range(response.shape[1])]
    return _over(imager, cases) | apart | {"exposure_s": exposure_s}


def _distance_names(imager: Imager) -> list[str]:
    names = [csd_name(pair) for pair in class_pairs(list(imager.setup.members))]
    return names + [BEST_PLACE + name for name in names]


def _over(imager: Imager, cases: Sequence[Mapping[Pair, FloatArray]]) -> Columns:
    """Each pair's smallest CSD over all cases, and the largest over the places of the smallest over the moments."""
    over = {csd_name(pair): np.stack([case[pair] for case in cases]) for pair in cases[0]}
    moments = {name: values.reshape(imager.n_places, -1, values.shape[-1]).min(axis=1) for name, values in over.items()}
    least = {name: values.min(axis=0) for name, values in moments.items()}
    return least | {BEST_PLACE + name: values.max(axis=0) for name, values in moments.items()}
