"""Sampling phases: where the light's center falls on the mosaic.

A scene names a phase, or asks for the worst of `any`. Then a lattice of phases over the tile is computed, phases that
are equal by symmetry once. For CSDs the lattice is four times as fine, and its worst phases are refined: neighbors at
half the step are compared, down to the finest one, or until they differ by little.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.types import Array, Float, IndexArray, Int
from .axis import Axis
from .mosaic import Mosaic
from .scene import Target
from .setup import Setup

MOST_PHASES = 1024
"""Phases of a lattice on a tile, at most."""
_FINER, _MOST_FINE = 4, 1200
"""Factor by which the lattice is finer from which extremes are refined; its different phases, at most."""
_ROUNDING = 1e-9


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


def axis_of(setup: Setup, *, finer: bool) -> Axis:
    """Return the centers of the scene's lattice, or of a finer one, from which extremes are refined.

    Where pixels saturate, extremes are kinks, which are missed by slope times step: steps are halved until neighbors
    differ by little.
    """
    target, steps = setup.scene.target, setup.accuracy.phase_steps_per_px * (_FINER if finer else 1)
    assert target is not None
    while True:
        phases = different_phases(setup, read_at(target, lattice_px(setup.camera.mosaic, steps)))[0]
        if len(phases) <= _MOST_FINE or steps <= setup.accuracy.phase_steps_per_px:
            break
        steps //= 2
    first = np.sort(np.unique(phases.center_px, axis=0, return_index=True)[1])
    centers = phases.center_px[first]
    return Axis(
        centers,
        np.full(len(centers), 1 / steps),
        max(0, math.floor(math.log2(1 / (steps * setup.accuracy.finest_phase_px)) + _ROUNDING)),
        period=np.array(setup.camera.mosaic.indices.shape[::-1], dtype=float),
    )


def phases_at(setup: Setup, centers_px: Float[Array, "places 2"]) -> tuple[Phases, Int[IndexArray, "choices places"]]:
    """Return the different phases at some centers, and the numbers of those of each: of all equally near pixels."""
    target = setup.scene.target
    assert target is not None
    read = read_at(target, centers_px)
    phases, which = different_phases(setup, read)
    place = {center: number for number, center in enumerate(map(tuple, centers_px.tolist()))}
    same = np.array([place[center] for center in map(tuple, read.center_px.tolist())])
    choices = np.repeat(which[None, : len(centers_px)], 4, axis=0)
    for number, at in zip(which[len(centers_px) :], same[len(centers_px) :], strict=True):
        row = np.flatnonzero(choices[1:, at] == choices[0, at])
        choices[1 + (row[0] if row.size else 2), at] = number
    return phases, choices
