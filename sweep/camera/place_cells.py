"""Kernels at the nodes of cells of places, and how far they may be from that in them: kept, each made once."""

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
from .between import Between, Deviation, of_channels
from .compiled_classes import CellBounds, kernels_of_channels
from .effects import blur, phase
from .effects.base import KernelEffect
from .kernel import colorless
from .methods import REFERENCE
from .pixel import Optics, Pixel
from .place_classes import Classes, classes_of
from .place_kernels import PlaceKernels
from .registry import EFFECTS, WHOLE_LIGHT
from .scenario import Scenario
from .view import View

_KEPT_BYTES = 200e6
_ROOM = 4
"""Memory is reserved for so many times the rows that there are, so that they are seldom copied."""
_Rows = tuple[NDArray[Any], ...]


class _Kept:
    """Arrays of one shape by their names, row by row."""

    def __init__(self) -> None:
        self._at: dict[Hashable, int] = {}
        self.rows: _Rows = ()

    @property
    def nbytes(self) -> int:
        """Memory that they take: what is only reserved takes none."""
        return sum(rows[: len(self._at)].nbytes for rows in self.rows)

    def which(self, names: list[Hashable], make: Callable[[IndexArray], _Rows]) -> IndexArray:
        """The rows of some names; `make` makes those of the names, by number, that are not kept."""
        new = {name: at for at, name in enumerate(names) if name not in self._at}
        if new:
            made, size = make(np.array(list(new.values()))), len(self._at)
            if not self.rows or size + len(new) > len(self.rows[0]):
                room = _ROOM * (size + len(new))
                more = (np.empty((room, *rows.shape[1:]), dtype=rows.dtype) for rows in made)
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

    `kernels`: at their nodes, each place once, ndarray[n_places, n_channels, n_channels, n_functions]; `nodes`: those
    of each cell, ndarray[n_cells, 9]; `deviation`: how far the kernel in them may be from its interpolation.
    """

    kernels: FloatArray
    nodes: IndexArray
    deviation: Deviation


class ClassCells:
    """Kernels of classes of pixels, at places and in cells of places: what the CFAs of a scene share."""

    def __init__(self, view: View, knots_nm: FloatArray, *, folded: bool) -> None:
        """`view`: of a mosaic whose channels are the classes; `knots_nm`: wavelengths at which the light is made;
        `folded`: whether `Classes` tells the pixels of the tile apart.
        """
        self._view = view
        self.between = Between(view, view.methods, knots_nm)
        self._light = PlaceKernels(view, view.methods, knots_nm, many=True, folded=folded)
        self._places, self._cells = _Kept(), _Kept()
        self._one_at_a_time = threading.RLock()

    @property
    def shares(self) -> FloatArray:
        """How much of each function of the light is at each wavelength, ndarray[n_functions, n_knots]."""
        return self._light.shares

    def at_places(self, cases: phase.Cases, classes: Classes, work: Counter[str]) -> FloatArray:
        """Kernels of channels at places, ndarray[n, n_channels, n_channels, n_functions]."""
        with self._one_at_a_time:
            self._forget_many()
            rows, which = self._rows(cases, classes, work)
            n = int(classes.channel.max()) + 1
            found = np.empty((len(rows), n, n, len(self.shares)))
            kernels, sums = self._places.rows[:2]
            kernels_of_channels(kernels, sums, rows, which, classes.channel, found)
        return found

    def in_cells(self, cells: phase.Cells, classes: Classes, work: Counter[str]) -> Deviation:
        """How far kernels of channels in cells may be from their interpolation through the nodes."""
        images, which = classes.images(cells.centers)

        def made(new: IndexArray) -> _Rows:
            work["cells"] += len(new)
            some = phase.Cells(images[new], cells.homes[new], cells.half)
            return tuple(self.between.bounds(some.centers, some.half, some.homes, *self._at_nodes(some, classes, work)))

        with self._one_at_a_time:
            self._forget_many()
            rows = self._cells.which(names_of(self._view, images, cells.homes), made)
            return of_channels(CellBounds(*self._cells.rows), self.between.uneven, rows, which, classes.channel)

    def _forget_many(self) -> None:
        if self._places.nbytes + self._cells.nbytes > _KEPT_BYTES:
            self._places, self._cells = _Kept(), _Kept()

    def _rows(self, cases: phase.Cases, classes: Classes, work: Counter[str]) -> tuple[IndexArray, IndexArray]:
        """The rows of the kernels at the places that stand for some, and the classes there (`Classes.images`)."""
        images, which = classes.images(cases.places_px)

        def made(new: IndexArray) -> _Rows:
            work["places"] += len(new)
            kernels, sums = self._light.at(phase.Cases(images[new], cases.home_px[new]), work)
            low, high = self.between.ranges(kernels, self.shares)
            return kernels, sums, low, high

        return self._places.which(names_of(self._view, images, cases.home_px), made), which

    def _at_nodes(
        self, cells: phase.Cells, classes: Classes, work: Counter[str]
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The sum of the weights of each class at the nodes of cells, ndarray[n_cells, 9, n_classes], and the range of
        each part of the kernel over these, ndarray[n_cells, n_classes, n_classes, n_parts] both.
        """
        rows, which = self._rows(cells.nodes, classes, work)
        n = len(cells.centers)
        to, through = which[:, :, None], which[:, None, :]
        ends = []
        for values, end in zip(self._places.rows[2:], (np.min, np.max), strict=True):
            own = values[rows[:, None, None], to, through]
            ends.append(end(own.reshape(n, -1, *own.shape[1:]), axis=1))
        return self._places.rows[1][rows[:, None], which].reshape(n, -1, which.shape[1]), ends[0], ends[1]


class KeptCells:
    """Kernels at places and in cells of places: what designs, spaces and tolerances of one CFA in a scene share."""

    def __init__(self, shared: ClassCells, view: View, classes: Classes) -> None:
        self._shared, self._view, self._classes = shared, view, classes
        wave = view.grid.nodes_nm
        self.between, self.functions = shared.between, shared.shares @ hats(wave, _knots_nm(view))
        self._places, self._cells = _Kept(), _Kept()
        self._one_at_a_time = threading.Lock()

    def of_cells(self, cells: phase.Cells, work: Counter[str]) -> CellKernels:
        """Of some cells; those that are new are made."""

        def in_cells(new: IndexArray) -> _Rows:
            some = phase.Cells(cells.centers[new], cells.homes[new], cells.half)
            nodes = self._nodes(some, work)
            found = self._shared.in_cells(some, self._classes, work)
            return found.kernel, found.moves, nodes.reshape(len(new), len(phase.NODES))

        with self._one_at_a_time:
            if self._places.nbytes + self._cells.nbytes > _KEPT_BYTES:
                self._places, self._cells = _Kept(), _Kept()
            which = self._cells.which(names_of(self._view, cells.centers, cells.homes), in_cells)
            sizes, moves, nodes = (rows[which] for rows in self._cells.rows)
            places, numbered = np.unique(nodes, return_inverse=True)
            kernels = self._places.rows[0][places]
        return CellKernels(kernels, numbered.reshape(nodes.shape), Deviation(sizes, moves))

    def _nodes(self, cells: phase.Cells, work: Counter[str]) -> IndexArray:
        """The rows of the nodes of cells, those of a cell one after the other."""
        nodes = cells.nodes

        def at_places(new: IndexArray) -> _Rows:
            return (self._shared.at_places(nodes.some(new), self._classes, work),)

        return self._places.which(names_of(self._view, nodes.places_px, nodes.home_px), at_places)


def names_of(view: View, places: FloatArray, homes: FloatArray) -> list[Hashable]:
    """A name for each place (ndarray[n, 2]), with the pixel that is read out there, where one is.

    Places are sums of few powers of two, so that no digit is lost. Cells of one size have no center in common with
    those of another.
    """
    target = view.scenario.target
    assert target is not None
    names = (places + 0.0).view(complex)[:, 0].tolist()  # no -0
    if target.readout == "center":
        return list(zip(names, (homes + 0.0).view(complex)[:, 0].tolist(), strict=True))
    return list(names)


_SHARED: Cache[bytes, ClassCells] = Cache(4)
_SCENES: Cache[bytes, KeptCells] = Cache(8)


def forget_cells() -> None:
    """Let the next scene compute its kernels anew, as one that is the first."""
    _SCENES.clear()
    _SHARED.clear()


def _bare(view: View) -> View:
    """What the kernels at places depend on: filters, noise, exposure and the light's way to the lens have no part."""
    own = [name for name, effect in EFFECTS.items() if isinstance(effect, KernelEffect) and not effect.is_limit]
    methods = replace(REFERENCE, **{name: getattr(view.methods, name) for name in own}, **WHOLE_LIGHT)
    optics, pixel = view.scenario.optics, view.pixel
    scenario = Scenario(target=view.scenario.target, optics=Optics(f_number=optics.f_number, focus_m=optics.focus_m))
    sizes = Pixel(pitch_um=pixel.pitch_um, fill_factor=pixel.fill_factor, crosstalk=pixel.crosstalk)
    return replace(colorless(view), methods=methods, scenario=scenario, pixel=sizes, tasks=None)


def _knots_nm(view: View) -> FloatArray:
    """Wavelengths at which a view's method makes the light."""
    wave = view.grid.nodes_nm
    return wave if view.methods.blur == "skip" else blur.knots(wave, view.methods.blur)


def kept_cells(view: View) -> KeptCells:
    """Those of a scene."""

    def named(of: View) -> bytes:
        return hashlib.sha256(pickle.dumps(of)).digest()

    bare = _bare(view)

    def made() -> KeptCells:
        apart, classes = classes_of(bare)
        folded = classes.tile is not None
        shared = _SHARED.get(named(apart), lambda: ClassCells(apart, _knots_nm(apart), folded=folded))
        return KeptCells(shared, bare, classes)

    return _SCENES.get(named(bare), made)
