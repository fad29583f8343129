"""The smallest and the largest color separation distance over all real places of a light on the mosaic.

The tile is divided into cells. In each, all distances are bounded from the responses at its four corners and from what
may lie between them (`between`); cells that may hold a smaller or a larger distance than those found, by more
than the method of `phase` leaves open, are divided. The readout is taken as straight.
"""

from __future__ import annotations

import hashlib
import pickle
import threading
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..cache import Cache
from ..curves.hats import hats
from ..curves.lights import Pair, class_pairs
from ..types import FloatArray, IndexArray
from .between import Between, Deviation
from .compiled_distances import distances
from .effects import blur, phase
from .effects.base import KernelEffect
from .kernel import colorless
from .methods import REFERENCE
from .place_kernels import PlaceKernels
from .registry import EFFECTS, WHOLE_LIGHT, factor_of_light
from .view import View

_Name = tuple[int, ...]
_OWN_DN = 1e-5
"""What a search leaves of its tolerance for its own kernels; they were seen 2e-6 DN from those of a readout."""
_UNIT_PX = 2.0**-40
"""Places are told apart in this unit."""
_MOST_CELLS = 400_000
"""Cells of one design, after which the search gives up."""
_KEPT_BYTES = 200e6
_AT_ONCE = 2_000_000
"""Values of pair distances that are held at once."""


@dataclass(frozen=True)
class Extremes:
    """Of one pair of types, over all places: smallest and largest distance, DN, and where.

    `at_smallest`, `at_largest`: ndarray[2, 2], the place and the pixel read out, each (column, row) in pixels.
    """

    smallest: float
    largest: float
    at_smallest: FloatArray
    at_largest: FloatArray


class _Kept:
    """Arrays of one shape by their names, row by row; all are forgotten when they take too much memory."""

    def __init__(self) -> None:
        self._at: dict[_Name, int] = {}
        self._rows: tuple[FloatArray, ...] = ()

    def __call__(
        self, names: list[_Name], make: Callable[[IndexArray], tuple[FloatArray, ...]]
    ) -> tuple[FloatArray, ...]:
        """Those of some names; `make` makes those of the names, by number, that are not kept."""
        if sum(rows.nbytes for rows in self._rows) > _KEPT_BYTES:
            self._at, self._rows = {}, ()
        new = {name: at for at, name in enumerate(names) if name not in self._at}
        if new:
            made, size = make(np.array(list(new.values()))), len(self._at)
            if not self._rows or size + len(new) > len(self._rows[0]):
                more = (np.empty((size + 2 * len(new), *rows.shape[1:])) for rows in made)
                rows = self._rows or made
                self._rows = tuple(_filled(larger, old[:size]) for larger, old in zip(more, rows, strict=True))
            for kept, own in zip(self._rows, made, strict=True):
                kept[size : size + len(new)] = own
            self._at |= {name: size + at for at, name in enumerate(new)}
        which = [self._at[name] for name in names]
        return tuple(rows[which] for rows in self._rows)


def _filled(larger: FloatArray, rows: FloatArray) -> FloatArray:
    """An array whose first rows are these."""
    larger[: len(rows)] = rows
    return larger


class _Geometry:
    """Kernels at places and in cells of places, kept: what designs, spaces and tolerances of one scene share."""

    def __init__(self, view: View) -> None:
        self._view, wave = view, view.grid.nodes_nm
        self.knots_nm = wave if view.methods.blur == "skip" else blur.knots(wave, view.methods.blur)
        self.between = Between(view, view.methods, self.knots_nm)
        self._light = PlaceKernels(view, view.methods, self.knots_nm)
        self.functions = self._light.shares @ hats(wave, self.knots_nm)
        self._kernels, self._deviations = _Kept(), _Kept()
        self._one_at_a_time = threading.Lock()

    def of_cells(self, cells: phase.Cells, work: Counter[str]) -> tuple[FloatArray, Deviation]:
        """The kernel at the corners of cells, ndarray[n_cells, 4, n_channels, n_channels, n_functions], and how far it
        may be from that in them.
        """
        corners = cells.corners
        places = self._named(corners.places_px, corners.home_px)
        names = [(*name, int(cells.half / _UNIT_PX)) for name in self._named(cells.centers, cells.homes)]

        def at_places(new: IndexArray) -> tuple[FloatArray, ...]:
            kernels = self._light.at(corners.some(new), work)
            work["places"] += len(new)
            low, high = self.between.ranges(kernels @ self._light.shares)
            return kernels, low, high

        def in_cells(new: IndexArray) -> tuple[FloatArray, ...]:
            work["cells"] += len(new)
            return self.between.of_cells(cells.centers[new], cells.half, cells.homes[new], ranges[:, new])

        with self._one_at_a_time:
            kernels, low, high = self._kernels(places, at_places)
            ranges = np.stack([low, high]).reshape(2, len(names), len(phase.CORNERS), *low.shape[1:])
            deviation = self._deviations(names, in_cells)
        return kernels.reshape(len(names), len(phase.CORNERS), *kernels.shape[1:]), Deviation(*deviation)

    def _named(self, places: FloatArray, homes: FloatArray) -> list[_Name]:
        """A name for each place (ndarray[n, 2]), with the pixel that is read out there, where one is."""
        target = self._view.scenario.target
        assert target is not None
        names = np.rint(places / _UNIT_PX).astype(np.int64)
        if target.readout == "center":
            names = np.concatenate([names, homes.astype(np.int64)], axis=1)
        return [tuple(name) for name in names.tolist()]


_geometries: Cache[bytes, _Geometry] = Cache(4)


def forget_geometries() -> None:
    """Let the next scene compute its kernels anew, as one that is the first."""
    _geometries.clear()


def _geometry_of(view: View) -> _Geometry:
    """The geometry of a scene: filters, noise and the light's way to the lens have no part in it."""
    own = [name for name, effect in EFFECTS.items() if isinstance(effect, KernelEffect) and not effect.is_limit]
    kept = {name: getattr(view.methods, name) for name in own}
    methods = replace(REFERENCE, **kept, **WHOLE_LIGHT)
    bare = replace(colorless(view), methods=methods)
    return _geometries.get(hashlib.sha256(pickle.dumps(bare)).digest(), lambda: _Geometry(bare))


class AnyPlace:
    """A scene in which the light may fall anywhere, ready for designs.

    `work` counts the places and cells that are computed; those of other designs of the scene are kept.
    """

    def __init__(self, view: View, work: Counter[str]) -> None:
        within_dn, wave = phase.within_dn(view.methods.phase), view.grid.nodes_nm
        if within_dn is None:
            raise ValueError(f"{view.methods.phase!r} looks at a lattice of places")
        self.within_dn, self.members = within_dn - _OWN_DN, view.members
        self._mosaic, self._work, self._geometry = view.mosaic, work, _geometry_of(view)
        self._dimmed = factor_of_light(view, view.methods, wave)

    def extremes(self, light_dn: FloatArray) -> dict[Pair, Extremes | None]:
        """Extremes of every pair of types; None where too many cells would be needed.

        `light_dn`: what each signal gives in each channel at each wavelength where its image is whole, DN,
        ndarray[n_signals, n_channels, n_wavelengths].
        """
        light = light_dn * self._dimmed
        pairs = class_pairs(list(self.members))
        return {(a, b): _Search(self, light[self.members[a]], light[self.members[b]]).run() for a, b in pairs}

    def whole(self) -> phase.Cells:
        """The cells to begin with."""
        return phase.whole(self._mosaic)

    @property
    def values_per_cell(self) -> int:
        """Values of the kernels at a cell's corners."""
        return len(phase.CORNERS) * len(self._mosaic.channels) ** 2 * len(self._geometry.functions)

    def by_function(self, light: FloatArray) -> FloatArray:
        """Light by the functions of the kernels, ndarray[..., n_wavelengths] -> ndarray[..., n_functions]."""
        return np.asarray(light @ self._geometry.functions.T, dtype=float)

    def amounts(self, light: FloatArray) -> FloatArray:
        """`Between.amounts` of a light."""
        return self._geometry.between.amounts(light)

    def of_cells(self, cells: phase.Cells) -> tuple[FloatArray, Deviation]:
        """The kernel at the corners of cells, and how far it may be from that in them."""
        return self._geometry.of_cells(cells, self._work)


class _Search:
    """The extremes of one pair of types, for one design."""

    def __init__(self, scene: AnyPlace, first: FloatArray, second: FloatArray) -> None:
        """`first`, `second`: light of the signals of each type, DN, ndarray[n_signals, n_channels, n_wavelengths]."""
        self._scene = scene
        self._light = [scene.by_function(light) for light in (first, second)]
        self._one, self._other = np.indices((len(first), len(second))).reshape(2, -1)
        self._amounts = np.concatenate([scene.amounts(light - second) for light in first])

    def run(self) -> Extremes | None:
        """The extremes; None when too many cells would be needed."""
        cells, pairs, counted = self._scene.whole(), np.arange(len(self._one)), 0
        nowhere = np.full((2, 2), np.nan)
        least, most = (np.inf, nowhere), (-np.inf, nowhere)
        while counted < _MOST_CELLS:
            counted += len(cells.centers)
            step = max(1, _AT_ONCE // max(16 * len(pairs), self._scene.values_per_cell))
            blocks = [cells.some(slice(at, at + step)) for at in range(0, len(cells.centers), step)]
            parts = [self._bounds(block, pairs) for block in blocks]
            low, high, corners = (np.concatenate(part) for part in zip(*parts, strict=True))
            values = corners.min(axis=2)  # [n_cells, corners]
            for at, (found, sign) in enumerate(((least, 1.0), (most, -1.0))):
                cell, corner = np.unravel_index((sign * values).argmin(), values.shape)
                if sign * values[cell, corner] < sign * found[0]:
                    place = cells.centers[cell] + cells.half * phase.CORNERS[corner]
                    better = (float(values[cell, corner]), np.stack([place, cells.homes[cell]]))
                    least, most = (better, most) if at == 0 else (least, better)
            nearest = high.min(axis=1)
            undecided = low.min(axis=1) < least[0] - self._scene.within_dn
            undecided |= nearest > most[0] + self._scene.within_dn
            if not undecided.any():
                return Extremes(least[0], most[0], least[1], most[1])
            pairs = pairs[(low[undecided] <= nearest[undecided, None]).any(axis=0)]
            cells = cells.divided(undecided)
        return None

    def _bounds(self, cells: phase.Cells, pairs: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Of cells and pairs of signals: the distance's lower and upper bound (ndarray[n_cells, n_pairs] each), and the
        distances at the corners (ndarray[n_cells, 4, n_pairs]), DN.

        The difference of two signals' responses is within `rest` of a mean of those at the corners, in each channel.
        So the distance is at most the largest at a corner and what is left, and at least how far all corners lie to one
        side of a plane, less what is left.
        """
        kernels, deviation = self._scene.of_cells(cells)
        flat = kernels.reshape(*kernels.shape[:3], -1)
        (first, one), (second, other) = (
            self._seen(flat, light, at[pairs]) for light, at in zip(self._light, (self._one, self._other), strict=True)
        )
        rest = deviation.kernel.reshape(*deviation.tilt.shape, -1) @ self._amounts[pairs].reshape(len(pairs), -1).T
        return distances(first, second, (one, other), rest, deviation.tilt)

    @staticmethod
    def _seen(kernels: FloatArray, light: FloatArray, signals: IndexArray) -> tuple[FloatArray, IndexArray]:
        """What the channels see of signals, each once, ndarray[n_cells, corners, n_channels, n], and where each is."""
        some, which = np.unique(signals, return_inverse=True)
        return kernels @ light[some].reshape(len(some), -1).T, which
