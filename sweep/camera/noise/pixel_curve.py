"""What a pixel reads over its expected electrons: mean and variance with slopes, and where it bends.

Electrons are those of a pixel of full sensitivity; the captures of an HDR pixel have a fixed share of them each.
Without noise the reading is that before rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ...base.types import Array, Float, IndexArray, Int, SameShape
from ..pixel import Pixel, unquantized
from ..setup import Setup
from . import merge, moments, table
from .merged_readings import ROOT_STEP, nodes_of

_EQUAL, _NONE = 1e-9, 1e-12
"""Relative difference of electrons that are the same, and electrons that are none."""
STEPS_DN2 = 1 / 12
"""Least variance that a search takes, DN^2, as of rounding: a saturated pixel has none, and no direction to go."""


@dataclass(frozen=True)
class PixelCurve:
    """A pixel, `light` of its exposures relative to full sensitivity (1 if it is read once), with noise or without."""

    pixel: Pixel
    light: tuple[float, ...]
    noisy: bool

    @cached_property
    def knees_e(self) -> Float[Array, " knees"]:
        """Electrons at which a capture hands over to the next, and from which on the last one is full."""
        pixel = self.pixel
        if not pixel.captures:
            return np.array([pixel.saturation_e])
        ends = [
            (capture.saturation_e if limit is None else (limit - capture.offset_dn) / capture.dn_per_e)
            / self.light[exposure]
            for exposure, capture, limit in zip(
                merge.exposure_of(pixel), pixel.read_as, merge.limits_dn(pixel), strict=True
            )
        ]
        return np.array(ends)

    @cached_property
    def knee_widths(self) -> Float[Array, " knees"]:
        """Noise at each knee relative to its electrons; 0 without noise."""
        if not self.noisy:
            return np.zeros(self.knees_e.size)
        pixel = self.pixel
        shares = [self.light[at] for at in merge.exposure_of(pixel)] if pixel.captures else [1.0]
        counts = self.knees_e * shares
        read_e = np.array([capture.read_noise_e for capture in pixel.read_as or (pixel,)])
        return np.asarray(np.sqrt(counts + read_e**2) / np.maximum(counts, 1e-9) + pixel.prnu, dtype=float)

    def mean(self, electrons: SameShape) -> SameShape:
        """Return the mean, DN."""
        return self.table.look_up(electrons, 0) if self.noisy else self._noiseless(electrons)

    def moments(self, electrons: SameShape) -> tuple[SameShape, SameShape]:
        """Return mean, DN, and variance, DN^2."""
        spread = self.table.look_up(electrons, 1) if self.noisy else np.zeros(electrons.shape)
        return self.mean(electrons), np.maximum(spread, 0.0)

    def _noiseless(self, electrons: SameShape) -> SameShape:
        pixel = self.pixel
        if not pixel.captures:
            return unquantized(np.minimum(electrons, pixel.saturation_e), pixel)
        light = np.reshape(self.light, (-1, *(1,) * electrons.ndim))
        return merge.without_noise(electrons * light, light, pixel, rounds=False)

    @property
    def table(self) -> table.MomentTable:
        """Mean and variance of a noisy pixel over its electrons."""
        return _merged(self.pixel, self.light) if self.pixel.captures else _read_once(self.pixel)


@lru_cache(maxsize=16)
def _merged(pixel: Pixel, light: tuple[float, ...]) -> table.MomentTable:
    """Tabulate mean and variance of merged values."""
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)

    of_exposure = np.array(light)
    roots_e, is_node = nodes_of(pixel, of_exposure)
    nodes_e = roots_e[is_node]
    at_nodes = merge.merged(nodes_e * of_exposure[:, None], of_exposure[:, None], pixel)
    spline = CubicSpline(np.sqrt(nodes_e), np.stack([at_nodes.mean, at_nodes.variance]), axis=1)
    return table.MomentTable.of(spline, float(nodes_e[-1]), ROOT_STEP)


@lru_cache(maxsize=16)
def _read_once(pixel: Pixel) -> table.MomentTable:
    """Take mean and variance of the digital number from the table of a pixel that is read once."""
    moment_table = table.tables(pixel)
    return moment_table._replace(
        coefficients=np.ascontiguousarray(moment_table.coefficients[[moments.ROUNDED, moments.VARIANCE]])
    )


@lru_cache(maxsize=64)
def pixel_curve(pixel: Pixel, light: tuple[float, ...], *, noisy: bool) -> PixelCurve:
    """Return the curve of a pixel; cached with its tables."""
    return PixelCurve(pixel, light, noisy)


def same_electrons(
    first: Float[Array, "*batch pixels"],
    second: Float[Array, "*batch pixels"],
    share: float | Float[Array, " pixels"] = 1.0,
) -> bool:
    """Return whether electrons are the same but for rounding; `share`: of the second ones that the first have."""
    from .kernels import all_near  # noqa: PLC0415  (compiled: kept off the start-up path)

    one, other = (np.ascontiguousarray(electrons).reshape(-1, first.shape[-1]) for electrons in (first, second))
    return bool(all_near(one, other, np.broadcast_to(share, first.shape[-1]), _EQUAL, _NONE))


def groups_of(light: Float[Array, "captures pixels"]) -> list[tuple[tuple[float, ...], Int[IndexArray, " _pixels"]]]:
    """Return the distinct columns of the light of exposures, and the elements of each."""
    if (light == light[:, :1]).all():
        return [(tuple(light[:, 0]), np.arange(light.shape[1]))]
    columns, which = np.unique(light, axis=1, return_inverse=True)
    return [(tuple(column), np.flatnonzero(which.ravel() == at)) for at, column in enumerate(columns.T)]


def is_noisy(setup: Setup) -> bool:
    """Return whether readings are means under noise."""
    return setup.scene.noise is not None and setup.computes("noise")
