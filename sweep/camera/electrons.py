"""Expected electrons of a scene on a sensor, for a batch of designs.

Stages in physical order: light through optics and filters onto the elements of the pixel response, a uniform
background, dark current, the moment of a pulse, the exposure. Nothing is clipped, rounded or noisy yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from functools import cached_property

import numpy as np

from ..base.types import Array, DesignCurves, DesignPixels, Float, FloatArray, IndexArray, Int, PerDesign
from .angular import AngularResponse
from .irradiance import path_factor, scene_irradiance
from .response import PixelResponse, SplitLight
from .setup import Setup


class FieldPosition:
    """Light of a scene behind air and lens, and its filters in the cone of rays, at one field position.

    `signals`: electrons/s of each signal per unit of QE on a whole image. `background`, `fixed_background`: those of
    the background per unit of QE of the modified channels, and in the others.
    """

    def __init__(self, setup: Setup) -> None:
        self.setup, camera = setup, setup.camera
        nodes_nm, irradiance = camera.grid.nodes_nm, scene_irradiance(setup)
        fixed, modified = list(camera.fixed), list(camera.modified)
        self.angular = AngularResponse(setup)
        self.signals = irradiance.signals * camera.area_bins_m2_nm * path_factor(setup, nodes_nm)
        background = irradiance.background * camera.area_bins_m2_nm * path_factor(setup, nodes_nm, background=True)
        self.background = self.angular.light(np.repeat(background[None], len(modified), axis=0), modified)
        self.fixed_background = self.angular.curves(camera.qe[fixed], fixed) @ background


class Electrons:
    """Expected electrons of designs on the elements of a pixel response, at one field position.

    `fixed`: electrons/s of the signals in the channels that no design modifies.
    """

    def __init__(self, position: FieldPosition, response: PixelResponse) -> None:
        self.position, self.response = position, response
        camera = position.setup.camera
        fixed, modified = list(camera.fixed), list(camera.modified)
        self._fixed_uniform = response.uniform[:, :, fixed] @ position.fixed_background
        self._modified_uniform = response.uniform[:, :, modified]
        self.fixed = np.zeros((response.shape[0], len(position.signals), response.shape[1]))
        self._add(camera.qe[None, fixed], fixed, self.fixed[None])

    def subset(self, which: slice | Int[IndexArray, " subset"]) -> Electrons:
        """Return the electrons at some phases."""
        subset = copy(self)
        subset.response, subset.fixed = self.response.subset(which), self.fixed[which]
        subset._fixed_uniform, subset._modified_uniform = self._fixed_uniform[which], self._modified_uniform[which]
        return subset

    def _add(self, qe: DesignCurves, channels: Sequence[int], out: DesignPixels) -> None:
        """Add sums of light times QE times signals over some channels and all wavelengths in place."""
        spectra = self.position.angular.curves(qe, channels)[:, :, None] * self.position.signals
        if isinstance(self.response.source, SplitLight):
            self.response.source.add_sums(spectra, channels, out)
            return
        (cases, n_signals, _), size = out.shape[1:], spectra.shape[-1]
        for at, channel in enumerate(channels):
            seen = np.flatnonzero(self.response.uniform[:, :, channel].any(axis=0))
            light = self.response.light[:, seen, channel]
            weights = np.broadcast_to(light, (cases, seen.size, size)).reshape(-1, size)
            # A product for each design, so that how many there are changes it by no more than rounding.
            products = (spectra[:, at] @ weights.T).reshape(len(qe), n_signals, cases, seen.size)
            out[..., seen] += np.moveaxis(products, 1, 2)

    def rates(self, curves: DesignCurves) -> DesignPixels:
        """Return electrons/s of each signal, without background and dark current."""
        rates = np.repeat(self.fixed[None], len(curves), axis=0)
        if self.position.setup.camera.modified:
            self._add(curves, self.position.setup.camera.modified, rates)
        return rates

    def expected(
        self, curves: DesignCurves, scales: Float[Array, "designs scales"], exposure_s: PerDesign
    ) -> Float[Array, "designs _cases signals pixels"]:
        """Return expected electrons before the full well.

        `scales`: light relative to its mean at each moment of a pulse.
        """
        uniform, rates = self.unlit(curves), self.rates(curves)
        if scales.shape[1] > 1:
            rates = np.repeat(rates, scales.shape[1], axis=1)
            uniform = np.repeat(uniform, scales.shape[1], axis=1)
        # In place: to give memory to an array of all pixels takes as long as a product.
        rates *= np.tile(scales, (1, rates.shape[1] // scales.shape[1]))[:, :, None, None]
        rates += uniform[:, :, None, :]
        rates *= exposure_s[:, None, None, None]
        return rates

    def without_lamps(
        self, curves: DesignCurves, scales: Float[Array, "designs scales"], exposure_s: PerDesign
    ) -> Float[Array, "designs _cases 1 pixels"]:
        """Return what `expected` has without the lamps, in the shape of one signal."""
        electrons = np.repeat(self.unlit(curves), scales.shape[1], axis=1) * exposure_s[:, None, None]
        return np.asarray(electrons[:, :, None], dtype=float)

    def unlit(self, curves: DesignCurves) -> Float[Array, "designs cases pixels"]:
        """Return electrons/s of the elements without the lamps: of the background, and dark current."""
        dark = self._fixed_uniform + self.position.setup.camera.pixel.dark_e_per_s
        return np.asarray(dark + self.of_background(curves), dtype=float)

    def of_background(self, curves: DesignCurves) -> Float[Array, "designs cases pixels"]:
        """Return electrons/s of the background through the modified channels."""
        rates = np.einsum("nml,ml->nm", curves, self.position.background)
        return np.asarray(np.einsum("xum,nm->nxu", self._modified_uniform, rates), dtype=float)

    @cached_property
    def one_element(self) -> int | None:
        """The only element that sees the only modified channel; None if there are more."""
        seen = (self._modified_uniform != 0).any(axis=(0, 2)) if self._modified_uniform.shape[2] == 1 else np.zeros(1)
        return int(seen.argmax()) if self.response.by_channel and seen.sum() == 1 else None

    @cached_property
    def along(self) -> FloatArray:
        """Rates of that element per QE of that channel: of the background, then of each case and signal."""
        channel, unit = self.position.setup.camera.modified[0], self.one_element
        light = self.position.signals * self.response.light[:, unit, channel, None]
        rates = self.position.angular.light(light[..., None, :], [channel])[..., 0, :]
        return np.concatenate([self.position.background, rates.reshape(-1, rates.shape[-1])]).T

    def unlit_along(self, products: Float[Array, "designs columns"]) -> Float[Array, "designs cases"]:
        """Return electrons/s of that element without lamps; `products`: of the designs with `along`."""
        dark = self._fixed_uniform[:, self.one_element] + self.position.setup.camera.pixel.dark_e_per_s
        return np.asarray(products[:, :1] * self._modified_uniform[:, self.one_element, 0] + dark, dtype=float)

    def expected_along(
        self, products: Float[Array, "designs columns"], time_s: float
    ) -> Float[Array, "designs cases signals"]:
        """Return expected electrons of that element."""
        fixed, unlit = np.ascontiguousarray(self.fixed[:, :, self.one_element]), self.unlit_along(products)
        electrons = products[:, 1:].reshape(-1, *fixed.shape).copy()
        # In place: to give memory to an array of all signals takes as long as a sum.
        electrons += fixed
        electrons += unlit[..., None]
        electrons *= time_s
        return electrons
