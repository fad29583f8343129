"""What a pixel reads over its expected electrons, as few cubics whose slopes have proven ends.

Electrons are those of a pixel of full sensitivity; the captures of an HDR pixel have a fixed share of them each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ...base.types import Array, Float, IndexArray, Int, PerValue, SameShape
from ..pixel import Pixel, unquantized
from . import merge, moments
from .merged_readings import nodes_of

_OF_NOISE, _OF_VARIANCE = 3e-11, 1e-7
"""How far cubics may be from the means they are drawn through, of the noise, and from variances, relative."""
_ROUNDING, _LEAST_DN2 = 1e-14, 1e-12
_MULTIPLES = 3
"""Multiples of the root of the electrons at which the piece is known, for each piece."""
_LEAST_PRNU = 1e-9
"""A smaller PRNU spaces nodes as evenly, but for rounding."""
_CUT, _CUT_ROOT = 1e-5, 1 / 64
"""Share of the noise by which the ends of the range may shift an unclipped mean; step of the root of the electrons."""
STEPS_DN2 = 1 / 12
"""Least variance that a search takes, DN^2, as of rounding: a saturated pixel has none, and no direction to go."""


class Law(NamedTuple):
    """Cubics of mean and variance between nodes; beyond the last of these, `ends`, nothing changes.

    `cubic`: mean, DN, then variance, DN^2, from the constant on; `piece`: the piece at each multiple of `step` of the
    root of the electrons; `hulls`: least and largest slope of the mean, and of the variance, of so many pieces from
    each one on as are 2 to the power of the level; `most`: largest variance before each piece; `drop`: how far the mean
    lies below an earlier one at most.
    """

    nodes: Float[Array, "tables nodes"]
    cubic: Float[Array, "tables pieces 8"]
    piece: Int[IndexArray, "tables multiples"]
    step: Float[Array, " tables"]
    ends: Float[Array, " tables"]
    hulls: Float[Array, "tables 4 levels pieces"]
    most: Float[Array, "tables pieces"]
    drop: Float[Array, " tables"]

    def at(self, table: int, electrons: SameShape, rows: int = 4) -> Float[Array, " ..."]:
        """Return mean and variance of a table at some electrons, and the slopes of both: so many, on the first axis."""
        from .law_kernels import values_and_slopes  # noqa: PLC0415  (compiled: kept off the start-up path)

        out, flat = np.empty((rows, electrons.size)), np.ascontiguousarray(electrons, dtype=float).ravel()
        of_table = self.nodes[table], self.cubic[table], self.piece[table]
        values_and_slopes(flat, *of_table, float(self.step[table]), float(self.ends[table]), out)
        return out.reshape(rows, *electrons.shape)


def law_of(nodes: PerValue, values: Float[Array, "2 values"], slopes: Float[Array, "2 values"]) -> Law:
    """Return the law that has values and slopes at nodes, ascending from 0, but for those that it does without."""
    from .law_kernels import needed_nodes  # noqa: PLC0415  (compiled: kept off the start-up path)

    noise = np.sqrt(np.maximum(values[1], 0.0))
    near = [_OF_NOISE * noise + _ROUNDING * np.abs(values[0]), _OF_VARIANCE * np.abs(values[1]) + _LEAST_DN2]
    needed = np.zeros(nodes.size, dtype=bool)
    needed_nodes(nodes, values, slopes, np.stack(near), needed)
    nodes, values, slopes = nodes[needed], values[:, needed], slopes[:, needed]
    width = np.diff(nodes)
    rise = np.diff(values, axis=1) / width
    first, last = slopes[:, :-1], slopes[:, 1:]
    cubic = np.stack(
        [values[:, :-1], first, (3 * rise - 2 * first - last) / width, (first + last - 2 * rise) / width**2], axis=-1
    )
    # A cubic and its slope lie between their control points (Bernstein).
    slope = np.stack([first, 3 * rise - first - last, last])
    spread = values[1, :-1], values[1, :-1] + first[1] * width / 3, values[1, 1:] - last[1] * width / 3, values[1, 1:]
    most = np.maximum.accumulate(np.append(0.0, np.max(spread, axis=0)))[:-1]
    falls = np.maximum(-slope[:, 0].min(axis=0), 0.0) * width
    n = width.size
    hulls = np.zeros((4, n.bit_length(), n))
    hulls[::2, 0], hulls[1::2, 0] = slope.min(axis=0), slope.max(axis=0)
    for level in range(1, hulls.shape[1]):
        half = 2 ** (level - 1)
        hulls[:, level] = hulls[:, level - 1]
        hulls[::2, level, :-half] = np.minimum(hulls[::2, level - 1, :-half], hulls[::2, level - 1, half:])
        hulls[1::2, level, :-half] = np.maximum(hulls[1::2, level - 1, :-half], hulls[1::2, level - 1, half:])
    root = math.sqrt(nodes[-1])
    step = root / (_MULTIPLES * n)
    multiples = (step * np.arange(_MULTIPLES * n + 2)) ** 2
    piece = np.clip(np.searchsorted(nodes, multiples, side="right") - 1, 0, n - 1)
    cubics = np.ascontiguousarray(np.swapaxes(cubic, 0, 1)).reshape(n, 8)
    alone = nodes, cubics, piece.astype(np.intp), step, nodes[-1], hulls, most, falls.sum()
    return Law(*(np.asarray(of)[None] for of in alone))


def stacked(laws: Sequence[Law]) -> Law:
    """Return several laws as one, a table each."""
    return laws[0] if len(laws) == 1 else Law(*(_padded(of) for of in zip(*laws, strict=True)))


def _padded(parts: Sequence[Any]) -> Any:
    shape = np.max([part.shape[1:] for part in parts], axis=0)
    return np.concatenate([np.pad(part, [(0, 0), *((0, int(n)) for n in shape - part.shape[1:])]) for part in parts])


@lru_cache(maxsize=64)
def pixel_law(pixel: Pixel, lights: tuple[tuple[float, ...], ...] = ((1.0,),), *, noisy: bool = True) -> Law:
    """Return the laws of a pixel, one for each light of its exposures relative to full sensitivity.

    Without noise the reading is that before rounding.
    """
    if not noisy:
        return stacked([_noiseless_law(pixel, light) for light in lights])
    return stacked([_merged_law(pixel, light) if pixel.captures else read_once_law(pixel) for light in lights])


def _noiseless_law(pixel: Pixel, light: tuple[float, ...]) -> Law:
    """Return a straight line: captures agree until the last one is full."""
    nodes = np.array([0.0, knees_of(pixel, light)[-1]])
    mean, slope = unquantized(nodes, pixel.read_once), np.full(2, pixel.dn_per_e)
    return law_of(nodes, np.stack([mean, np.zeros(2)]), np.stack([slope, np.zeros(2)]))


@lru_cache(maxsize=16)
def _merged_law(pixel: Pixel, light: tuple[float, ...]) -> Law:
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)

    of_exposure = np.array(light)
    roots_e, is_node = nodes_of(pixel, of_exposure)
    nodes_e = roots_e[is_node]
    at_nodes = merge.merged(nodes_e * of_exposure[:, None], of_exposure[:, None], pixel)
    return _of_roots(CubicSpline(np.sqrt(nodes_e), np.stack([at_nodes.mean, at_nodes.variance]), axis=1), nodes_e[-1])


@lru_cache(maxsize=16)
def read_once_law(pixel: Pixel, *, rounds: bool = True) -> Law:
    """Return the law of a pixel that is read once, with the mean before rounding if it does not round.

    With PRNU the noise grows faster than the root of the electrons. Nodes are then equidistant in asinh(PRNU root) /
    PRNU, twice the standard deviation.
    """
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)

    rows = [moments.ROUNDED if rounds else moments.UNROUNDED, moments.VARIANCE]
    last_e = moments.LinearRange.of(pixel).last_e
    if not pixel.prnu:
        spline = moments.table_without_prnu(pixel)
        return _of_roots(CubicSpline(spline.x, spline(spline.x)[rows], axis=1), last_e)
    prnu = max(pixel.prnu, _LEAST_PRNU)
    last = np.arcsinh(prnu * np.sqrt(last_e)) / prnu
    nodes = np.sinh(prnu * np.arange(0, last + 2 * moments.STEP, moments.STEP)) / prnu
    return _of_roots(CubicSpline(nodes, moments.moments(nodes**2, pixel)[rows], axis=1), last_e)


def _of_roots(spline: Any, last_e: float) -> Law:
    """Return the law of mean and variance as splines over the root of the electrons."""
    roots = np.sort(np.concatenate([spline.x, (spline.x[1:] + spline.x[:-1]) / 2]))
    roots = np.append(roots[roots**2 < last_e], math.sqrt(last_e))
    values, nodes = spline(roots), roots**2
    slopes = spline(roots, 1) / (2 * np.maximum(roots, 1e-30))
    slopes[:, 0] = (values[:, 1] - values[:, 0]) / nodes[1]
    return law_of(nodes, values, slopes)


@lru_cache(maxsize=64)
def unclipped_e(pixel: Pixel) -> tuple[float, float]:
    """Return the range of electrons in which neither end shifts the mean by more than 1e-5 of the noise.

    (1, 0) if it is empty.
    """
    law = read_once_law(pixel, rounds=False)
    electrons = np.arange(0.0, math.sqrt(law.ends[0]), _CUT_ROOT) ** 2
    sigma = pixel.dn_per_e * np.sqrt(electrons + (pixel.prnu * electrons) ** 2 + pixel.read_noise_e**2)
    shift = law.at(0, electrons, 1)[0] - pixel.dn_per_e * electrons - pixel.offset_dn
    unclipped = electrons[np.abs(shift) <= _CUT * sigma + 1e-9]
    return (float(unclipped[0]), float(unclipped[-1])) if unclipped.size else (1.0, 0.0)


def knees_of(pixel: Pixel, light: Sequence[float]) -> Float[Array, " knees"]:
    """Return the electrons at which a capture hands over to the next, and from which on the last one is full."""
    if not pixel.captures:
        return np.array([pixel.saturation_e])
    ends = [
        (capture.saturation_e if limit is None else (limit - capture.offset_dn) / capture.dn_per_e) / light[exposure]
        for exposure, capture, limit in zip(
            merge.exposure_of(pixel), pixel.read_as, merge.limits_dn(pixel), strict=True
        )
    ]
    return np.array(ends)


def groups_of(light: Float[Array, "captures pixels"]) -> list[tuple[tuple[float, ...], Int[IndexArray, " _pixels"]]]:
    """Return the distinct columns of the light of exposures, and the elements of each."""
    if (light == light[:, :1]).all():
        return [(tuple(light[:, 0]), np.arange(light.shape[1]))]
    columns, which = np.unique(light, axis=1, return_inverse=True)
    return [(tuple(column), np.flatnonzero(which.ravel() == at)) for at, column in enumerate(columns.T)]
