"""Random lamps and cameras: draws of two lights and of how a filter comes out, the same for all designs.

The distance that the wanted share of them has is an order statistic, whose derivative is that of a single draw. What is
told and searched is the mean of the draws that rank right below it instead, a tenth of those that may have less: its
derivative is the mean of theirs, which changes little as draws pass one another, and it is never above the order
statistic. That one's rank is so low that with 95 % confidence the share of all lamps and cameras has no less, not of
the draws alone; but of a design that a search has chosen by these very draws, nothing is said of others.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..curves.lights import Pair
from ..curves.members import Members
from ..designs.tolerance import Off, Tolerance
from .members import PopulationImager
from .separation import csd_name

_PARTS, _PARTS_OF_BOTH = 101, 25
"""Equal parts of the range of a tolerance, and of each where there are two; what is drawn is the middle of one."""
_NEAR = 0.1
"""Of the draws that may have less: the share of them whose mean is taken."""
_MISTAKEN = 0.05
"""The chance that fewer than the wanted share of all lamps and cameras have what is told of a design."""
_HELD = 4_000_000
"""Values of responses that are held at once."""


@dataclass(frozen=True)
class Draws:
    """Two lights and a camera each, those whose filters come out alike one after the other.

    `offs`: how filters come out; `starts`: where the draws of each begin, and the end. `below`, `share`: of both lights
    the spectrum below their shift, and how far above it, ndarray[n, 2]; `place`: of the field, 0 to 1, ndarray[n].
    """

    offs: tuple[Off, ...]
    starts: IndexArray
    below: IndexArray
    share: FloatArray
    place: FloatArray

    @property
    def size(self) -> int:
        """How many there are."""
        return int(self.place.size)

    def distances(self, off: int, response: FloatArray, out: FloatArray) -> None:
        """Puts the distances of those whose filter comes out in one of the ways into `out`, DN, ndarray[n].

        `response`: of that filter to every spectrum, ndarray[n_cases, n_spectra, n_channels].
        """
        own = slice(int(self.starts[off]), int(self.starts[off + 1]))
        out[own] = np.sqrt((self.apart(own, response) ** 2).sum(axis=-1))

    def apart(self, some: slice | IndexArray, response: FloatArray) -> FloatArray:
        """First minus second light of some draws: ndarray[..., n_cases, n_spectra, n] -> ndarray[..., n_some, n]."""
        n_cases, below, share = response.shape[-3], self.below[some], self.share[some]
        case = np.minimum((self.place[some] * n_cases).astype(np.intp), n_cases - 1)
        low, high = (response[..., case[:, None], below + step, :] for step in (0, 1))
        both = low + share[..., None] * (high - low)
        return np.asarray(both[..., 0, :] - both[..., 1, :], dtype=float)


def draws_of(members: Members, pair: Pair, tolerance: Tolerance, seed: Sequence[int]) -> Draws:
    """The draws of two types, evenly; every number is drawn whatever the design, so that all see the same."""
    population = members.population
    rng, n = np.random.default_rng(seed), population.draws
    ambient, heating, u, chosen, edge, place, film = (rng.random((n, k)) for k in (2, 2, 2, 4, 1, 1, 1))
    if population.temperatures == "common":
        ambient, heating = (np.repeat(values[:, :1], 2, axis=1) for values in (ambient, heating))
    low, high = population.temperature_c
    warmer = low + ambient * (high - low) + heating * population.self_heating_k - population.reference_c
    rows, steps, widths = [], [], len(population.width)
    for side, kind in enumerate(pair):
        starts = members.rows[kind]
        signals = starts.size // widths
        at = np.minimum((chosen[:, side] * signals).astype(int), signals - 1)
        width = np.minimum((chosen[:, 2 + side] * widths).astype(int), widths - 1)
        known = [members.drift_and_own(members.signal(int(row))) for row in starts[::widths]]
        drifts, own = np.array([drift for drift, _ in known]), np.array([ends for _, ends in known])
        nm = drifts[at] * warmer[:, side] + own[at, 0] + u[:, side] * (own[at, 1] - own[at, 0])
        rows.append(starts[at * widths + width])
        steps.append(members.steps_of(nm))
    first, shifts = np.stack(rows, axis=1), np.stack(steps, axis=1)
    below = np.minimum(np.floor(shifts).astype(np.intp), members.n_steps - 2)
    offs, which = _offs(tolerance, edge[:, 0], film[:, 0])
    order = np.argsort(which, kind="stable")
    starts = np.searchsorted(which[order], np.arange(len(offs) + 1))
    return Draws(offs, starts, (first + below)[order], (shifts - below)[order], place[order, 0])


def _offs(tolerance: Tolerance, edge: FloatArray, film: FloatArray) -> tuple[tuple[Off, ...], IndexArray]:
    """How filters come out, and which of these each draw is: from numbers in 0..1, ndarray[n_draws] each."""
    kinds = tolerance.edge_shift_nm > 0, tolerance.thickness > 0
    parts = _PARTS_OF_BOTH if all(kinds) else _PARTS
    edges, films = (parts if kind else 1 for kind in kinds)
    middles = [[(2 * number + 1) / count - 1 for number in range(count)] for count in (edges, films)]
    places = [np.minimum((drawn * count).astype(np.intp), count - 1) for drawn, count in ((edge, edges), (film, films))]
    offs = tuple(tolerance.at(one, other) for one in middles[0] for other in middles[1])
    return offs, places[0] * films + places[1]


def rank_below(draws: int, share: float) -> int:
    """The highest rank, from below and from 1, of a draw with no more than a share of all has, but for `_MISTAKEN`.

    So many draws or more lie in the rest of all, whose number is binomial (Clopper and Pearson, Biometrika 26, 404,
    1934, one-sided).
    """
    from scipy.special import bdtr  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return bisect_right(range(draws), _MISTAKEN, key=lambda fewer: bdtr(fewer, draws, 1 - share))


class LampsAndCameras:
    """The draws of a scene, made once for each two types; others than those by which a yield is counted in the end."""

    def __init__(self, seen: PopulationImager, tolerance: Tolerance, seed: int) -> None:
        """`seen`: the scene with all members of its lights, of which a share is wanted."""
        self.seen, self._tolerance, self._seed = seen, tolerance, seed
        self._draws: dict[Pair, Draws] = {}

    def draws(self, pair: Pair) -> Draws:
        """Those of two types."""
        if pair not in self._draws:
            self._draws[pair] = draws_of(self.seen.members, pair, self._tolerance, (self._seed, 2))
        return self._draws[pair]

    def kept(self, curves: FloatArray, pairs: Sequence[Pair]) -> dict[Pair, tuple[float, IndexArray]]:
        """What the wanted share of lamps and cameras has of a design, DN, and the draws of which that is the mean.

        For each pair. `curves`: how it comes out, in the order of the draws' `offs`, ndarray[n_offs, n_modified,
        n_wavelengths]. NaN where a response is no number.
        """
        imager = self.seen.imager
        found = {pair: np.empty(self.draws(pair).size) for pair in pairs}
        step = max(
            1, _HELD // (imager.n_cases * self.seen.setup.lights.photons.shape[0] * len(self.seen.setup.camera.qe))
        )
        for start in range(0, len(curves), step):
            for off, response in enumerate(imager.smooth(curves[start : start + step]), start):
                for pair, distances in found.items():
                    self.draws(pair).distances(off, response, distances)
        return {pair: self._of_share(distances) for pair, distances in found.items()}

    def _of_share(self, distances: FloatArray) -> tuple[float, IndexArray]:
        """What the wanted share has of all distances, ndarray[n_draws], and the draws of which that is the mean."""
        below, count = self._ranks
        lowest = np.argpartition(distances, below - 1)[:below]
        chosen = lowest[np.argsort(distances[lowest], kind="stable")[below - count :]]
        return (float(distances[chosen].mean()) if np.isfinite(distances).all() else np.nan), chosen

    def columns(
        self, made: Callable[[Off, slice], FloatArray], n_designs: int, pairs: Sequence[Pair]
    ) -> dict[str, FloatArray]:
        """The same of several designs for each pair, by the name of its CSD, ndarray[n_designs].

        `made`: how some of them come out, ndarray[n_some, n_modified, n_wavelengths]; so many are made at once that no
        more than `_HELD` values are held.
        """
        offs, setup = self.draws(pairs[0]).offs, self.seen.setup
        step = max(1, _HELD // (len(offs) * max(1, len(setup.camera.modified)) * setup.camera.grid.size))
        found: dict[str, list[float]] = {csd_name(pair): [] for pair in pairs}
        for start in range(0, n_designs, step):
            some = slice(start, min(start + step, n_designs))
            for curves in np.stack([made(off, some) for off in offs], axis=1):
                for pair, (value, _) in self.kept(curves, pairs).items():
                    found[csd_name(pair)].append(value)
        return {name: np.array(values) for name, values in found.items()}

    @property
    def _ranks(self) -> tuple[int, int]:
        """How many draws may have less than what the wanted share has, and of how many of these the mean is taken."""
        population = self.seen.members.population
        assert population.wanted_yield is not None
        below = rank_below(population.draws, population.wanted_yield)
        return below, max(1, round(_NEAR * below))
