"""How much a change of a linear effect can change a CSD, for every design of a box: a proven upper bound.

A CSD is the smallest of the distances of all pairs, so it changes by no more than the distance of a pair that can be
the smallest, before or after; and a distance changes by no more than the norm of the change of its difference vector.
That is linear in QE and kernel, and both are known up to an interval. Behind a readout that is not straight it is not:
there, a distance changes by at most what both of its points move (`pixelwise`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.types import FloatArray, IndexArray
from ...curves.hats import hats
from ...curves.lights import class_pairs
from ..effects import blur, flicker
from ..exposure import exposure_times, white_irradiance
from ..seen import METHODS, SeenFilters
from ..view import View, background_irradiance, per_photon, signal_irradiance
from .moves import largest_change, longest_moves
from .work import DesignCount


@dataclass(frozen=True)
class Box:
    """Designs of a scene: every channel's QE lies between `low` and `high`, ndarray[n_channels, n_wavelengths]."""

    view: View
    low: FloatArray
    high: FloatArray
    designs: DesignCount


@dataclass(frozen=True)
class Amounts:
    """Sums of signals times QE on hats between the knots, DN: middle value, half width, and the largest possible.

    `middle`: ndarray[n_signals, n_channels, n_knots], `half`: ndarray[n_pairs, n_channels, n_knots] (of a pair's
    difference), `half_each`: the same of each signal, `largest`: the most that a pair's difference can be on each hat,
    shaped like `half`; `most`, `most_each`: the same on all hats, ndarray[n_pairs or n_signals, n_channels].
    """

    middle: FloatArray
    half: FloatArray
    half_each: FloatArray
    largest: FloatArray
    most: FloatArray
    most_each: FloatArray


_AT_ONCE, _FEW_PAIRS = 4_000_000, 64
"""Values of pairs' differences that are bounded at once, and pairs whose lights stay in the processor's cache."""


@dataclass(frozen=True)
class Spread:
    """What the places in cells may see besides what their corners see.

    `corners`: the cases at the corners of each cell, ndarray[n_cells, n_corners]. `change`, `left`: ndarray[n_cells,
    n_values, n_channels], by how much the change of the kernel, and the kernel after it, may differ from a mean of
    those at the corners. `after`: ndarray[n_cells, n_values, n_channels, n_knots], how far the corners' kernels after
    the change are from each other.
    """

    corners: IndexArray
    change: FloatArray
    left: FloatArray
    after: FloatArray

    def some(self, cells: slice) -> tuple[Spread, IndexArray]:
        """Some cells, and the cases at their corners, which are numbered anew."""
        cases, corners = np.unique(self.corners[cells], return_inverse=True)
        numbered = corners.reshape(self.corners[cells].shape)
        return Spread(numbered, self.change[cells], self.left[cells], self.after[cells]), cases


class Reach:
    """The responses that the designs of a box can have, on the knots at which kernels are compared.

    `signals_dn`: DN for each QE of the signals at every wavelength, ndarray[n_signals, n_wavelengths]; `hats`: what
    of a wavelength counts at each knot, ndarray[n_knots, n_wavelengths].
    """

    def __init__(self, box: Box) -> None:
        view = box.view
        self.box = box
        wave = view.grid.nodes_nm
        self.knots_nm = blur.knots(wave, blur.COARSE)
        self.hats = hats(wave, self.knots_nm)
        self.shortest_s, self.longest_s = self._exposures()
        drive = view.scenario.drive
        self.least_light = 1.0 if drive is None else flicker.smallest(drive, self.shortest_s, self.longest_s)
        self.most_light = 1.0 if drive is None else flicker.largest(drive, self.shortest_s, self.longest_s)
        dn = per_photon(view) * self.longest_s * self.most_light * view.pixel.dn_per_e
        self.signals_dn = signal_irradiance(view) * dn
        self.first, self.second, self._ends = _pairs(view.members)
        self._seen: dict[str, SeenFilters] = {}

    def _exposures(self) -> tuple[float, float]:
        view = self.box.view
        modified = list(view.modified)
        white = white_irradiance(view) * per_photon(view)
        ends = [exposure_times(view, (qe[modified] @ white)[None])[0] for qe in (self.box.high, self.box.low)]
        return float(ends[0]), float(ends[1])

    @property
    def qe_low(self) -> FloatArray:
        """No channel of any design is below this, ndarray[n_channels, n_wavelengths]."""
        return self.box.low

    @property
    def qe_high(self) -> FloatArray:
        """No channel of any design is above this, ndarray[n_channels, n_wavelengths]."""
        return self.box.high

    def seen(self, method: str) -> tuple[FloatArray, FloatArray]:
        """`as_seen` of the box."""
        return self.as_seen(method, self.box.low, self.box.high)

    def as_seen(self, method: str, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Between which curves the rays see, by a method of `angle`, what lies between two.

        ndarray[n_channels, n_wavelengths] each: what the rays see is a sum of the curve's values, none of which counts
        less than 0 times.
        """
        if method not in self._seen:
            self._seen[method] = SeenFilters(self.box.view, method)
        seen, every = self._seen[method], range(len(low))
        return seen.curves(low, every), seen.curves(high, every)

    @cached_property
    def _highest(self) -> FloatArray:
        """No channel of any design is above this by any method, ndarray[n_channels, n_wavelengths]."""
        return np.asarray(np.max([self.seen(method)[1] for method in METHODS], axis=0), dtype=float)

    @cached_property
    def brightest_dn(self) -> FloatArray:
        """Largest response of each channel to any signal whose image is whole, DN, ndarray[n_channels]."""
        return np.asarray((self.signals_dn @ self._highest.T).max(axis=0), dtype=float)

    @cached_property
    def brightest_pixels_dn(self) -> FloatArray:
        """The same with background, dark current and the filters of the neighbors, DN, ndarray[n_channels]."""
        view = self.box.view
        pixel, dn = view.pixel, per_photon(view) * self.longest_s * view.pixel.dn_per_e
        background_dn = self._highest @ background_irradiance(view) * dn
        found = self.brightest_dn + (pixel.dark_e_per_s * self.longest_s * pixel.dn_per_e + background_dn)
        return np.full(found.size, found.max()) if pixel.crosstalk else np.asarray(found, dtype=float)

    def background(self, factor: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Response of each channel to the background behind a factor, ndarray[n_wavelengths], that may be negative.

        For curves between `low` and `high`, ndarray[n_channels, n_wavelengths]. DN: middle value and half width,
        ndarray[n_channels] each.
        """
        irradiance = background_irradiance(self.box.view) * factor
        dn = per_photon(self.box.view) * self.longest_s * self.box.view.pixel.dn_per_e
        ends = [qe @ irradiance * dn for qe in (low, high)]
        sizes = [qe @ np.abs(irradiance) * dn for qe in (low, high)]
        return np.asarray((ends[0] + ends[1]) / 2), np.asarray((sizes[1] - sizes[0]) / 2)

    def span_dn(self, *, rounds: bool) -> float:
        """Between which two values, so far apart, DN, every channel's value is where the readout clips, or `rounds`."""
        pixel = self.box.view.pixel
        full = float(pixel.full_scale_dn)
        return full if rounds else min(full, pixel.well_e * pixel.dn_per_e)

    def amounts(self, factor: FloatArray, low: FloatArray, high: FloatArray) -> Amounts:
        """Sums for QE between `low` and `high` (ndarray[n_channels, n_wavelengths]) and a factor per wavelength."""
        middle, half = (low + high) / 2, (high - low) / 2
        most = np.maximum(np.abs(low), np.abs(high))
        light = self.signals_dn * factor
        apart = np.abs(light[self.first] - light[self.second])
        centers, halves = self._on_hats(light, middle), self._on_hats(apart, half)
        return Amounts(
            middle=centers,
            half=halves,
            half_each=self._on_hats(np.abs(light), half),
            largest=np.abs(centers[self.first] - centers[self.second]) + halves,
            most=apart @ most.T,
            most_each=np.abs(light) @ most.T,
        )

    def most_apart(self, factor: FloatArray, low: FloatArray, high: FloatArray) -> float:
        """The largest sum over the channels of `Amounts.most` of any pair, DN."""
        light = self.signals_dn * factor * np.maximum(np.abs(low), np.abs(high)).sum(axis=0)
        every = (np.abs(light[one] - light[other]).sum(axis=1) for one, other in self._by_block(_FEW_PAIRS))
        return max((float(each.max()) for each in every), default=0.0)

    def _on_hats(self, light: FloatArray, qe: FloatArray) -> FloatArray:
        """Sums of lights times QE on each hat, ndarray[n_lights, n_channels, n_knots]."""
        found = np.zeros((len(light), len(qe), len(self.hats)))
        used = qe.any(axis=1)
        seen = (qe[used, None] * self.hats).reshape(-1, light.shape[1])
        found[:, used] = (light @ seen.T).reshape(len(light), -1, len(self.hats))
        return found

    def largest_change(
        self,
        changed: Amounts,
        change: FloatArray,
        remainder: float,
        base: Amounts,
        after: FloatArray,
        *,
        every: bool = False,
        between: Spread | None = None,
    ) -> float:
        """Bound on the change of any CSD of a straight readout, DN.

        `change`: ndarray[n_cases, n_values, n_channels, n_knots], of the kernel that multiplies `changed`, exact up to
        `remainder` between the knots. `base`, `after`: the responses and the kernel after the change, which say which
        pairs can be the smallest; `every`: all pairs count. `between`: the cases are corners of cells of places, all
        of which count.
        """
        alone = np.arange(len(change))[:, None] if between is None else between.corners
        step = max(1, _AT_ONCE // max(1, len(self.first) * change.shape[1] * alone.shape[1]))
        worst = 0.0
        for start in range(0, len(alone), step):
            cells = slice(start, start + step)
            part, cases = (None, alone[cells, 0]) if between is None else between.some(cells)
            found = self._largest(changed, change[cases], remainder, base, after[cases], every, part)
            worst = max(worst, found)
        return worst

    def largest_move(self, moved: FloatArray) -> float:
        """Largest change of a distance whose two points move by up to `moved`, ndarray[n_cases, n_signals, n_channels].

        DN. A point's channels move by at most this much, so the difference of two points by at most the sum of both.
        """
        each = np.swapaxes(moved, 0, 1)
        pairs = self._by_block(max(1, _AT_ONCE // max(1, moved[:, 0].size)))
        return max((float(_norms(each[some] + each[to]).max()) for some, to in pairs), default=0.0)

    def _by_block(self, step: int) -> list[tuple[IndexArray, IndexArray]]:
        """Pairs, so many at once."""
        starts = range(0, len(self.first), step)
        return [(self.first[at : at + step], self.second[at : at + step]) for at in starts]

    def _largest(
        self,
        changed: Amounts,
        change: FloatArray,
        remainder: float,
        base: Amounts,
        after: FloatArray,
        every: bool,
        between: Spread | None,
    ) -> float:
        """`largest_change` of some cases.

        Cells whose pairs move most come first: one whose pairs all move less than the largest change so far cannot
        raise it, so that what is left is looked at only in the few before.
        """
        nothing = np.zeros((len(change), change.shape[1], len(self.first)))
        corners, more = np.arange(len(change))[:, None], nothing
        if between is not None:
            corners, more = between.corners, between.change @ changed.most.T
        off = self._in(np.abs(change), changed.half) + remainder * changed.most.sum(axis=1)
        moved = longest_moves((self._in(change, changed.middle), off, more), corners, self.first, self.second)
        most = moved.max(axis=1, initial=0.0)
        worst = float(most.max(initial=0.0))
        if every or worst == 0:
            return worst
        shortened, worst = self.shortest_s / self.longest_s * self.least_light / self.most_light, 0.0
        order, start, size = np.argsort(-most, kind="stable"), 0, 1
        while start < len(order) and most[order[start]] > worst:
            some = order[start : start + size]
            cases, numbered = np.unique(corners[some], return_inverse=True)
            kernel, at = after[cases], numbered.reshape(corners[some].shape)
            off = self._in(np.abs(kernel), base.half) + remainder * base.most.sum(axis=1)
            more = np.zeros((len(some), *off.shape[1:]))
            if between is not None:
                more = self._in(between.after[some], base.largest) + between.left[some] @ base.most.T
            left = (self._in(kernel, base.middle), off, more)
            changes = largest_change(moved[some], left, at, self.first, self.second, self._ends, shortened, worst)
            start, size, worst = start + size, size * 4, changes
        return worst

    @staticmethod
    def _in(kernel: FloatArray, amounts: FloatArray) -> FloatArray:
        """Amounts (ndarray[n, n_channels, n_knots]) behind a kernel (ndarray[n_cases, n_values, ...]); [..., n]."""
        flat = amounts.reshape(len(amounts), -1)
        used = flat.any(axis=0)
        rows = kernel.reshape(-1, flat.shape[1])[:, used]
        return np.asarray(rows @ flat[:, used].T, dtype=float).reshape(*kernel.shape[:2], len(flat))


def _norms(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.einsum("pcv,pcv->pc", vectors, vectors)), dtype=float)


def _pairs(members: dict[str, IndexArray]) -> tuple[IndexArray, IndexArray, IndexArray]:
    """Signals of all pairs of two types: first, second; where the pairs of each two types begin, and the end."""
    grids = [np.meshgrid(members[a], members[b], indexing="ij") for a, b in class_pairs(list(members))]
    first, second = (np.concatenate([np.empty(0, dtype=np.intp), *(g[i].ravel() for g in grids)]) for i in (0, 1))
    return first, second, np.cumsum([0, *(g[0].size for g in grids)])
