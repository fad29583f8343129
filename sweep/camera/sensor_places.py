"""The smallest color separation distances over all real places of the sensor, from its middle to its corner.

A few image heights are looked at, and what is between them is divided. Between two heights the difference of two
signals' responses lies within a proven radius of its chord (`bent_chords`, and cos^4 beside it), so that its length is
at least the distance of that chord from nothing, less the radius. What may hold a distance that is smaller by more than
is asked than the smallest one found is divided further. The readout is taken as straight.
"""

from __future__ import annotations

import hashlib
import math
import pickle
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..base.cache import Cache
from ..base.types import FloatArray, IndexArray
from ..curves.lights import Pair, class_pairs
from .bent_chords import EdgeOfCone, Steepest, edge_of_cone
from .effects.illumination import Options
from .field import scene_at
from .linear import smooth_imager
from .methods import REFERENCE
from .seen import SeenFilters, cone_of, known_at
from .view import View

_MOST_PARTS = 4000
"""Parts of the sensor for one pair of types of one design, after which the search gives up."""
_OWN_DN = 1e-6
"""What a search leaves of its tolerance for rounding."""
_Part = tuple[float, float]
"""Two image heights."""


@dataclass(frozen=True)
class WorstHeight:
    """The smallest distance of two types over all places, DN, and the relative image height where it was found."""

    distance_dn: float
    height: float


class _Geometry:
    """What designs of one scene share: what rays see at each height, and how cones turn in each part, kept."""

    def __init__(self, view: View) -> None:
        straight = replace(REFERENCE, saturation="skip", quantization="skip", noise="skip")
        field = view.scenario.field
        assert field is not None
        middle = replace(view, scenario=scene_at(view.scenario, 0.0), methods=straight)
        self.view, self.imager = view, smooth_imager(middle)
        self.starts = sorted({*field.seen_heights, *field.knots[0]})
        self.corner = math.tan(math.radians(Options.of(view.scenario).off_axis_deg))
        n = len(view.mosaic.channels)
        self.moving = [c for c in range(n) if math.isfinite(view.effective_index(c))]
        self.known = {c: known_at(view.carrier(c)) for c in self.moving}
        kernel, self._signals = self.imager.electrons.kernel.light[0], self.imager.light.signals
        used = [(unit, c) for unit in range(len(kernel)) for c in range(n) if kernel[unit, c].any()]
        self.weights = [(unit, c, self._signals * kernel[unit, c]) for unit, c in used]
        """Units, the channels that they look through, and electrons/s for each QE there, [n_signals, n_wavelengths]."""
        self.shape = len(self._signals), len(kernel)
        self._seen: dict[float, SeenFilters] = {}
        self._edges: dict[tuple[_Part, int], EdgeOfCone] = {}

    def share(self, height: float) -> float:
        """cos^4 at an image height."""
        return (1 + (height * self.corner) ** 2) ** -2

    def seen(self, height: float, qe: FloatArray) -> FloatArray:
        """The channels as the rays at an image height see them, ndarray[n_channels, n_wavelengths]."""
        if height not in self._seen:
            self._seen[height] = SeenFilters(self._at(height), REFERENCE.angle)
        return self._seen[height].curves(qe, range(len(qe)))

    def _at(self, height: float) -> View:
        return replace(self.view, scenario=scene_at(self.view.scenario, height))

    def edge(self, part: _Part, channel: int) -> EdgeOfCone:
        """What a channel's filter meets at the edge of the cone in a part of the sensor."""
        if (part, channel) not in self._edges:
            wave, index = self.view.grid.nodes_nm, self.view.effective_index(channel)
            start, end = (cone_of(self._at(height).scenario) for height in part)
            self._edges[part, channel] = edge_of_cone(wave, wave[self.known[channel]], index, start, end.chief_rad)
        return self._edges[part, channel]


_geometries: Cache[bytes, _Geometry] = Cache(4)


class SensorPlaces:
    """A scene in which the light may be anywhere on the sensor, ready for designs; `work` counts what is computed."""

    def __init__(self, view: View, within_dn: float, work: Counter[str]) -> None:
        key = hashlib.sha256(pickle.dumps(replace(view, methods=REFERENCE))).digest()
        self._geometry = _geometries.get(key, lambda: _Geometry(view))
        self._view, self._within_dn, self._work = view, within_dn - _OWN_DN, work

    def worst(self, curves: FloatArray, pairs: Sequence[Pair] = ()) -> dict[Pair, WorstHeight | None]:
        """Of each pair of types (all, if none are named), for one design; None where too many parts would be needed.

        `curves`: QE of the modified channels, ndarray[n_modified, n_wavelengths].
        """
        design = _Design(self._geometry, curves, self._work)
        return {pair: self._worst(design, pair) for pair in pairs or class_pairs(self._view.lights.classes)}

    def _worst(self, design: _Design, pair: Pair) -> WorstHeight | None:
        heights = self._geometry.starts
        parts, counted, best = list(pairwise(heights)), 0, WorstHeight(math.inf, math.nan)
        one, other = (index.ravel() for index in np.meshgrid(*(self._view.members[name] for name in pair)))
        while parts and counted < _MOST_PARTS:
            counted += len(parts)
            ends = [np.stack([design.apart(part[end], one, other) for part in parts]) for end in (0, 1)]
            for end, apart in enumerate(ends):
                found = np.sqrt((apart**2).sum(axis=2)).min(axis=1)
                if found.min() < best.distance_dn:
                    best = WorstHeight(float(found.min()), parts[int(found.argmin())][end])
            radius = np.stack([design.radius(part, one, other) for part in parts])
            least = (_from_chord(*ends) - radius).min(axis=1)
            undecided = np.flatnonzero(least < best.distance_dn - self._within_dn)
            parts = [half for at in undecided for half in _halves(parts[at])]
        return None if parts else best


def _halves(part: _Part) -> tuple[_Part, _Part]:
    middle = (part[0] + part[1]) / 2
    return (part[0], middle), (middle, part[1])


def _from_chord(first: FloatArray, second: FloatArray) -> FloatArray:
    """The distance of nothing from the chord between two points; ndarray[..., n_units] each."""
    along = second - first
    length = (along**2).sum(axis=-1)
    share = np.divide(-(first * along).sum(axis=-1), length, out=np.zeros_like(length), where=length > 0)
    nearest = first + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.asarray(np.sqrt((nearest**2).sum(axis=-1)))


class _Design:
    """Responses of one design at the heights that were looked at, DN, and how far they bend in between."""

    def __init__(self, geometry: _Geometry, curves: FloatArray, work: Counter[str]) -> None:
        self._geometry, self._work, view = geometry, work, geometry.view
        self._qe = view.qe.copy()
        self._qe[list(view.modified)] = curves
        exposure_s = geometry.imager.light.exposure_s(curves[None])
        # Two signals are nearest in the darkest moment of a pulse.
        scale = geometry.imager.light.scales(exposure_s).min() * exposure_s[0] * view.pixel.dn_per_e
        self._weights = [(unit, channel, weights * scale) for unit, channel, weights in geometry.weights]
        self._wave = view.grid.nodes_nm
        self._bases = {channel: view.carrier(channel) for channel in geometry.moving}
        self._steep: dict[int, tuple[Steepest, float, float]] = {}
        for channel, base in self._bases.items():
            known = geometry.known[channel]
            transmission = self._qe[channel, known] / base[known]
            half_range, most = float(np.ptp(transmission)) / 2, float(np.abs(transmission).max())
            self._steep[channel] = Steepest(self._wave[known], transmission), half_range, most
        self._seen: dict[float, FloatArray] = {}
        self._responses: dict[float, FloatArray] = {}
        self._radii: dict[_Part, FloatArray] = {}

    def _at(self, height: float) -> FloatArray:
        """What the rays see at a height."""
        if height not in self._seen:
            self._seen[height] = self._geometry.seen(height, self._qe)
            self._work["places of the sensor"] += 1
        return self._seen[height]

    def _summed(self, curves: FloatArray, *, sizes: bool = False) -> FloatArray:
        """DN of each signal behind some curves, ndarray[n_signals, n_units]; `sizes`: of what has no sign."""
        found = np.zeros(self._geometry.shape)
        for unit, channel, weights in self._weights:
            found[:, unit] += (np.abs(weights) if sizes else weights) @ curves[channel]
        return found

    def apart(self, height: float, one: IndexArray, other: IndexArray) -> FloatArray:
        """Differences of pairs of signals at a height, DN, ndarray[n_pairs, n_units]."""
        if height not in self._responses:
            self._responses[height] = self._geometry.share(height) * self._summed(self._at(height))
        return self._responses[height][one] - self._responses[height][other]

    def radius(self, part: _Part, one: IndexArray, other: IndexArray) -> FloatArray:
        """How far the difference of each pair may be from its chord in a part, DN, ndarray[n_pairs]."""
        if part not in self._radii:
            self._radii[part] = self._bent(part)
        both = self._radii[part][one] + self._radii[part][other]
        return np.asarray(np.sqrt((both**2).sum(axis=1)))

    def _bent(self, part: _Part) -> FloatArray:
        """Of each signal alone, ndarray[n_signals, n_units].

        Of a product of cos^4 and what a channel sees, by how much each bends and by how much both change.
        """
        geometry, (start, end) = self._geometry, part
        first, last = geometry.share(start), geometry.share(end)
        dimmed = (end - start) ** 2 * geometry.corner**2 / 2  # the second derivative of cos^4 is 4 tan^2 at most
        curves = dimmed * np.abs(self._qe)
        for channel, base in self._bases.items():
            steepest, half_range, most = self._steep[channel]
            bent = geometry.edge(part, channel).off_chord(self._wave, steepest, half_range) * base
            changed = np.abs(self._at(end)[channel] - self._at(start)[channel])
            curves[channel] = max(first, last) * bent + abs(last - first) / 4 * changed + dimmed * most * base
        return self._summed(curves, sizes=True)
