"""Expected electrons of a scene on a sensor, for a batch of designs.

Stages in physical order: light through optics and filters onto the elements of the pixel response, a uniform
background, dark current, the moment of a pulse, the exposure. Nothing is clipped, rounded or noisy yet.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.types import Array, Bool, BoolArray, DesignCases, DesignCurves, DesignPixels, Float, FloatArray, PerDesign
from ..designs.block import Block
from ..designs.products import row_products
from .exposure import SceneLight, exposure_times
from .irradiance import background_irradiance, path_factor
from .pixel_response import PixelResponse, SplitLight
from .setup import Setup

KEPT = 15_000_000
"""Largest table of signals times kernel that is kept."""
_MANY = 50_000
"""Values from which on a compiled pass saves more time than it takes to load."""


@dataclass(frozen=True)
class Changing:
    """Designs of a batch that differ in one channel alone: their electrons, or the digital numbers read from them.

    `fixed`: values of the shared channels; those of `channel` are undefined; `make`: from a slice of the designs to
    their values of that channel; `unlit`: from a slice of the designs to all channels without the lamps; `exposure_s`:
    of all of them; `which`: designs of the batch that these are.
    """

    fixed: Float[Array, "cases signals channels"]
    channel: int
    make: Callable[[slice], Float[Array, "_designs cases signals channels"]]
    exposure_s: float
    which: Bool[BoolArray, " designs"]
    unlit: Callable[[slice], Float[Array, "_designs cases channels"]]

    @cached_property
    def values(self) -> DesignCases:
        """Values of the channel that differs, computed at the first use."""
        return self.make(slice(None))

    @property
    def whole(self) -> Float[Array, "cases pixels channels wavelengths"]:
        """All channels of all designs."""
        return self.whole_of(slice(None))

    def whole_of(self, part: slice) -> DesignCases:
        """Return all channels of some designs."""
        values = self.values[part] if "values" in self.__dict__ else self.make(part)
        all_channels = np.repeat(self.fixed[None], len(values), axis=0)
        all_channels[..., self.channel] = values
        return all_channels


def _expose(
    rates: Float[Array, "designs positions modified"],
    fixed: Float[Array, "signals channels"],
    uniform: Float[Array, "designs positions"],
    time_s: float,
) -> None:
    """Add fixed and uniform rates and multiply by the exposure time, in place."""
    if rates.size < _MANY:
        rates[:] = ((fixed + rates) + uniform[..., None]) * time_s
        return
    from .compiled import expose  # noqa: PLC0415  (compiled: kept off the start-up path)

    expose(rates, fixed, uniform, time_s)


def _background(setup: Setup) -> Float[Array, " channels"]:
    """Return electrons/s of the background per unit of QE, behind air and lens."""
    dimmed = path_factor(setup, setup.camera.grid.nodes_nm, background=True)
    return np.asarray(background_irradiance(setup) * setup.camera.area_step_m2_nm * dimmed, dtype=float)


class Electrons:
    """Expected electrons of designs on the elements of a pixel response.

    `light`, `response`: the scene's; `position`: of the field, of each case. `background`:
    electrons/s for each QE of the modified channels. `fixed`:
    electrons/s of the unmodified channels.
    """

    def __init__(self, light: SceneLight, response: PixelResponse, *, once: bool = False) -> None:
        """Compute the products of light, response and fixed QE."""
        self.setup = setup = light.setup
        self.light, self.response = light, response
        fixed, modified = list(setup.camera.fixed), list(setup.camera.modified)
        positions, angular = light.positions, light.angular
        self.position = np.repeat(np.arange(len(positions)), response.shape[0] // len(positions))
        self._split = response.source if isinstance(response.source, SplitLight) and len(positions) == 1 else None
        background = [_background(position) for position in positions]
        spectra = [np.repeat(dimmed[None], len(modified), axis=0) for dimmed in background]
        self.background = np.stack(
            [
                angular_response.light(dimmed, modified)
                for angular_response, dimmed in zip(angular, spectra, strict=True)
            ]
        )
        if self._split is None:
            self.fixed = self._products(response.light[:, :, fixed], setup.camera.qe[None, fixed], fixed)[0]
        else:
            self.fixed = np.zeros((response.shape[0], len(light.signals), response.shape[1]))
            self._add_pixels(self._split, setup.camera.qe[None, fixed], fixed, self.fixed[None])
        rates = [
            angular_response.curves(setup.camera.qe[fixed], fixed) @ dimmed
            for angular_response, dimmed in zip(angular, background, strict=True)
        ]
        self._fixed_uniform = np.einsum("xuc,xc->xu", response.uniform[:, :, fixed], np.stack(rates)[self.position])
        self._modified_uniform = response.uniform[:, :, modified]
        # Elements that look through a filter that changes; electrons/s per QE of it, kept where the table is small.
        if self._split is None:
            self._touched = np.flatnonzero((response.light[:, :, modified] != 0).any(axis=(0, 2, 3)))
            self._modified = response.light[:, self._touched][:, :, modified]
            size = self._modified.size * len(self.light.signals)
            self._kept: FloatArray | None = None
            if 0 < size <= KEPT and not once:
                self._kept = self._table()
        else:
            self._touched, self._kept = np.empty(0, dtype=np.intp), None

    def at_each_position(
        self, light: Float[Array, "cases *batch spectra wavelengths"], channels: Sequence[int]
    ) -> Float[Array, "cases *batch spectra wavelengths"]:
        """Return light on some channels behind their filters at each field position."""
        return np.concatenate(
            [response.light(light[self.position == at], channels) for at, response in enumerate(self.light.angular)]
        )

    def _products(
        self, light: Float[Array, "cases pixels _signals wavelengths"], qe: DesignCurves, of: Sequence[int]
    ) -> Float[Array, "designs cases spectra pixels"]:
        """Sum light times QE times signals over channels and wavelengths."""
        parts = [self._products_at(at, light[self.position == at], qe, of) for at in range(len(self.light.angular))]
        return np.concatenate(parts, axis=1)

    def _add_pixels(self, split: SplitLight, qe: DesignCurves, of: Sequence[int], out: DesignPixels) -> None:
        """Add the products of a factored light in place."""
        spectra = self.light.angular[0].curves(qe, of)[:, :, None] * self.light.signals
        split.add_sums(spectra, of, out)

    def _products_at(
        self,
        field_index: int,
        light: Float[Array, "cases pixels _signals wavelengths"],
        qe: DesignCurves,
        of: Sequence[int],
    ) -> Float[Array, "_designs cases _signals pixels"]:
        """Sum the products at one field position."""
        cases, units, channels, _ = light.shape
        size, n, n_signals = self.setup.camera.grid.size, len(qe), len(self.light.signals)
        weights = np.broadcast_to(light, (cases, units, channels, size)).reshape(cases * units, channels * size)
        # [n_designs, channels, n_signals, n_wavelengths]
        through_filters = self.light.angular[field_index].curves(qe, of)[:, :, None] * self.light.signals
        moved = np.moveaxis(through_filters, 2, 1).reshape(n, n_signals, channels * size)
        # A product for each design, so that how many there are changes it by no more than rounding.
        products = (moved @ weights.T).reshape(n, n_signals, cases, units)
        return np.asarray(np.moveaxis(products, 1, 2), dtype=float)

    def _table(self) -> Float[Array, "rows columns"]:
        """Return signals times response."""
        cases, units, channels, size = self._modified.shape
        if not any(seen.matrices for seen in self.light.angular):
            table = np.empty((channels, size, cases, len(self.light.signals), units))
            response = np.ascontiguousarray(np.transpose(self._modified, (2, 3, 0, 1)))
            np.multiply(response[:, :, :, None], self.light.signals.T[:, None, :, None], out=table)
            return table.reshape(channels * size, -1)
        product = self._modified[:, None] * self.light.signals[:, None, None, :]
        product = self.at_each_position(product, self.setup.camera.modified)
        return np.ascontiguousarray(product.reshape(-1, channels * size).T)

    def rates(self, curves: DesignCurves) -> DesignPixels:
        """Return electrons/s of each signal, without background and dark current."""
        rates = np.repeat(self.fixed[None], len(curves), axis=0)
        if self._split is not None and self.setup.camera.modified:
            self._add_pixels(self._split, curves, self.setup.camera.modified, rates)
        if not self._touched.size:
            return rates
        if self._kept is None:
            part = self._products(self._modified, curves, self.setup.camera.modified)
        else:
            qe = curves.reshape(len(curves), -1)
            part = row_products(qe, self._kept).reshape(len(curves), *self.fixed.shape[:2], self._touched.size)
        rates[..., self._touched] += part
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
        uniform = self._fixed_uniform + self.through_filters(self.of_background(curves))
        return np.asarray(uniform + self.setup.camera.pixel.dark_e_per_s, dtype=float)

    def of_background(self, curves: DesignCurves) -> Float[Array, "designs positions modified"]:
        """Return electrons/s of the background in the modified channels."""
        return np.asarray(np.einsum("nml,pml->npm", curves, self.background), dtype=float)

    def through_filters(
        self, rates: Float[Array, "designs positions modified"]
    ) -> Float[Array, "designs cases pixels"]:
        """Distribute uniform light of the modified channels over the elements.

        `rates`: electrons/s of the modified channels.
        """
        total = np.zeros((len(rates), *self._modified_uniform.shape[:2]))
        for index in range(rates.shape[2]):
            total += self._modified_uniform[:, :, index] * rates[:, self.position, index, None]
        return total

    @cached_property
    def _along(self) -> Float[Array, "wavelengths products"]:
        """Weights of the one modified channel: white, background at each position, and what is kept."""
        assert self._kept is not None
        white = self.light.white[:, None]
        return np.concatenate([white, self.background[:, 0].T, self._kept], axis=1)

    def changing(self, block: Block) -> Changing | None:
        """Return electrons of designs that differ in one channel alone, if each element is a channel.

        Designs whose modified channel sets the exposure are left out.

        None if other elements see the modified channel, or if the light is pulsed.
        """
        setup = self.setup
        touched = np.flatnonzero((self._modified_uniform != 0).any(axis=(0, 2)))
        if len(setup.camera.modified) != 1 or self._kept is None or self._touched.size != 1:
            return None
        if not np.array_equal(touched, self._touched):
            return None
        time_s = exposure_times(setup, np.zeros((1, 1)), self.light.fixed_white)
        products = block.product(self._along, np.arange(setup.camera.grid.size))
        white, background, rates = np.split(products, [1, 1 + len(self.background)], axis=1)
        if white.max(initial=0.0) <= self.light.fixed_white:
            which = np.ones(len(block), dtype=bool)
        else:
            which = exposure_times(setup, white, self.light.fixed_white) == time_s
        if not which.any() or not np.isfinite(time_s[0]) or self.light.scales(time_s).shape[1] > 1:
            return None
        if not which.all():
            background, rates = background[which], rates[which]
        unit = int(self._touched[0])
        uniform = background[:, self.position] * self._modified_uniform[:, unit, 0]
        uniform = self._fixed_uniform[:, unit] + uniform + setup.camera.pixel.dark_e_per_s
        rest = self.fixed + (self._fixed_uniform + setup.camera.pixel.dark_e_per_s)[:, None]
        fixed = np.ascontiguousarray(self.fixed[:, :, unit])

        def make(part: slice) -> Float[Array, "_designs cases channels"]:
            values = rates[part].reshape(-1, *fixed.shape).copy()
            _expose(values, fixed, uniform[part], float(time_s[0]))
            return values

        dark = self._fixed_uniform + setup.camera.pixel.dark_e_per_s

        def unlit(part: slice) -> Float[Array, "designs cases pixels"]:
            electrons = np.repeat(dark[None], len(uniform[part]), axis=0)
            electrons[..., unit] = uniform[part]
            return np.asarray(electrons * time_s[0], dtype=float)

        return Changing(rest * time_s[0], unit, make, float(time_s[0]), which, unlit)
