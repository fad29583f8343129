"""Sampling phases: where the light's center falls on the mosaic.

A scene names a phase, or asks for the worst of `any`. Then a lattice of phases over the tile is computed, phases that
are equal by symmetry once. For CSDs the lattice is four times as fine, and its worst phases are refined: neighbors at
half the step are compared, down to the finest one, or until they differ by little.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.types import Array, Float, IndexArray, Int, PerValue
from .mosaic import Mosaic
from .scene import Target
from .setup import Setup

MOST_PHASES = 1024
"""Phases of a lattice on a tile, at most."""
_FINER, _MOST_FINE = 4, 1200
"""Factor by which the lattice is finer from which extremes are refined; its different phases, at most."""
_STARTS = 2
"""Phases from which each extreme is refined at the first step, then one."""
_FLAT_DN, _FLAT_STEPS_DN = 0.05, 1.0
"""A start whose neighbors all differ from it by less is refined no further; the second where whole numbers step."""
_NEIGHBORS = np.array([[x, y] for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)])


@dataclass(frozen=True)
class Phases:
    """Sampling phases and the pixel at which each is read out.

    `center_px`: center of the light as (column, row), pixels; `nearest_px`: nearest pixel; halfway between two pixels
    it is either of them.
    """

    center_px: Float[Array, "phases 2"]
    nearest_px: Float[Array, "phases 2"]

    def __len__(self) -> int:
        return len(self.center_px)

    @property
    def keys(self) -> list[tuple[float, ...]]:
        """Hashable key of each phase."""
        return [tuple(row) for row in np.concatenate([self.center_px, self.nearest_px], axis=1).tolist()]

    def subset(self, which: slice | Int[IndexArray, " subset"]) -> Phases:
        """Return some of the phases."""
        return Phases(self.center_px[which], self.nearest_px[which])


def lattice_px(mosaic: Mosaic, steps_per_px: int) -> Float[Array, "phases 2"]:
    """Return the centers of a square lattice over the tile.

    `steps_per_px`: steps along each side of a pixel. Centers are (column, row), pixels.
    """
    rows, columns = mosaic.indices.shape
    x, y = np.meshgrid(np.arange(columns * steps_per_px) / steps_per_px, np.arange(rows * steps_per_px) / steps_per_px)
    return np.stack([x.ravel(), y.ravel()], axis=1)


def n_phases(setup: Setup) -> int:
    """Return the number of phases of a scene's lattice.

    1 if the scene names the phase, or if the light fills the field.
    """
    return setup.accuracy.phases_per_px * setup.camera.mosaic.indices.size if setup.all_phases else 1


def scene_phases(setup: Setup) -> Phases:
    """Return the phases of a scene: the whole lattice, or the named one.

    A named phase halfway between two pixels is read at the first of them.
    """
    target = setup.scene.target
    rows, columns = setup.camera.mosaic.indices.shape
    if target is None:
        centers = np.zeros((1, 2))
    elif target.phase_px == "any":
        return read_at(target, lattice_px(setup.camera.mosaic, setup.accuracy.phase_steps_per_px))
    else:
        centers = np.asarray(np.mod([target.phase_px], (columns, rows)), dtype=float)
    return Phases(centers, np.ceil(centers - 0.5))


def different_phases(setup: Setup, phases: Phases) -> tuple[Phases, Int[IndexArray, " phases"]]:
    """Return phases that differ by more than symmetry.

    With the mean over the light, mirrored phases are equal.
    """
    target, tile = setup.scene.target, setup.camera.mosaic.indices
    keys = np.concatenate([phases.center_px, phases.nearest_px], axis=1)
    if target is not None and target.readout == "mean":
        axes = zip(phases.center_px.T, (tile.T, tile), strict=True)
        keys = np.stack([_folded(along, _mirror(rows), len(rows)) for along, rows in axes], axis=1)
        if np.array_equal(tile, tile.T):
            keys = np.sort(keys, axis=1)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return phases.subset(first[order]), np.argsort(order)[which.ravel()]


def _folded(along: Float[Array, " cells"], mirror: float | None, period: int) -> Float[Array, " cells"]:
    """Return positions along an axis folded at the mirror."""
    if mirror is None:
        return np.asarray(np.mod(along, period))
    beyond = np.mod(along - mirror, period)
    return np.asarray(np.minimum(beyond, period - beyond))


def _mirror(rows: Int[IndexArray, "rows k"]) -> float | None:
    """Return the position at which rows are mirror-symmetric, pixels; None if there is none."""
    n = len(rows)
    mirrors = [m for m in range(n) if np.array_equal(rows[(m - np.arange(n)) % n], rows)]
    return mirrors[0] / 2 if mirrors else None


def read_at(target: Target, centers_px: Float[Array, "phases 2"]) -> Phases:
    """Return phases at some centers; a readout at the center has one phase for each of equally near pixels.

    `centers_px`: centers as (column, row), pixels. Those beyond the first n are at further nearest pixels.
    """
    low, high = np.ceil(centers_px - 0.5), np.floor(centers_px + 0.5)
    result = Phases(centers_px, low)
    if target.readout == "center":
        for beyond in ((True, False), (False, True), (True, True)):  # along the columns, along the rows
            nearest = np.where(beyond, high, low)
            more = np.flatnonzero(((nearest != low) == beyond).all(axis=1))
            result = Phases(
                np.concatenate([result.center_px, centers_px[more]]), np.concatenate([result.nearest_px, nearest[more]])
            )
    return result


def fine_lattice(setup: Setup) -> tuple[Phases, float]:
    """Return the phases of the lattice from which extremes are refined.

    Returns `step_px`: step of the lattice, pixels.
    """
    target, steps = setup.scene.target, _FINER * setup.accuracy.phase_steps_per_px
    assert target is not None
    while True:
        phases = different_phases(setup, read_at(target, lattice_px(setup.camera.mosaic, steps)))[0]
        if len(phases) <= _MOST_FINE or steps <= setup.accuracy.phase_steps_per_px:
            return phases, 1 / steps
        steps //= 2


def refined_minima(
    setup: Setup,
    lattice: Phases,
    step_px: float,
    values: Float[Array, "values lattice"],
    evaluate: Callable[[Phases], Float[Array, "_values phases"]],
) -> tuple[PerValue, Phases]:
    """Refine the smallest values over all sampling phases.

    A pattern search: from each of the best known phases to the best neighbor at half the step of the lattice; then
    again, from the best of all known phases, at half the step before; at the finest step as long as values fall. Where
    pixels saturate, extremes are kinks, which are missed by slope times step: steps are halved until neighbors
    differ by little. It finds minima near good phases; it does not prove that no lower one lies elsewhere.
    """
    target, finest, n_starts = setup.scene.target, setup.accuracy.finest_phase_px, _STARTS
    assert target is not None
    known = dict(zip(lattice.keys, values.T, strict=True))
    period = np.array(setup.camera.mosaic.indices.shape[::-1])
    steps = setup.scene.noise is None and setup.computes("quantization")
    flat_dn = _FLAT_STEPS_DN if steps else _FLAT_DN
    step = step_px / 2
    while step >= finest:
        places, so_far = np.array(list(known))[:, :2], np.stack(list(known.values()), axis=1)
        starts = _apart(places, so_far, n_starts, 2 * step, period)
        centers, at_start = places[starts], np.take_along_axis(so_far, starts, axis=1)  # [n_values, n_starts, ...]
        apart_px = np.abs(np.mod(places[None, None] - centers[:, :, None] + period / 2, period) - period / 2)
        known_around = (apart_px <= 2 * step * (1 + 1e-9)).all(axis=3)
        change = np.abs(so_far[:, None] - at_start[..., None])
        moving = np.max(change, axis=2, where=known_around, initial=0.0) > flat_dn
        while moving.any():
            around = np.unique((centers[moving][:, None] + step * _NEIGHBORS).reshape(-1, 2), axis=0)
            read = read_at(target, around)
            phases, which = different_phases(setup, read)
            at_phases = _known_or_evaluated(phases, known, evaluate)[:, which]
            close = (np.abs(read.center_px - centers[:, :, None]) <= step * (1 + 1e-9)).all(axis=3)
            at_close = np.where(close & moving[..., None], at_phases[:, None], np.inf)
            moving = at_close.min(axis=2) < at_start
            lowest = at_close.argmin(axis=2)[moving]
            at_start[moving], centers[moving] = at_close.min(axis=2)[moving], read.center_px[lowest]
            moving &= step < 2 * finest  # elsewhere the next step reaches as far
        step, n_starts = step / 2, 1
    places, so_far = np.array(list(known)), np.stack(list(known.values()), axis=1)
    return so_far.min(axis=1), Phases(*np.split(places[so_far.argmin(axis=1)], 2, axis=1))


def _apart(
    centers_px: Float[Array, "phases 2"],
    values: Float[Array, "values phases"],
    n_starts: int,
    step_px: float,
    period_px: Int[IndexArray, " 2"],
) -> Int[IndexArray, "values phases_apart"]:
    """Return the indices of the smallest values that are more than a step apart."""
    starts, left = [values.argmin(axis=1)], values.copy()
    while len(starts) < n_starts:
        distance = np.mod(centers_px - centers_px[starts[-1]][:, None], period_px)
        left[np.minimum(distance, period_px - distance).max(axis=2) <= step_px * (1 + 1e-9)] = np.inf
        starts.append(np.where(np.isfinite(left).any(axis=1), left.argmin(axis=1), starts[0]))
    return np.stack(starts, axis=1)


def _known_or_evaluated(
    phases: Phases,
    known: dict[tuple[float, ...], Float[Array, " _values"]],
    evaluate: Callable[[Phases], Float[Array, "_values phases"]],
) -> Float[Array, "values phases"]:
    """Return values at phases, and evaluate the unknown ones."""
    keys = phases.keys
    new = np.array([at for at, key in enumerate(keys) if key not in known], dtype=np.intp)
    if new.size:
        known.update(zip((keys[at] for at in new), evaluate(phases.subset(new)).T, strict=True))
    return np.stack([known[key] for key in keys], axis=1)
