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
from ..pixel import Pixel
from .pixel_curve import pixel_curve

_OF_NOISE, _OF_VALUE, _LEAST = 1e-7, 1e-12, 1e-12
"""How far cubics may be from the values they are drawn through: of the noise, and relative; variance, DN^2."""
_MULTIPLES = 8
"""Multiples of the root of the electrons at which the piece is known, for each piece."""


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

    def at(self, table: int, electrons: SameShape) -> Float[Array, " ..."]:
        """Return mean and variance of a table at some electrons, and the slopes of both, on the first axis."""
        from .law_kernels import values_and_slopes  # noqa: PLC0415  (compiled: kept off the start-up path)

        out, flat = np.empty((4, electrons.size)), np.ascontiguousarray(electrons, dtype=float).ravel()
        of_table = self.nodes[table], self.cubic[table], self.piece[table]
        values_and_slopes(flat, *of_table, float(self.step[table]), float(self.ends[table]), out)
        return out.reshape(4, *electrons.shape)


def law_of(nodes: PerValue, values: Float[Array, "2 values"], slopes: Float[Array, "2 values"]) -> Law:
    """Return the law that has values and slopes at nodes, ascending from 0, but for those that it does without."""
    from .law_kernels import needed_nodes  # noqa: PLC0415  (compiled: kept off the start-up path)

    noise = np.sqrt(np.maximum(values[1], 0.0))
    near = np.stack([_OF_NOISE * noise + _OF_VALUE * np.abs(values[0]), _OF_NOISE * np.abs(values[1]) + _LEAST])
    needed = np.zeros(nodes.size, dtype=bool)
    needed_nodes(nodes, values, slopes, near, needed)
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
def pixel_law(pixel: Pixel, lights: tuple[tuple[float, ...], ...], *, noisy: bool) -> Law:
    """Return the laws of a pixel, one for each light of its exposures relative to full sensitivity."""
    return stacked([_pixel_law(pixel, light, noisy=noisy) for light in lights])


@lru_cache(maxsize=64)
def _pixel_law(pixel: Pixel, light: tuple[float, ...], *, noisy: bool) -> Law:
    curve = pixel_curve(pixel, light, noisy=noisy)
    if not noisy:
        nodes = np.array([0.0, float(curve.knees_e[-1])])
        mean = curve.mean(nodes)
        slope = (mean[1] - mean[0]) / nodes[1]
        return law_of(nodes, np.stack([mean, np.zeros(2)]), np.array([[slope, slope], [0.0, 0.0]]))
    table = curve.table
    between = np.concatenate([table.nodes, (table.nodes[1:] + table.nodes[:-1]) / 2])
    roots = np.append(np.sort(between[between**2 < table.last_e]), math.sqrt(table.last_e))
    piece = np.minimum(np.searchsorted(table.nodes, roots, side="right") - 1, table.nodes.size - 2)
    d, c = roots - table.nodes[piece], table.coefficients[:, piece]
    values = ((c[..., 0] * d + c[..., 1]) * d + c[..., 2]) * d + c[..., 3]
    by_root = (3 * c[..., 0] * d + 2 * c[..., 1]) * d + c[..., 2]
    nodes = roots**2
    slopes = by_root / (2 * np.maximum(roots, 1e-30))
    slopes[:, 0] = (values[:, 1] - values[:, 0]) / nodes[1]
    return law_of(nodes, values, slopes)
