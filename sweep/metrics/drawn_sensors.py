"""Random cameras: curves within the errors that a study states, and a production error.

The response is linear in a curve but for the exposure, so that a draw of a camera is a row of weights of the filter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.types import (
    Array,
    ChannelCurves,
    CurvesGradient,
    DesignCurves,
    Float,
    FloatArray,
    IndexArray,
    Int,
    PerParameter,
    PerSample,
)
from ..camera.curve_errors import linear_in_filter
from ..camera.exposure import exposure_times, relative_slope
from ..camera.linear import linear_model
from ..camera.setup import Setup
from ..designs.tolerance import Tolerance
from ..spectra.lights import Pair, class_pairs
from .drawn import Draws, LampsAndCameras, Sample, drawn_errors, draws_of, lengths_slope
from .members import population_model
from .separation import separation

_SEARCHED, _JUDGED = 2, 1
"""Streams of the draws that a column and a search look at, and of those that designs are judged on."""
_MORE = 10
"""Times as many random sensors are judged on as a search looks at."""


@dataclass(frozen=True)
class _Seen:
    """What draws see of two signal types: the first, then the second; `fixed`: in channels that no filter changes, DN.

    `modified`: for each modified channel, its elements, and their response per unit of QE, of every draw or of all.
    """

    starts: Int[IndexArray, " starts"]
    n_first: int
    fixed: Float[Array, "draws cases lamps elements"]
    modified: tuple[tuple[IndexArray, FloatArray], ...]

    def of(self, modified: DesignCurves, subset: IndexArray | slice = slice(None)) -> FloatArray:
        """Return the response of draws by curves of the modified channels, DN at the exposure of the stated curves."""
        lamps = self.fixed[subset].copy()
        for at, (elements, per_qe) in enumerate(self.modified):
            lamps[..., elements] += _seen(modified[:, at], per_qe, subset)
        return lamps

    def slopes(self, by_u: Float[Array, "free draws modified wavelengths"], subset: IndexArray) -> FloatArray:
        """Return the derivatives of the response of draws at the exposure of the stated curves."""
        slopes = np.zeros((len(by_u), len(subset), *self.fixed.shape[1:]))
        for at, (elements, per_qe) in enumerate(self.modified):
            for number, of_one in enumerate(by_u[:, :, at]):
                slopes[number][..., elements] += _seen(of_one, per_qe, subset)
        return slopes


def _seen(
    curves: Float[Array, "draws wavelengths"],
    per_qe: Float[Array, "_draws cases lamps elements wavelengths"],
    subset: IndexArray | slice = slice(None),
) -> Float[Array, "draws cases lamps elements"]:
    """Return the response by curves, each to the lamps of its draw, or to the same of all."""
    if len(per_qe) == 1:
        shared = per_qe[0].reshape(-1, per_qe.shape[-1])
        return np.asarray((curves @ shared.T).reshape(-1, *per_qe.shape[1:-1]))
    return np.asarray(np.einsum("dw,dclew->dcle", curves, per_qe[subset]), dtype=float)


class RandomSensors(Sample):
    """Cameras with random curves and a production error: they see all lights, or two random lamps of a population.

    Of all lights, as of field positions and sampling phases, the nearest two count.
    """

    def __init__(self, setup: Setup, tolerance: Tolerance, seed: Sequence[int]) -> None:
        """Draw the curves."""
        uncertain = setup.camera.uncertain
        assert uncertain is not None
        super().__init__(tolerance, setup.wanted_yield, uncertain.errors.draws)
        self._tolerance, self._seed = tolerance, seed
        self._population = None if setup.lights.population is None else population_model(setup)
        scene = setup.with_all_effects if self._population is None else self._population.setup
        self._camera = camera = scene.camera
        self._setup = scene.with_camera(modified=tuple(range(len(camera.qe))))
        self._linear = linear_model(self._setup)
        if self._population is None:
            which = drawn_errors(tolerance, [*np.random.default_rng([*seed, 0]).random((3, self.size))])[1]
            order = np.argsort(which, kind="stable")
            self._starts = np.searchsorted(which[order], np.arange(len(self.production_errors) + 1))
        else:  # production errors, and so the order, are the same for each two types
            order = self._lamps(class_pairs(setup.lights.classes)[0]).order
        self._drawn = uncertain.drawn(camera.grid, seed)[order]
        parts = [linear_in_filter(self._drawn[:, at], camera.qe[at]) for at in camera.modified]
        self._weights = np.stack([weights for weights, _ in parts], axis=1) if parts else self._drawn[:, :0]
        self._rest = np.stack([rest for _, rest in parts], axis=1) if parts else self._drawn[:, :0]
        self._seen: dict[Pair, _Seen] = {}

    def starts(self, pair: Pair) -> Int[IndexArray, " starts"]:
        """Return the first draw of each production error, and the number of draws."""
        return self._of(pair).starts

    def distances(
        self, curves: Float[Array, "production_errors modified wavelengths"], pairs: Sequence[Pair]
    ) -> dict[Pair, PerSample]:
        """Return the distance of each draw for one design, DN."""
        distances = {}
        for pair in pairs:
            seen = self._of(pair)
            modified = self._weights * np.repeat(curves, np.diff(seen.starts), axis=0) + self._rest
            lamps = seen.of(modified) * self._relative_exposure(modified)[:, None, None, None]
            first, second = _sides(seen, lamps)
            by_case = [separation(lamps[:, case], first, second) for case in range(lamps.shape[1])]
            distances[pair] = np.asarray(np.min(by_case, axis=0), dtype=float)
        return distances

    def slope(
        self, pair: Pair, subset: Int[IndexArray, " subset"], curves: ChannelCurves, by_u: CurvesGradient
    ) -> PerParameter:
        """Return the sum of the derivatives of the distances of draws with one production error."""
        seen, channels = self._of(pair), list(self._camera.modified)
        modified = self._weights[subset] * curves + self._rest[subset]
        modified_by_u = by_u[:, None] * self._weights[subset]
        whole, whole_by_u = self._drawn[subset], np.zeros((len(by_u), subset.size, *self._camera.qe.shape))
        whole[:, channels], whole_by_u[:, :, channels] = modified, modified_by_u
        white = self._linear.scene.white
        longer = np.stack(
            [relative_slope(self._setup, white, whole[at], whole_by_u[:, at]) for at in range(subset.size)], axis=1
        )
        relative = self._relative_exposure(modified, subset)[:, None, None, None]
        lamps = seen.of(modified, subset) * relative
        slopes = seen.slopes(modified_by_u, subset) * relative + longer[:, :, None, None, None] * lamps
        first, second = _sides(seen, lamps)
        apart = lamps[:, :, first, None] - lamps[:, :, None, second]
        nearest = (apart**2).sum(axis=-1).reshape(subset.size, -1).argmin(axis=1)
        case, a, b = np.unravel_index(nearest, apart.shape[1:4])
        at = np.arange(subset.size)
        return lengths_slope(apart[at, case, a, b], slopes[:, at, case, first[a]] - slopes[:, at, case, second[b]])

    def _relative_exposure(self, modified: DesignCurves, subset: IndexArray | slice = slice(None)) -> PerSample:
        """Return the exposure time of each draw over that of the curves as they are stated."""
        white, whole = self._linear.scene.white, self._white[subset].copy()
        whole[:, list(self._camera.modified)] = modified @ white
        stated = exposure_times(self._setup, (self._camera.qe @ white)[None])[0]
        return np.asarray(exposure_times(self._setup, whole) / stated, dtype=float)

    @cached_property
    def _white(self) -> Float[Array, "draws channels"]:
        """Electrons/s of the channels of each draw on the white patch, without filters."""
        return np.asarray(self._drawn @ self._linear.scene.white)

    def _lamps(self, pair: Pair) -> Draws:
        """Return the two random lamps of each draw."""
        assert self._population is not None
        return draws_of(self._population.members, pair, self._tolerance, self._seed, self.size)

    def _of(self, pair: Pair) -> _Seen:
        if pair not in self._seen:
            self._seen[pair] = self._made(pair)
        return self._seen[pair]

    def _made(self, pair: Pair) -> _Seen:
        """Return what the draws see of two types: all lights, or two random lamps each."""
        types = [self._setup.members[name] for name in pair]
        if self._population is None:
            starts, n_first = self._starts, types[0].size
        else:
            draws, n_first = self._lamps(pair), 1
            starts = draws.starts
        fixed, of_modified = None, {}
        for channel in range(len(self._camera.qe)):
            per_qe = self._linear.per_qe(channel, self._camera.qe)  # [cases, lights, elements, wavelengths]
            lit = np.flatnonzero(per_qe.any(axis=(0, 1, 3)))
            n_elements, per_qe = per_qe.shape[2], per_qe[:, :, lit]
            if self._population is None:
                lamps = per_qe[None, :, np.concatenate(types)]
            else:
                flat = draws.lamps(slice(None), per_qe.reshape(*per_qe.shape[:2], -1))
                lamps = flat.reshape(self.size, 1, 2, *per_qe.shape[2:])
            if fixed is None:
                fixed = np.zeros((self.size, *lamps.shape[1:3], n_elements))
            if channel in self._camera.modified:
                of_modified[channel] = lit, lamps
            else:
                fixed[..., lit] += _seen(self._drawn[:, channel], lamps)
        assert fixed is not None
        return _Seen(starts, n_first, fixed, tuple(of_modified[channel] for channel in self._camera.modified))


def _sides(seen: _Seen, lamps: FloatArray) -> tuple[IndexArray, IndexArray]:
    """Return the numbers of the lamps of both types."""
    return np.arange(seen.n_first), np.arange(seen.n_first, lamps.shape[2])


def fresh_samples(setup: Setup, tolerance: Tolerance, seed: int) -> Iterator[Sample]:
    """Yield other random cameras and lamps, that no design was chosen by, in parts."""
    if setup.draws_sensors:
        yield from (RandomSensors(setup, tolerance, (seed, _JUDGED, part)) for part in range(_MORE))
    else:
        yield LampsAndCameras(population_model(setup), tolerance, (seed, _JUDGED))


def searched_sample(setup: Setup, tolerance: Tolerance, seed: int) -> Sample:
    """Return the random cameras and lamps that a column and a search look at."""
    if setup.draws_sensors:
        return RandomSensors(setup, tolerance, (seed, _SEARCHED))
    return LampsAndCameras(population_model(setup), tolerance, (seed, _SEARCHED), setup.wanted_yield)
