"""Where the light's center falls on the mosaic.

Of `any` place, the worst of all real places in the tile is asked for. A lattice looks at some of them; `within X DN`
starts from the lattice of quarter pixels and divides its cells until no place between can change a distance by more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...base.types import BoolArray, FloatArray, IndexArray
from ..mosaic import Mosaic
from ..shot import Shot
from .base import Chosen, KernelEffect, Load, Part, Stage
from .flicker import goes_dark

LATTICES = ("one", "pixel", "half pixel", "quarter pixel")
_WITHIN_DN = {
    "within 10 DN": 10.0,
    "within 1 DN": 1.0,
    "within 0.1 DN": 0.1,
    "within 0.01 DN": 0.01,
    "within 0.0001 DN": 1e-4,
}
MOST = 1024
"""Places of a lattice on a tile, at most."""
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])
NODES = np.array([[x, y] for y in (-1.0, 0.0, 1.0) for x in (-1.0, 0.0, 1.0)])
"""A cell's corners and its nodes from its center (column, row), in units of its half width."""
AT_ALL, PER_DECADE = 0.2, 0.3
"""Places of a search, in those of the lattice, about: at all, and for its limit's decades below 100 DN, squared; see
`sampling.searched_places`."""
SEARCH_S, SEARCH_DECADE_S = 0.009, 0.0025
"""Seconds that a search takes for each design, at all and for each decade; `tests/bench_work.py` measures all four."""
PER_PIXEL = 4
"""Places per pixel, along a row and a column, of the finest lattice."""
_PER_PIXEL = {"one": 0, "pixel": 1, "half pixel": 2, "quarter pixel": PER_PIXEL} | dict.fromkeys(_WITHIN_DN, PER_PIXEL)


@dataclass(frozen=True)
class Cases:
    """Places of the light's center, ndarray[n_cases, 2] as (column, row), and the pixel at which each is read out.

    `home_px`: ndarray[n_cases, 2], the pixel nearest to the light's center; halfway between two it is either.
    """

    places_px: FloatArray
    home_px: FloatArray

    def some(self, which: slice | IndexArray) -> Cases:
        """Some of them."""
        return Cases(self.places_px[which], self.home_px[which])


def within_dn(method: str) -> float | None:
    """How far a distance may be from that over all real places; None for a lattice, which knows no such limit."""
    return _WITHIN_DN.get(method)


def one_is_enough(shot: Shot) -> str | None:
    """Why one place is enough; None when the scene asks for all."""
    target = shot.scenario.target
    if target is None:
        return "a patch that fills the field"
    return None if target.phase_px == "any" else "the scene names the place"


def all_count(shot: Shot, methods: Chosen) -> bool:
    """Whether every real place counts: where any is asked for, and the method is not a lattice's."""
    return one_is_enough(shot) is None and methods.sampling != "skip" and methods.phase not in LATTICES


def n_places(shot: Shot, method: str) -> float:
    """How many places the lattice of a method has."""
    return 1 if one_is_enough(shot) is not None else max(1, _PER_PIXEL[method] ** 2 * shot.mosaic.indices.size)


def decades(method: str) -> float:
    """How many decades the limit of a search is below 100 DN; 0 for a lattice."""
    within = within_dn(method)
    return 0.0 if within is None else 2 - math.log10(within)


def places_px(shot: Shot, method: str) -> FloatArray:
    """Centers of the light, ndarray[n_cases, 2] as (column, row): all of a grid over the tile, or the scene's one."""
    target = shot.scenario.target
    rows, columns = shot.mosaic.indices.shape
    if target is None:
        return np.zeros((1, 2))
    if target.phase_px != "any":
        return np.asarray(np.mod([target.phase_px], (columns, rows)), dtype=float)
    per_pixel = _PER_PIXEL[method]
    if not per_pixel:
        return np.zeros((1, 2))
    x, y = np.meshgrid(np.arange(columns * per_pixel) / per_pixel, np.arange(rows * per_pixel) / per_pixel)
    return np.stack([x.ravel(), y.ravel()], axis=1)


@dataclass(frozen=True)
class Cells:
    """Squares of places: centers and the pixel read out (ndarray[n, 2] each, (column, row)), half width, pixels."""

    centers: FloatArray
    homes: FloatArray
    half: float

    def divided(self, which: BoolArray) -> Cells:
        """The quarters of some of them."""
        quarter = self.half / 2
        centers = (self.centers[which][:, None] + quarter * CORNERS).reshape(-1, 2)
        return Cells(centers, np.repeat(self.homes[which], len(CORNERS), axis=0), quarter)

    def some(self, which: slice) -> Cells:
        """Part of them."""
        return Cells(self.centers[which], self.homes[which], self.half)

    @property
    def nodes(self) -> Cases:
        """All nodes, those of a cell one after the other."""
        places = (self.centers[:, None] + self.half * NODES).reshape(-1, 2)
        return Cases(places, np.repeat(self.homes, len(NODES), axis=0))

    def shared_nodes(self, shot: Shot) -> tuple[Cases, IndexArray]:
        """The nodes, each once, and those of each cell, ndarray[n_cells, n_nodes].

        Of a mean over the disc it does not matter which pixel is the nearest.
        """
        target, every = shot.scenario.target, self.nodes
        keys = every.places_px
        if target is not None and target.readout == "center":
            keys = np.concatenate([every.places_px, every.home_px], axis=1)
        _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        return every.some(first), which.reshape(-1, len(NODES))


def whole(mosaic: Mosaic) -> Cells:
    """Cells whose nodes are places of the finest lattice, over a part of the tile that stands for all of it."""
    half = 1 / PER_PIXEL
    x, y = (np.arange(a + half, b, 2 * half) for a, b in domain_px(mosaic).T)
    centers = np.stack([v.ravel() for v in np.meshgrid(x, y)], axis=1)
    if np.array_equal(mosaic.indices, mosaic.indices.T):  # places on both sides of the diagonal see the same
        centers = centers[centers[:, 1] <= centers[:, 0]]
    return Cells(centers, np.floor(centers + 0.5), half)


def cases(shot: Shot, method: str) -> Cases:
    """The places of a method; halfway between two pixels the one before is read out."""
    places = places_px(shot, method)
    return Cases(places, np.ceil(places - 0.5))


def different_places(shot: Shot, every: Cases) -> tuple[Cases, IndexArray]:
    """Those of some cases that see something else than all before, and which of these each sees, ndarray[n].

    Of a mean over the light, a place sees what its mirror images see.
    """
    target, tile = shot.scenario.target, shot.mosaic.indices
    keys = np.concatenate([every.places_px, every.home_px], axis=1)
    if target is not None and target.readout == "mean":
        axes = zip(every.places_px.T, (tile.T, tile), strict=True)
        keys = np.stack([_folded(along, _mirror(rows), len(rows)) for along, rows in axes], axis=1)
        if np.array_equal(tile, tile.T):
            keys = np.sort(keys, axis=1)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return every.some(first[order]), np.argsort(order)[which.ravel()]


def _folded(along: FloatArray, mirror: float | None, period: int) -> FloatArray:
    """Places along an axis, each as the one of its images that stands for it."""
    if mirror is None:
        return np.asarray(np.mod(along, period))
    beyond = np.mod(along - mirror, period)
    return np.asarray(np.minimum(beyond, period - beyond))


def _mirror(rows: IndexArray) -> float | None:
    """Where rows are their own mirror image, pixels; None where they are not."""
    n = len(rows)
    mirrors = [m for m in range(n) if np.array_equal(rows[(m - np.arange(n)) % n], rows)]
    return mirrors[0] / 2 if mirrors else None


def domain_px(mosaic: Mosaic) -> FloatArray:
    """A part of the tile that stands for all of it: ndarray[2, 2], (column, row) of its two ends.

    Where the tile is its own mirror image, places on both sides of the mirror see the same.
    """
    ends = []
    for rows in (mosaic.indices.T, mosaic.indices):
        n, mirror = len(rows), _mirror(rows)
        ends.append((0.0, float(n)) if mirror is None else (mirror, mirror + n / 2))
    return np.array(ends).T


def nearest_places(shot: Shot, of: FloatArray, among: FloatArray) -> IndexArray:
    """For each place of `of` the index of the nearest one of `among`, on the torus of the tile."""
    rows, columns = shot.mosaic.indices.shape
    size = np.array([columns, rows])
    apart = np.abs(of[:, None] - among[None]) % size
    apart = np.minimum(apart, size - apart)
    return np.asarray((apart**2).sum(axis=2).argmin(axis=1))


class Phase(KernelEffect):
    """Every place of the light is the limit of more and more places."""

    name = "phase"
    methods = (*LATTICES, *_WITHIN_DN)
    stage = Stage.SAMPLING
    order = 2
    off = "one"
    part = Part.PLACES
    is_limit = True

    def exact(self, shot: Shot) -> str | None:
        """A scene may name the place."""
        return one_is_enough(shot)

    def all_count(self, shot: Shot, methods: Chosen) -> bool:
        """Where the light may fall anywhere, and more than a lattice of places is looked at."""
        return all_count(shot, methods)

    def limit_dn(self, method: str) -> float | None:
        """A lattice knows no limit."""
        return within_dn(method)

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """All is done at every place."""
        if shot.scenario.target is None or methods.sampling == "skip":
            return load
        cases = load.cases * n_places(shot, methods.phase)
        if not all_count(shot, methods) or (methods.flicker != "skip" and goes_dark(shot)):
            return load._replace(cases=cases)  # of a light that may be dark all distances are 0, and none is looked for
        deep = decades(methods.phase)
        return load._replace(
            cases=0.0 if methods.straight else cases,  # of a straight readout, the search has the lattice's places, too
            searched=cases * (AT_ALL + PER_DECADE * deep**2),
            search_s=SEARCH_S + SEARCH_DECADE_S * deep,
        )
