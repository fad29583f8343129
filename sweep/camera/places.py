"""The smallest and the largest color separation distance over all real places of a light on the mosaic.

The tile is divided into cells. In each, all distances are bounded from the responses at its nine nodes and from what
may lie between them (`between`); cells that may hold a smaller or a larger distance than those found, by more
than the method of `phase` leaves open, are divided. The readout is taken as straight.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..curves.lights import Pair, class_pairs
from .compiled_distances import CellDistances, distances
from .compiled_search import ends_of, still_open
from .effects import phase
from .place_cells import CellKernels, kept_cells
from .registry import factor_of_light
from .view import View

OWN_DN = 1e-5
"""What a search leaves of its tolerance for its own kernels; they were seen 2e-6 DN from those of a readout."""
_MOST_CELLS = 400_000
"""Cells of one design, after which the search gives up."""
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


class AnyPlace:
    """A scene in which the light may fall anywhere, ready for designs.

    `work` counts the places and cells that are computed; those of other designs of the scene are kept.
    """

    def __init__(self, view: View, work: Counter[str]) -> None:
        within_dn, wave = phase.within_dn(view.methods.phase), view.grid.nodes_nm
        if within_dn is None:
            raise ValueError(f"{view.methods.phase!r} looks at a lattice of places")
        self.within_dn, self.members = within_dn - OWN_DN, view.members
        self._mosaic, self._work, self._cells = view.mosaic, work, kept_cells(view)
        self._dimmed = factor_of_light(view, view.methods, wave)

    def extremes(self, light_dn: FloatArray) -> dict[Pair, Extremes | None]:
        """Extremes of every pair of types; None where too many cells would be needed.

        `light_dn`: what each signal gives in each channel at each wavelength where its image is whole, DN,
        ndarray[n_signals, n_channels, n_wavelengths].
        """
        light, whole = light_dn * self._dimmed, phase.whole(self._mosaic)
        by_function = (light @ self._cells.functions.T).reshape(len(light), -1)
        searches = {
            (a, b): _Search(self, whole, light, self.members[a], self.members[b])
            for a, b in class_pairs(list(self.members))
        }
        active = list(searches.values())
        while active:
            self._look(active, by_function)
            active = [search for search in active if search.goes_on()]
        return {pair: search.found for pair, search in searches.items()}

    def amounts(self, light: FloatArray, first: IndexArray, second: IndexArray) -> FloatArray:
        """`Between.amounts` of pairs of lights."""
        return self._cells.between.amounts(light, first, second)

    def _look(self, searches: Sequence[_Search], light: FloatArray) -> None:
        """Bound all distances in the cells of all searches, which are of one size: each cell once.

        `light`: by the functions of the kernels, DN, ndarray[n_signals, n_channels x n_functions].
        """
        union, cells = _together([search.cells for search in searches])
        each = len(phase.NODES) * light.shape[1] * len(self._mosaic.channels)
        step = max(1, _AT_ONCE // max(each, *(16 * search.pairs.size for search in searches)))
        # Of the signals, those of pairs that may still be the nearest.
        signals = np.unique(np.concatenate([signals for search in searches for signals in search.of_pairs]))
        for at in range(0, len(union.centers), step):
            known = self._cells.of_cells(union.some(slice(at, at + step)), self._work)
            kernels = known.kernels.reshape(-1, light.shape[1])
            seen = (kernels @ light[signals].T).reshape(*known.kernels.shape[:2], signals.size)
            for search, own in zip(searches, cells, strict=True):
                some = np.flatnonzero((own >= at) & (own < at + step))
                if some.size:
                    search.take(some, own[some] - at, seen, signals, known)


def _together(every: Sequence[phase.Cells]) -> tuple[phase.Cells, list[IndexArray]]:
    """Cells of one size, each once, and which of them each of some has."""
    centers, homes = (np.concatenate(parts) for parts in zip(*((c.centers, c.homes) for c in every), strict=True))
    _, first, which = np.unique(centers @ [1, 1j], return_index=True, return_inverse=True)
    ends = np.cumsum([len(cells.centers) for cells in every])
    return phase.Cells(centers[first], homes[first], every[0].half), np.split(which.ravel(), ends[:-1])


class _Search:
    """The extremes of one pair of types, for one design.

    `cells`: those to look at next; `pairs`: which pairs of signals may still be the nearest in them, `of_pairs`: the
    signals of these; `found`: the extremes, once they are known.
    """

    def __init__(
        self, scene: AnyPlace, whole: phase.Cells, light: FloatArray, first: IndexArray, second: IndexArray
    ) -> None:
        """`light`: of all signals, DN, ndarray[n_signals, n_channels, n_wavelengths]; `first`, `second`: the signals of
        each type.
        """
        one, other = (at.ravel() for at in np.meshgrid(first, second, indexing="ij"))
        self._within_dn, self._one, self._other = scene.within_dn, one, other
        self._amounts = scene.amounts(light, one, other).reshape(one.size, -1)
        nowhere = np.full((2, 2), np.nan)
        self._least, self._most = (np.inf, nowhere), (-np.inf, nowhere)
        self.found: Extremes | None = None
        self._counted = 0
        self._begin(whole, np.arange(one.size))

    def _begin(self, cells: phase.Cells, pairs: IndexArray) -> None:
        """Look at some cells and pairs next."""
        self.cells, self.pairs = cells, pairs
        self.of_pairs = self._one[pairs], self._other[pairs]
        n = len(cells.centers)
        self._known = CellDistances(np.empty((n, pairs.size)), np.empty(n), np.empty((n, len(phase.NODES))))

    def take(
        self, some: IndexArray, which: IndexArray, seen: FloatArray, signals: IndexArray, known: CellKernels
    ) -> None:
        """Bound the distances in some of the cells, which are those of `known`.

        `seen`: what the channels see of some signals at its places, DN, ndarray[n_places, n_channels, n_signals];
        `signals`: which these are. The difference of two signals' responses is within `rest`, and what its own slopes
        add, of the biquadratic function through those at the nodes, in each channel.
        """
        kernel = known.deviation.kernel
        rest = kernel[which].reshape(-1, self._amounts.shape[1]) @ self._amounts[self.pairs].T
        rest = rest.reshape(some.size, -1, self.pairs.size)
        pairs = np.searchsorted(signals, self.of_pairs[0]), np.searchsorted(signals, self.of_pairs[1])
        found = CellDistances(*(np.empty((len(some), *values.shape[1:])) for values in self._known))
        ends = self._least[0] - self._within_dn, self._most[0] + self._within_dn
        moves, half = known.deviation.moves[which], self.cells.half
        distances(seen, known.nodes[which], pairs, rest, moves, half, ends, found)
        for every, own in zip(self._known, found, strict=True):
            every[some] = own

    def goes_on(self) -> bool:
        """Whether cells are left to look at, once those before are bounded: not when all is found, or too much."""
        cells, (low, nearest, values) = self.cells, self._known
        self._counted += len(cells.centers)
        for at, sign, found in zip(ends_of(values), (1.0, -1.0), (self._least, self._most), strict=True):
            cell, node = divmod(at, len(phase.NODES))
            if sign * values[cell, node] < sign * found[0]:
                place = cells.centers[cell] + cells.half * phase.NODES[node]
                better = (float(values[cell, node]), np.stack([place, cells.homes[cell]]))
                self._least, self._most = (better, self._most) if sign > 0 else (self._least, better)
        least, most = self._least, self._most
        undecided, pairs = still_open(low, nearest, least[0] - self._within_dn, most[0] + self._within_dn)
        if not undecided.any():
            self.found = Extremes(least[0], most[0], least[1], most[1])
            return False
        self._begin(cells.divided(undecided), self.pairs[pairs])
        return self._counted < _MOST_CELLS
