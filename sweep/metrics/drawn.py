"""Random lamps and cameras: draws of lights, curves and a production error, the same for all designs.

The distance that the wanted share of them has is an order statistic, whose derivative is that of a single draw. The
column and the search use the mean of the draws that rank right below it, a tenth of those that may have less: its
derivative changes little as draws pass one another, and it is never above the order statistic. That rank is so low
that with 95 % confidence the share of all lamps and cameras has no less; for a design that a search chose by these
very draws, nothing follows for other draws.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ..base.types import (
    Array,
    ChannelCurves,
    CurvesGradient,
    Float,
    IndexArray,
    Int,
    PerDesign,
    PerFree,
    PerParameter,
    PerSample,
)
from ..designs.family import Family
from ..designs.tolerance import ProductionError, Tolerance
from ..spectra.lights import Pair
from ..spectra.members import Members
from .members import PopulationModel
from .separation import csd_name

_PARTS = {0: 1, 1: 101, 2: 25, 3: 9}
"""Equal parts of the range of each tolerance, by the number of tolerances; draws are middles of parts."""
_NEAR = 0.1
"""Share of the draws that may have less over which the mean is taken."""
_MISTAKEN = 0.05
"""The chance that fewer than the wanted share of all lamps and cameras reach the stated value of a design."""
_HELD = 4_000_000
"""Values of responses that are held at once."""


@dataclass(frozen=True)
class Draws:
    """Two lights and a camera per draw, sorted by production error.

    `below`: spectrum below the shift of both lights; `place`: field position, 0 to 1; `order`: number of each draw
    before it was sorted.
    """

    production_errors: tuple[ProductionError, ...]
    starts: Int[IndexArray, " starts"]
    below: Int[IndexArray, "draws 2"]
    share: Float[Array, "draws 2"]
    place: Float[Array, " draws"]
    order: Int[IndexArray, " draws"]

    @property
    def size(self) -> int:
        """Number of draws."""
        return int(self.place.size)

    def distances(
        self, error_index: int, response: Float[Array, "cases spectra channels"], out: Float[Array, " draws"]
    ) -> None:
        """Compute the distances of the draws with one production error.

        `response`: response of that filter to every spectrum, DN; `out`: distances, DN; changed in place.
        """
        draws = slice(int(self.starts[error_index]), int(self.starts[error_index + 1]))
        out[draws] = np.sqrt((self.differences(draws, response) ** 2).sum(axis=-1))

    def differences(
        self, subset: slice | Int[IndexArray, " some"], response: Float[Array, "*batch cases spectra channels"]
    ) -> Float[Array, "*batch some channels"]:
        """Return first minus second light of some draws."""
        lamps = self.lamps(subset, response)
        return np.asarray(lamps[..., 0, :] - lamps[..., 1, :], dtype=float)

    def lamps(
        self, subset: slice | Int[IndexArray, " some"], response: Float[Array, "*batch cases spectra channels"]
    ) -> Float[Array, "*batch some 2 channels"]:
        """Return both lights of some draws."""
        n_cases, below, share = response.shape[-3], self.below[subset], self.share[subset]
        case = np.minimum((self.place[subset] * n_cases).astype(np.intp), n_cases - 1)
        low, high = (response[..., case[:, None], below + step, :] for step in (0, 1))
        return np.asarray(low + share[..., None] * (high - low), dtype=float)


def draws_of(members: Members, pair: Pair, tolerance: Tolerance, seed: Sequence[int], n: int) -> Draws:
    """Draw lights and production errors uniformly, independent of the design."""
    population = members.population
    rng = np.random.default_rng(seed)
    ambient, heating, u, chosen, edge, place, film, broader = (rng.random((n, k)) for k in (2, 2, 2, 4, 1, 1, 1, 1))
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
        known = [members.drift_and_independent(members.signal(int(row))) for row in starts[::widths]]
        drifts, independent = np.array([drift for drift, _ in known]), np.array([ends for _, ends in known])
        nm = drifts[at] * warmer[:, side] + independent[at, 0] + u[:, side] * (independent[at, 1] - independent[at, 0])
        rows.append(starts[at * widths + width])
        steps.append(members.steps_of(nm))
    first, shifts = np.stack(rows, axis=1), np.stack(steps, axis=1)
    below = np.minimum(np.floor(shifts).astype(np.intp), members.n_steps - 2)
    production_errors, which = drawn_errors(tolerance, [edge[:, 0], film[:, 0], broader[:, 0]])
    order = np.argsort(which, kind="stable")
    starts = np.searchsorted(which[order], np.arange(len(production_errors) + 1))
    return Draws(production_errors, starts, (first + below)[order], (shifts - below)[order], place[order, 0], order)


def drawn_errors(
    tolerance: Tolerance, drawn: Sequence[Float[Array, " draws"]]
) -> tuple[tuple[ProductionError, ...], Int[IndexArray, " draws"]]:
    """Return production errors, and which of them each draw has, from numbers in 0..1 of edge, film and width."""
    kinds = [tolerance.edge_shift_nm > 0, tolerance.thickness > 0, tolerance.broadening > 0]
    counts = [_PARTS[sum(kinds)] if kind else 1 for kind in kinds]
    edges, films, widths = ([(number + 0.5) / count for number in range(count)] for count in counts)
    production_errors = tuple(
        tolerance.at(2 * edge - 1, 2 * film - 1, width) for edge, film, width in product(edges, films, widths)
    )
    parts = [np.minimum((u * count).astype(np.intp), count - 1) for u, count in zip(drawn, counts, strict=True)]
    return production_errors, np.ravel_multi_index(parts, counts)


def rank_below(draws: int, share: float) -> int:
    """Return the highest rank, from below and from 1, with no more than a share of all, but for `_MISTAKEN`.

    The number of draws in the rest of all is binomial (Clopper and Pearson, Biometrika 26, 404, 1934, one-sided).
    """
    from scipy.special import bdtr  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return bisect_right(range(draws), _MISTAKEN, key=lambda fewer: bdtr(fewer, draws, 1 - share))


class Sample(ABC):
    """Random cameras and lamps, the same for all designs; draws are sorted by their production errors."""

    def __init__(self, tolerance: Tolerance, wanted_yield: float, draws: int) -> None:
        self.production_errors, self._share, self.size = (
            drawn_errors(tolerance, [np.zeros(1)] * 3)[0],
            wanted_yield,
            draws,
        )

    @abstractmethod
    def starts(self, pair: Pair) -> Int[IndexArray, " starts"]:
        """Return the first draw of each production error, and the number of draws."""

    @abstractmethod
    def distances(
        self, curves: Float[Array, "production_errors modified wavelengths"], pairs: Sequence[Pair]
    ) -> dict[Pair, PerSample]:
        """Return the distance of each draw for one design, DN; NaN where a response is NaN."""

    @abstractmethod
    def slope(
        self, pair: Pair, subset: Int[IndexArray, " subset"], curves: ChannelCurves, by_u: CurvesGradient
    ) -> PerParameter:
        """Return the sum of the derivatives of the distances of draws with one production error and these curves."""

    def of_share(self, distances: PerSample) -> tuple[float, Int[IndexArray, " _kept"]]:
        """Return the distance that the wanted share has, and the draws whose mean it is."""
        below, count = self._ranks
        lowest = np.argpartition(distances, below - 1)[:below]
        chosen = lowest[np.argsort(distances[lowest], kind="stable")[below - count :]]
        return (float(distances[chosen].mean()) if np.isfinite(distances).all() else np.nan), chosen

    @cached_property
    def _ranks(self) -> tuple[int, int]:
        """Number of draws that may have less than the wanted share has, and number of them whose mean is taken."""
        below = rank_below(self.size, self._share)
        return below, max(1, round(_NEAR * below))

    def share_and_slope(
        self, pair: Pair, family: Family, x: PerParameter, free: Int[IndexArray, " free"], span: PerFree
    ) -> tuple[float, PerFree]:
        """Return the distance that the wanted share has, and its derivative by the free parameters."""
        families = [family.perturbed(error) if any(error) else family for error in self.production_errors]
        curves = np.stack([each.curves(x[None])[0] for each in families])
        value, chosen = self.of_share(self.distances(curves, [pair])[pair])
        slope = np.zeros(free.size)
        if np.isfinite(value):
            which = np.searchsorted(self.starts(pair), chosen, side="right") - 1
            for error in np.unique(which):
                by_u = families[error].gradient(x)[free] * span[:, None, None]
                slope += self.slope(pair, chosen[which == error], curves[error], by_u)
        return value, slope / chosen.size

    def columns(
        self,
        curves_of: Callable[[ProductionError, slice], Float[Array, "_draws modified wavelengths"]],
        n_designs: int,
        pairs: Sequence[Pair],
    ) -> dict[str, PerDesign]:
        """Return the distance that the wanted share has, for several designs, DN, by the name of the CSD."""
        columns: dict[str, list[float]] = {csd_name(pair): [] for pair in pairs}
        for design in range(n_designs):
            at = slice(design, design + 1)
            curves = np.stack([curves_of(error, at)[0] for error in self.production_errors])
            for pair, distances in self.distances(curves, pairs).items():
                columns[csd_name(pair)].append(self.of_share(distances)[0])
        return {name: np.array(values) for name, values in columns.items()}


class LampsAndCameras(Sample):
    """Two random lamps of a population each, and a production error."""

    def __init__(
        self, population_model: PopulationModel, tolerance: Tolerance, seed: Sequence[int], wanted_yield: float = 0.0
    ) -> None:
        """Store the scene with all members of its lights, the tolerance and the seed."""
        super().__init__(tolerance, wanted_yield, population_model.members.population.draws)
        self._model, self._tolerance, self._seed = population_model, tolerance, seed
        self._draws: dict[Pair, Draws] = {}

    def draws(self, pair: Pair) -> Draws:
        """Return the draws of two types."""
        if pair not in self._draws:
            self._draws[pair] = draws_of(self._model.members, pair, self._tolerance, self._seed, self.size)
        return self._draws[pair]

    def starts(self, pair: Pair) -> Int[IndexArray, " starts"]:
        """Return the first draw of each production error, and the number of draws."""
        return self.draws(pair).starts

    def distances(
        self, curves: Float[Array, "production_errors modified wavelengths"], pairs: Sequence[Pair]
    ) -> dict[Pair, PerSample]:
        """Return the distance of each draw for one design, DN."""
        linear, setup = self._model.linear, self._model.setup
        distances_of = {pair: np.empty(self.size) for pair in pairs}
        step = max(1, _HELD // (linear.n_cases * setup.lights.photons.shape[0] * len(setup.camera.qe)))
        for start in range(0, len(curves), step):
            for error, response in enumerate(linear.smooth(curves[start : start + step]), start):
                for pair, distances in distances_of.items():
                    self.draws(pair).distances(error, response, distances)
        return distances_of

    def slope(
        self, pair: Pair, subset: Int[IndexArray, " subset"], curves: ChannelCurves, by_u: CurvesGradient
    ) -> PerParameter:
        """Return the sum of the derivatives of the distances of draws with one production error."""
        draws, linear = self.draws(pair), self._model.linear
        differences = draws.differences(subset, linear.smooth(curves[None])[0])
        slopes = draws.differences(subset, linear.smooth_with_gradient(curves, by_u)[1])
        return lengths_slope(differences, slopes)


def lengths_slope(
    differences: Float[Array, "draws channels"], slopes: Float[Array, "free draws channels"]
) -> PerParameter:
    """Return the sum of the derivatives of the lengths of differences; of none that is 0."""
    length = np.linalg.norm(differences, axis=-1)
    along = (slopes * differences).sum(axis=-1)
    return np.asarray(np.divide(along, length, out=np.zeros_like(along), where=length > 0).sum(axis=1), dtype=float)
