"""Smooth rows of a design: quantities with exact derivatives, for the search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..base.types import (
    Array,
    DesignCases,
    DesignCurves,
    Float,
    FloatArray,
    IndexArray,
    Int,
    PerChannel,
    PerDesign,
    PerFree,
    PerParameter,
)
from ..camera.brightness import LampSlopes
from ..camera.linear import LinearModel, linear_model
from ..camera.noise.law import STEPS_DN2
from ..camera.setup import Setup
from ..designs.family import Family
from ..spectra.lights import Pair
from .brightness import BrightnessCurves
from .complex_step import COMPLEX_STEP, Smooth, moving, root, tail_decades
from .separation import pixel_roots, separation

if TYPE_CHECKING:
    from .drawn import Sample
    from .members import PopulationModel

Made = TypeVar("Made")
_SMALLEST = 1e-300
"""No logarithm is taken of less."""


@dataclass(frozen=True)
class Rows:
    """Smooth functions at a point with their derivatives."""

    values: Float[Array, "*terms"]
    by_u: Float[Array, "*terms free"]

    @classmethod
    def of(cls, function: Callable[..., Smooth], *arguments: tuple[FloatArray, FloatArray]) -> Rows:
        """Return the rows of a smooth function of arrays with their derivatives by the free parameters, these first."""
        values = function(*(values for values, _ in arguments))
        along = function(*(moving(values, slopes) for values, slopes in arguments))
        return cls(values.ravel(), along.imag.reshape(len(along), values.size).T / COMPLEX_STEP)

    def scaled(self, factor: float, offset: float = 0.0) -> Rows:
        """Return factor times rows plus offset."""
        return Rows(factor * self.values + offset, factor * self.by_u)

    def squares(self) -> Rows:
        """Return the squares."""
        return Rows(self.values**2, 2 * self.values[:, None] * self.by_u)

    def roots(self) -> Rows:
        """Return the roots, with zero slope where they are 0."""
        values = np.sqrt(np.maximum(self.values, 0.0))
        per = np.divide(0.5, values, out=np.zeros_like(values), where=values > 0)
        return Rows(values, per[:, None] * self.by_u)

    def logarithms(self) -> Rows:
        """Return -log10 of the rows, with zero slope where they are 0 or less."""
        values = np.maximum(self.values, _SMALLEST)
        per = np.where(self.values > _SMALLEST, -1 / (np.log(10) * values), 0.0)
        return Rows(-np.log10(values), per[:, None] * self.by_u)

    @staticmethod
    def joined(parts: list[Rows]) -> Rows:
        """Concatenate rows."""
        return Rows(np.concatenate([p.values for p in parts]), np.concatenate([p.by_u for p in parts]))

    @property
    def finite(self) -> bool:
        """True if all values and derivatives are finite."""
        return bool(np.isfinite(self.values).all() and np.isfinite(self.by_u).all())

    def gaussian_decades(self) -> Rows:
        """Return -log10 of the errors Q(d / 2) of Gaussians at squared distances d^2 in units of their noise."""
        return Rows.of(lambda squared: tail_decades(root(squared) / 2), (self.values, self.by_u.T))

    def without_nan(self) -> Rows:
        """Return the rows with zeros for NaN and infinity."""
        return Rows(*(np.nan_to_num(v, posinf=0, neginf=0) for v in (self.values, self.by_u)))


class SmoothDesign:
    """One design of a family in a linear scene, with derivatives by the free parameters of a box."""

    def __init__(
        self,
        model: LinearModel,
        family: Family,
        x: PerParameter,
        free: Int[IndexArray, " free"],
        span: PerFree,
        members: PopulationModel | None = None,
        drawn: Sample | None = None,
    ) -> None:
        """Compute curves and derivatives."""
        self.setup: Setup = model.setup
        self._members, self._drawn = members, drawn
        self.family, self.x = family, x
        self.curves = family.curves(x[None])[0]
        self.by_u = family.gradient(x)[free] * span[:, None, None]
        self._model, self._free, self._span = model, free, span
        self._made: dict[str, Any] = {}

    def cached(self, key: str, make: Callable[[], Made]) -> Made:
        """Return a value that several quantities share, computed at its first use."""
        if key not in self._made:
            self._made[key] = make()
        value: Made = self._made[key]
        return value

    @cached_property
    def _response(self) -> tuple[Float[Array, "cases signals channels"], Float[Array, "free cases signals channels"]]:
        return self._model.smooth_with_gradient(self.curves, self.by_u)

    @property
    def response(self) -> Float[Array, "cases signals channels"]:
        """Unclipped, unrounded response, DN."""
        return self._response[0]

    @property
    def response_by_u(self) -> Float[Array, "free cases signals channels"]:
        """Derivative of the response."""
        return self._response[1]

    @cached_property
    def lamps(self) -> tuple[Float[Array, "cases signals channels"], Float[Array, "free cases signals channels"]]:
        """Response to the lamps alone and its derivative, DN, in the shapes of `response` and `response_by_u`."""
        return self._model.smooth_with_gradient(self.curves, self.by_u, lamps_only=True)

    @cached_property
    def noisy(
        self,
    ) -> tuple[
        Float[Array, "cases signals channels"],
        Float[Array, "cases signals channels"],
        Float[Array, "free cases signals channels"],
        Float[Array, "free cases signals channels"],
    ]:
        """Mean, DN, and variance, DN^2, under noise, and their derivatives, in the shapes of `response_by_u`.

        The mean is `response`; of an HDR pixel it is that of the merged value, which saturates.
        """
        return self._model.noisy_with_gradient(self.curves, self.by_u)

    @property
    def linear_over_brightness(self) -> bool:
        """True if chromatic distances have their closed form."""
        return self._model.linear_over_brightness

    @cached_property
    def over_brightness(self) -> list[tuple[LampSlopes, BrightnessCurves]]:
        """Readings and brightness curves of the lamps in each case."""
        return self._over_brightness(self._lamp_slopes)

    @cached_property
    def over_brightness_by_pixel(self) -> list[tuple[LampSlopes, BrightnessCurves]]:
        """The same with every pixel counted."""
        return self._over_brightness([replace(of, lamps=of.lamps.times(self.roots)) for of in self._lamp_slopes])

    @cached_property
    def _lamp_slopes(self) -> list[LampSlopes]:
        return [*self._model.lamps_over_brightness(self.curves, self.by_u)]

    def _over_brightness(self, cases: Sequence[LampSlopes]) -> list[tuple[LampSlopes, BrightnessCurves]]:
        limits = self.setup.scene.brightness
        return [(lamps, BrightnessCurves(lamps.lamps, limits, least_dn2=STEPS_DN2)) for lamps in cases]

    @property
    def roots(self) -> PerChannel:
        """Factors of readings in which every pixel counts."""
        return pixel_roots(self.setup.camera.mosaic)

    def linear(self, matrix: Float[Array, "terms parameters"]) -> Rows:
        """Return linear functions of the parameters."""
        return Rows(matrix @ self.x, matrix[:, self._free] * self._span)

    def squared_distances(self, pair: Pair, *, per_pixel: bool = False) -> Rows:
        """Return squared distances of all pairs of signals of two types in every case, DN^2, with derivatives."""
        first, second = (self._model.members[name] for name in pair)
        roots = self.roots if per_pixel else 1.0

        def of(response: Smooth) -> Smooth:
            response = response * roots
            return np.asarray(((response[..., first, None, :] - response[..., None, second, :]) ** 2).sum(axis=-1))

        return Rows.of(of, self._response)

    def squared_distances_of_members(self, pair: Pair) -> Rows:
        """Return squared distances of the nearest members of each two lights, by case and part of their shifts, DN^2.

        Nearest members change with the design; where they do not jump, that adds nothing to the derivative.
        """
        assert self._members is not None
        response, by_u = self._response_of_members
        values, slopes = [], []
        for case in range(len(response)):
            known = bool(np.isfinite(response[case]).all())
            base = response[case] if known else np.zeros_like(response[case])
            near = self._members.nearest(base, pair, parts=self._members.parts)
            differences = near.of(response[case], 0) - near.of(response[case], 1)
            slope = near.of(by_u[:, case], 0) - near.of(by_u[:, case], 1)
            is_finite = np.isfinite(near.squared)
            values.append(near.squared[is_finite] if known else np.full(int(is_finite.sum()), np.nan))
            slopes.append(2 * (slope * differences).sum(axis=-1)[:, is_finite])
        return Rows(np.concatenate(values), np.concatenate(slopes, axis=1).T)

    def distance_of_a_share(self, pair: Pair) -> Rows:
        """Return the distance that the wanted share of random lamps and cameras has, DN, as one row."""
        assert self._drawn is not None
        value, slope = self._drawn.share_and_slope(pair, self.family, self.x, self._free, self._span)
        return Rows(np.array([value]), slope[None])

    @cached_property
    def _response_of_members(
        self,
    ) -> tuple[Float[Array, "cases signals channels"], Float[Array, "free cases signals channels"]]:
        assert self._members is not None
        model = self._members.linear
        return model.smooth_with_gradient(self.curves, self.by_u)


def smooth_response(setup: Setup, curves: DesignCurves) -> DesignCases:
    """Return the unquantized, unclipped response, DN."""
    return linear_model(setup).smooth(curves)


def smooth_csd(setup: Setup, curves: DesignCurves, pair: Pair, factors: PerChannel | float = 1.0) -> PerDesign:
    """Return the CSD of the smooth response, the smallest over the cases, DN.

    `factors`: of the channels' readings.
    """
    response = smooth_response(setup, curves) * factors
    first, second = (setup.members[name] for name in pair)
    over = [separation(response[:, case], first, second) for case in range(response.shape[1])]
    return np.asarray(np.min(over, axis=0), dtype=float)
