"""Kernels at the corners of cells of places, and how far they may be from that in them: kept, each made once."""

from __future__ import annotations

import hashlib
import pickle
import threading
from collections import Counter
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.cache import Cache
from ..base.types import FloatArray, IndexArray
from ..curves.hats import hats
from .between import Between, Deviation
from .effects import blur, phase
from .effects.base import KernelEffect
from .kernel import colorless
from .methods import REFERENCE
from .place_kernels import PlaceKernels
from .registry import EFFECTS, WHOLE_LIGHT
from .view import View

_KEPT_BYTES = 200e6
_Rows = tuple[NDArray[Any], ...]


class _Kept:
    """Arrays of one shape by their names, row by row."""

    def __init__(self) -> None:
        self._at: dict[Hashable, int] = {}
        self.rows: _Rows = ()

    @property
    def nbytes(self) -> int:
        """Memory that they take."""
        return sum(rows.nbytes for rows in self.rows)

    def which(self, names: list[Hashable], make: Callable[[IndexArray], _Rows]) -> IndexArray:
        """The rows of some names; `make` makes those of the names, by number, that are not kept."""
        new = {name: at for at, name in enumerate(names) if name not in self._at}
        if new:
            made, size = make(np.array(list(new.values()))), len(self._at)
            if not self.rows or size + len(new) > len(self.rows[0]):
                more = (np.empty((size + 2 * len(new), *rows.shape[1:]), dtype=rows.dtype) for rows in made)
                rows = self.rows or made
                self.rows = tuple(_filled(larger, old[:size]) for larger, old in zip(more, rows, strict=True))
            for kept, own in zip(self.rows, made, strict=True):
                kept[size : size + len(new)] = own
            self._at |= {name: size + at for at, name in enumerate(new)}
        return np.array([self._at[name] for name in names], dtype=np.intp)


def _filled(larger: NDArray[Any], rows: NDArray[Any]) -> NDArray[Any]:
    """An array whose first rows are these."""
    larger[: len(rows)] = rows
    return larger


class CellKernels(NamedTuple):
    """What is known of cells.

    `kernels`: at their corners, each place once, ndarray[n_places, n_channels, n_channels, n_functions]; `corners`:
    those of each cell, ndarray[n_cells, 4]; `deviation`: how far the kernel in them may be from that.
    """

    kernels: FloatArray
    corners: IndexArray
    deviation: Deviation


class KeptCells:
    """Kernels at places and in cells of places: what designs, spaces and tolerances of one scene share."""

    def __init__(self, view: View) -> None:
        self._view, wave = view, view.grid.nodes_nm
        knots_nm = wave if view.methods.blur == "skip" else blur.knots(wave, view.methods.blur)
        self.between = Between(view, view.methods, knots_nm)
        self._light = PlaceKernels(view, view.methods, knots_nm)
        self.functions = self._light.shares @ hats(wave, knots_nm)
        self._places, self._cells = _Kept(), _Kept()
        self._one_at_a_time = threading.Lock()

    def of_cells(self, cells: phase.Cells, work: Counter[str]) -> CellKernels:
        """Of some cells; those that are new are made."""

        def in_cells(new: IndexArray) -> _Rows:
            work["cells"] += len(new)
            some = phase.Cells(cells.centers[new], cells.homes[new], cells.half)
            corners = self._corners(some, work)
            _, low, high = self._places.rows
            ranges = np.stack([low[corners], high[corners]])
            ranges = ranges.reshape(2, len(new), len(phase.CORNERS), *low.shape[1:])
            found = self.between.of_cells(some.centers, some.half, some.homes, ranges)
            return found.kernel, found.tilt, corners.reshape(len(new), len(phase.CORNERS))

        with self._one_at_a_time:
            if self._places.nbytes + self._cells.nbytes > _KEPT_BYTES:
                self._places, self._cells = _Kept(), _Kept()
            which = self._cells.which(self._names(cells.centers, cells.homes), in_cells)
            deviation, tilt, corners = (rows[which] for rows in self._cells.rows)
            places, numbered = np.unique(corners, return_inverse=True)
            kernels = self._places.rows[0][places]
        return CellKernels(kernels, numbered.reshape(corners.shape), Deviation(deviation, tilt))

    def _corners(self, cells: phase.Cells, work: Counter[str]) -> IndexArray:
        """The rows of the corners of cells, those of a cell one after the other."""
        corners = cells.corners

        def at_places(new: IndexArray) -> _Rows:
            work["places"] += len(new)
            kernels = self._light.at(corners.some(new), work)
            low, high = self.between.ranges(kernels @ self._light.shares)
            return kernels, low, high

        return self._places.which(self._names(corners.places_px, corners.home_px), at_places)

    def _names(self, places: FloatArray, homes: FloatArray) -> list[Hashable]:
        """A name for each place (ndarray[n, 2]), with the pixel that is read out there, where one is.

        Places are sums of few powers of two, so that no digit is lost. Cells of one size have no center in common with
        those of another.
        """
        target = self._view.scenario.target
        assert target is not None
        names = (places + 0.0).view(complex)[:, 0].tolist()  # no -0
        if target.readout == "center":
            return list(zip(names, (homes + 0.0).view(complex)[:, 0].tolist(), strict=True))
        return list(names)


_SCENES: Cache[bytes, KeptCells] = Cache(4)


def forget_cells() -> None:
    """Let the next scene compute its kernels anew, as one that is the first."""
    _SCENES.clear()


def kept_cells(view: View) -> KeptCells:
    """Those of a scene: filters, noise and the light's way to the lens have no part in it."""
    own = [name for name, effect in EFFECTS.items() if isinstance(effect, KernelEffect) and not effect.is_limit]
    kept = {name: getattr(view.methods, name) for name in own}
    methods = replace(REFERENCE, **kept, **WHOLE_LIGHT)
    bare = replace(colorless(view), methods=methods)
    return _SCENES.get(hashlib.sha256(pickle.dumps(bare)).digest(), lambda: KeptCells(bare))
