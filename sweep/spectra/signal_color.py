"""Color of a light, and its traffic signal: chromaticity, dominant wavelength, regions of EN 12368."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..base.types import Array, Float, FloatArray
from .color import MARKER_REGIONS, REGIONS, VISIBLE_NM, chromaticity
from .spectrum import WavelengthGrid

VISIBLE = WavelengthGrid(start_nm=VISIBLE_NM[0], stop_nm=VISIBLE_NM[1], step_nm=1.0)
"""Range of the CIE 1931 color-matching functions."""
EQUAL_ENERGY = (1 / 3, 1 / 3)
"""White that dominant wavelength and purity are counted from: CIE illuminant E."""
NEAR_NM = 30.0
"""A light outside every region is taken for a signal color up to this difference of dominant wavelengths."""
_NO_HUE = 1e-3
"""Excitation purity of a color without a dominant wavelength."""
LEAST_PURITY = 0.5
"""Below this excitation purity a light is whitish, and its dominant wavelength says little."""


@dataclass(frozen=True)
class LightColor:
    """Color of one light.

    `xy`: CIE 1931, 2 degree observer; `dominant_nm`: dominant wavelength, nm; None for white and purple; `purity`:
    excitation purity, 1 on the spectral locus; `distance`: distance to it in x, y (0 inside); `markers`: other lamps
    that may have this color.
    """

    xy: tuple[float, float]
    dominant_nm: float | None
    purity: float
    region: str | None
    nearest: str
    distance: float
    markers: tuple[str, ...] = ()

    @property
    def signal(self) -> str | None:
        """Signal type of the light: its region, else the nearest by dominant wavelength within NEAR_NM."""
        if self.region is not None or self.dominant_nm is None or self.purity < LEAST_PURITY:
            return self.region
        gap, kind = min(
            (max(low - self.dominant_nm, self.dominant_nm - high, 0.0), kind)
            for kind, (low, high) in dominant_ranges_nm().items()
        )
        return kind if gap <= NEAR_NM else None


def light_color(photons: Float[Array, " 471"]) -> LightColor | None:
    """Return the color of a photon spectrum.

    None without visible light.
    """
    peak = float(photons.max())
    if not peak > 0:
        return None
    with np.errstate(invalid="ignore", divide="ignore"):
        xy = chromaticity(VISIBLE, photons[None] / peak)
        if not np.isfinite(xy).all():
            return None
        purity, dominant_nm = _hue(xy[0])
    inside = [kind for kind, region in REGIONS.items() if region.violation(xy)[0] <= 0]
    distance, nearest = min((_distance(xy[0], outline(kind)), kind) for kind in REGIONS)
    return LightColor(
        xy=(float(xy[0, 0]), float(xy[0, 1])),
        dominant_nm=dominant_nm if purity > _NO_HUE else None,
        purity=purity,
        region=inside[0] if inside else None,
        nearest=inside[0] if inside else nearest,
        distance=0.0 if inside else distance,
        markers=tuple(name for name, region in MARKER_REGIONS.items() if region.violation(xy)[0] <= 0),
    )


def _hue(xy: Float[Array, " 2"]) -> tuple[float, float | None]:
    """Return excitation purity and dominant wavelength, to a nm, of a chromaticity (CIE 15, 9).

    Both are of the point where the line from white through it leaves the spectral locus; on the line of purples there
    is no such wavelength.
    """
    white, locus = np.array(EQUAL_ENERGY), spectral_locus()
    (dx, dy), (ax, ay) = xy - white, (locus - white).T
    sx, sy = (np.roll(locus, -1, axis=0) - locus).T  # the last side is the line of purples
    across = dx * sy - dy * sx
    with np.errstate(divide="ignore", invalid="ignore"):  # white itself, and sides along the line, have no crossing
        along, share = (ax * sy - ay * sx) / across, (ax * dy - ay * dx) / across
    hits = np.flatnonzero((along > 0) & (share >= 0) & (share <= 1))
    if not hits.size:
        return 0.0, None
    side = int(hits[np.argmin(along[hits])])
    leaves = white + along[side] * (xy - white)
    nearest = int(np.hypot(*(locus - leaves).T).argmin())
    return 1 / float(along[side]), None if side == len(locus) - 1 else float(VISIBLE.nodes_nm[nearest])


@cache
def spectral_locus() -> Float[Array, "471 2"]:
    """Return the chromaticities of monochromatic light on VISIBLE."""
    return chromaticity(VISIBLE, np.eye(VISIBLE.size))


@cache
def outline(kind: str) -> Float[Array, "corners 2"]:
    """Return the part of a color region that light can have, as a polygon.

    The spectral locus is cut at each bound (Sutherland and Hodgman, "Reentrant polygon clipping").
    """
    polygon = spectral_locus()
    for a, b, c in REGIONS[kind].bounds:
        over = polygon @ np.array([a, b]) - c
        corners: list[FloatArray] = []
        for here, there, u, v in zip(polygon, np.roll(polygon, -1, axis=0), over, np.roll(over, -1), strict=True):
            if u <= 0:
                corners.append(here)
            if (u <= 0) != (v <= 0):
                corners.append(here + (there - here) * (u / (u - v)))
        polygon = np.array(corners)
    return polygon


@cache
def dominant_ranges_nm() -> dict[str, tuple[float, float]]:
    """Return the dominant wavelengths of each region; red is open."""
    spans = {}
    for kind, region in REGIONS.items():
        inside = VISIBLE.nodes_nm[region.violation(spectral_locus()) <= 0]
        spans[kind] = (float(inside.min()), float(VISIBLE.stop_nm if kind == "red" else inside.max()))
    return spans


def _distance(xy: Float[Array, " 2"], polygon: Float[Array, "corners 2"]) -> float:
    """Return the distance from a point to a polygon's outline."""
    along = np.roll(polygon, -1, axis=0) - polygon
    length = (along**2).sum(axis=1)
    share = np.divide(((xy - polygon) * along).sum(axis=1), length, out=np.zeros_like(length), where=length > 0)
    foot = polygon + along * np.clip(share, 0, 1)[:, None]
    return float(np.sqrt(((xy - foot) ** 2).sum(axis=1)).min())
