"""The fast way of designs that differ in one channel alone, as those of a grid: sums of filters are looked up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import Array, Bool, BoolArray, DesignCases, Float, PerWavelength
from ..designs.block import Block
from .electrons import View
from .exposure import exposure_times
from .image import Channels
from .pixel import unquantized
from .readout import Exposure, Readout
from .setup import Setup

_KEPT = 15_000_000
"""Largest table of one channel's rates in all cases."""
_ByCase = Float[Array, "_designs cases signals"]


class Along:
    """What designs that differ in one channel have in common.

    `weights`: of the channel's curve, on the white patch, in the background of each view, in each case and signal.
    """

    def __init__(
        self, views: Sequence[View], exposure: Exposure, readout: Readout, white: PerWavelength, fixed_white: float
    ) -> None:
        self.setup, self.readout = views[0].setup, readout
        (self.channel,), nothing = self.setup.camera.modified, np.zeros((1, *self.setup.camera.base_qe.shape))
        images = [view.image for view in views if isinstance(view.image, Channels)]
        own, sizes = slice(self.channel, None, images[0].n_channels), [image.n_cases for image in images]
        self.view = np.repeat(np.arange(len(views)), sizes)
        self.uniform = np.concatenate([image.background[self.channel, own] for image in images])
        backgrounds = [view.position.per_qe(view.position.background[None], self.channel) for view in views]
        light = [image.light[self.channel, own] for image in images]
        lit = [self._lit(view, of_view) for view, of_view in zip(views, light, strict=True)]
        self.weights = np.concatenate([white[None], *backgrounds, *lit]).T
        self.fixed_white = fixed_white
        self.exposure_s = float(exposure_times(self.setup, np.zeros((1, 1)), fixed_white)[0])
        n = len(self.setup.camera.mosaic.channels)
        rest = np.concatenate([view.rates(nothing, exposure)[:, 0] for view in views])
        dark = np.concatenate([view.unlit(nothing, exposure) for view in views])
        self.dark_e = (dark * self.exposure_s).reshape(-1, n)
        electrons = (rest + dark) * self.exposure_s
        fixed = readout.mean(electrons[None], np.zeros(len(rest), dtype=np.intp))
        self.fixed = np.swapaxes(fixed.reshape(-1, n, fixed.shape[1]), 1, 2)

    @staticmethod
    def applies(setup: Setup, views: Sequence[View]) -> bool:
        """Return whether one modified channel is all that its elements see, and rates of all cases fit into memory."""
        if setup.camera.pixel.captures or len(setup.camera.modified) != 1:
            return False
        size = sum(view.image.n_cases for view in views) * len(setup.lights.names) * setup.camera.grid.size
        return size <= _KEPT and all(_is_alone(view, *setup.camera.modified) for view in views)

    def _lit(self, view: View, light: Float[Array, "cases functions"]) -> Float[Array, "columns wavelengths"]:
        whole = light if view.image.shares is None else light @ view.image.shares
        lit = view.position.per_qe(whole[:, None] * view.position.signals, self.channel)
        return lit.reshape(-1, lit.shape[-1])

    def read(self, block: Block) -> AlongReadings | None:
        """Return the readings of designs whose exposure other channels set; None if there are none."""
        products = block.product(self.weights, np.arange(self.setup.camera.grid.size))
        which = exposure_times(self.setup, products[:, :1], self.fixed_white) == self.exposure_s
        if not which.any() or not np.isfinite(self.exposure_s):
            return None
        return AlongReadings(self, which, products if which.all() else products[which])


def _is_alone(view: View, channel: int) -> bool:
    """Return whether a channel is seen by the elements of that channel alone."""
    if not isinstance(view.image, Channels):
        return False
    others = view.image.channel != channel
    return not view.image.background[channel, others].any() and not view.image.light[channel, others].any()


@dataclass(frozen=True)
class AlongReadings:
    """Readings of designs that differ in one channel alone.

    `which`: designs of the batch that these are; `products`: of their filters with the weights of `Along`.
    """

    of: Along
    which: Bool[BoolArray, " designs"]
    products: Float[Array, "which columns"]

    def make(self, part: slice) -> _ByCase:
        """Return digital numbers of that channel of some designs, DN."""
        own, (n_cases, n_signals) = self._unlit_e(part), self.of.fixed.shape[:2]
        electrons = self.products[part, -n_cases * n_signals :].copy().reshape(-1, n_cases, n_signals)
        # In place: to give memory to an array of all signals takes as long as a sum.
        electrons *= self.of.exposure_s
        electrons += own[..., None]
        flat = electrons.reshape(1, -1, n_signals)
        return self.of.readout.mean(flat, np.zeros(flat.shape[1], dtype=np.intp)).reshape(electrons.shape)

    def unlit(self, part: slice) -> Float[Array, "_designs cases channels"]:
        """Return the readings of all channels without lamps, unquantized, DN."""
        own = self._unlit_e(part)
        electrons = np.repeat(self.of.dark_e[None], len(own), axis=0)
        electrons[..., self.of.channel] = own
        return unquantized(electrons, self.of.setup.camera.pixel)

    def _unlit_e(self, part: slice) -> Float[Array, "_designs cases"]:
        backgrounds = self.products[part, 1 : 2 + self.of.view[-1]][:, self.of.view]
        unlit_e = backgrounds * self.of.uniform * self.of.exposure_s + self.of.dark_e[:, self.of.channel]
        return np.asarray(unlit_e, dtype=float)

    def whole(self, part: slice) -> DesignCases:
        """Return all channels of some designs."""
        values = self.make(part)
        all_channels = np.repeat(self.of.fixed[None], len(values), axis=0)
        all_channels[..., self.of.channel] = values
        return all_channels
