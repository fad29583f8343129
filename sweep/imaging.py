"""The image chain of a scene: light on the pixels, electrons, full well, readout, for a block of designs.

In the physical order: optics blur, pixel aperture and mosaic sampling with crosstalk, photon noise, full well, read
noise, pedestal, ADC, readout (mean over the disc, or demosaicked center). Only what `Setup.methods` names is computed.
"""

from __future__ import annotations

import hashlib
import pickle
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import DTypeLike

from .arrays import BoolArray, FloatArray, IndexArray, row_products
from .blocks import Block
from .cache import Cache
from .effects import flicker, noise_table, phase, quadrature, quantization, saturation
from .effects.kernel import blocks, make_kernel
from .errors import Fault, SweepError
from .noisy_readout import NoisyReadout, is_cut, is_gaussian, reach_dn
from .places import AnyPlace
from .scenes import WhitePatchExposure
from .sensor import Pixel, unquantized
from .setup import (
    Methods,
    Setup,
    background_irradiance,
    exposure_times,
    per_photon,
    signal_irradiance,
    white_irradiance,
)

_BLOCK = 2_000_000
"""Values of a block of pixels that are held at once."""
_KEPT = 15_000_000
"""Largest table of signals times kernel that is kept."""


@dataclass(frozen=True)
class Changing:
    """A readout of those designs of a block that differ in one channel alone, DN.

    `fixed`: ndarray[n_cases, n_signals, n_channels], what they share (that channel's values mean nothing); `values`:
    ndarray[n, n_cases, n_signals] of `channel`; `exposure_s`: that of each. `which`: ndarray[n_designs], the n designs.
    """

    fixed: FloatArray
    channel: int
    values: FloatArray
    exposure_s: float
    which: BoolArray


class Imager:
    """A scene with its kernel made, ready for designs. `work` counts what is computed, by effect."""

    def __init__(
        self,
        setup: Setup,
        work: Counter[str] | None = None,
        dtype: DTypeLike = np.float64,
        cases: phase.Cases | None = None,
    ) -> None:
        """`dtype`: of the product of curves and scene, where the scene's table is small enough to be kept. `cases`:
        places of the light instead of those of the method of `phase`.
        """
        self.setup = setup
        self.work: Counter[str] = Counter() if work is None else work
        methods, grid = setup.methods, setup.grid
        self.straight = methods.saturation == "skip" and methods.quantization == "skip"
        by_pixel, targeted = not self.straight, setup.scenario.target is not None
        every = blocks(setup, phase.cases(setup, methods.phase) if cases is None else cases) if targeted else []
        # Where the kernels of all places would be too large to hold, those of the others are made as they are read.
        self._others = every[1:] if by_pixel and methods.sampling != "skip" else []
        cases = every[0] if self._others else cases
        kernel = make_kernel(setup, methods, grid.nodes_nm, by_pixel=by_pixel, work=self.work, cases=cases)
        self.n_cases, self.n_units = kernel.light.shape[:2]
        self.n_places = self.n_cases + sum(len(block.places_px) for block in self._others)
        self._readout, self._light, self._uniform = kernel.readout, kernel.light, kernel.uniform
        self._spread = kernel.spread
        self._nodes = quadrature.nodes(grid.size, methods.quadrature)
        self._hats = None if self._nodes.size == grid.size else quadrature.hats(grid.size, self._nodes)
        self.signals = signal_irradiance(setup) * per_photon(setup)
        self._background = background_irradiance(setup) * per_photon(setup)
        self._white = white_irradiance(setup) * per_photon(setup)
        fixed, modified = list(setup.fixed), list(setup.modified)
        # Electrons/s of what no design changes, [n_cases, n_signals, n_units] and [n_cases, n_units].
        self._fixed = self._products(kernel.light[:, :, fixed], setup.qe[None, fixed])[0]
        self._fixed_uniform = kernel.uniform[:, :, fixed] @ (setup.qe[fixed] @ self._background)
        self._modified_uniform = kernel.uniform[:, :, modified]
        # Units that look through a filter that changes; electrons/s per QE of it, kept where the table is small.
        self._touched = np.flatnonzero((kernel.light[:, :, modified] != 0).any(axis=(0, 2, 3)))
        self._modified = kernel.light[:, self._touched][:, :, modified]
        size = self._modified[..., 0].size * len(self.signals) * self._nodes.size
        self._kept = self._table().astype(dtype) if 0 < size <= _KEPT else None

    def _looked_at(self, qe: FloatArray) -> FloatArray:
        """QE as the quadrature sees it: itself, or linear between its nodes."""
        return qe if self._hats is None else qe[..., self._nodes] @ self._hats

    def _products(self, light: FloatArray, qe: FloatArray) -> FloatArray:
        """Sum over channels and wavelengths of kernel, QE and signals, [n_designs, n_cases, n_signals, n_units]."""
        cases, units, channels, _ = light.shape
        size, n, n_signals = self.setup.grid.size, len(qe), len(self.signals)
        weights = np.broadcast_to(light, (cases, units, channels, size)).reshape(cases * units, channels * size)
        seen = self._looked_at(qe)[:, :, None] * self.signals  # [n_designs, channels, n_signals, n_wavelengths]
        moved = np.moveaxis(seen, 2, 1).reshape(n, n_signals, channels * size)
        self.work["response"] += weights.shape[0] * moved.size
        # A product for each design, so that its bits do not depend on how many there are.
        found = (moved @ weights.T).reshape(n, n_signals, cases, units)
        return np.asarray(np.moveaxis(found, 1, 2), dtype=float)

    def _table(self) -> FloatArray:
        """Signals times kernel on the quadrature's nodes, [channels x nodes, n_cases x n_signals x n_units]."""
        product = self._modified[:, None] * self.signals[:, None, None, :]
        on_nodes = product if self._hats is None else product @ self._hats.T
        channels, nodes = on_nodes.shape[-2:]
        return np.ascontiguousarray(on_nodes.reshape(-1, channels * nodes).T)

    def rates(self, curves: FloatArray) -> FloatArray:
        """Electrons/s of each signal, ndarray[n_designs, n_cases, n_signals, n_units].

        `curves`: QE of the modified channels, ndarray[n_designs, n_modified, n_wavelengths].
        """
        found = np.repeat(self._fixed[None], len(curves), axis=0)
        if not self._touched.size:
            return found
        if self._kept is None:
            part = self._products(self._modified, curves)
        else:
            qe = curves[:, :, self._nodes].reshape(len(curves), -1).astype(self._kept.dtype)
            self.work["response"] += len(curves) * self._kept.size
            part = row_products(qe, self._kept).reshape(len(curves), *self._fixed.shape[:2], self._touched.size)
        found[..., self._touched] += part
        return found

    def read_changing(self, block: Block) -> Changing | None:
        """The readout of designs that differ in one channel alone; None where they do not, or more than that is read.

        Needs a modified channel that no other unit looks through, and a light that does not pulse. Designs whose
        modified channel sets the exposure are left out.
        """
        setup, n = self.setup, len(self.setup.mosaic.channels)
        whole = self.straight or (setup.scenario.target is None and self.n_units == n)
        touched = np.flatnonzero((self._modified_uniform != 0).any(axis=(0, 2)))
        if len(setup.modified) != 1 or not whole or self._kept is None or self._touched.size != 1:
            return None
        if not np.array_equal(touched, self._touched):
            return None
        everywhere = np.arange(setup.grid.size)
        time_s = exposure_times(setup, np.zeros((1, 1)))
        which = exposure_times(setup, block.product(self._white[:, None], everywhere)) == time_s
        if not which.any() or not np.isfinite(time_s[0]) or self.scales(time_s).shape[1] > 1:
            return None
        some = block if which.all() else block.some(np.flatnonzero(which))
        unit = int(self._touched[0])
        self.work["response"] += len(some) * self._kept.size
        part = some.product(self._kept, self._nodes).reshape(len(some), self.n_cases, -1)
        uniform = some.product(self._background[:, None], everywhere) * self._modified_uniform[:, unit, 0]
        uniform = self._fixed_uniform[:, unit] + uniform + setup.pixel.dark_e_per_s
        rest = self._fixed + (self._fixed_uniform + setup.pixel.dark_e_per_s)[:, None]
        values = self.transfer((self._fixed[:, :, unit] + part + uniform[:, :, None]) * time_s[0])
        return Changing(self.transfer(rest * time_s[0]), unit, values, float(time_s[0]), which)

    def exposure_s(self, curves: FloatArray) -> FloatArray:
        """Exposure of each design, s, ndarray[n_designs]."""
        return exposure_times(self.setup, curves @ self._white)

    def scales(self, exposure_s: FloatArray) -> FloatArray:
        """Light relative to its mean in the cases of a pulsed light, ndarray[n_designs, n_scales]."""
        found = flicker.scales(self.setup, self.setup.methods.flicker, exposure_s)
        if found.shape[1] > 1:
            self.work["flicker"] += found.size
        return found

    def electrons(self, curves: FloatArray, scales: FloatArray, exposure_s: FloatArray) -> FloatArray:
        """Expected electrons before the full well, ndarray[n_designs, n_cases x n_scales, n_signals, n_units]."""
        uniform = self._fixed_uniform + self._through_filters(curves @ self._background)
        uniform = uniform + self.setup.pixel.dark_e_per_s
        both = self.rates(curves)[:, :, None] * scales[:, None, :, None, None] + uniform[:, :, None, None, :]
        flat = both.reshape(len(curves), -1, *both.shape[3:])
        return np.asarray(flat * exposure_s[:, None, None, None], dtype=float)

    def _through_filters(self, rates: FloatArray) -> FloatArray:
        """What the units get of a uniform light, ndarray[n_designs, n_cases, n_units].

        `rates`: electrons/s of the modified channels, ndarray[n_designs, n_modified].
        """
        found = np.zeros((len(rates), *self._modified_uniform.shape[:2]))
        for index in range(rates.shape[1]):
            found += self._modified_uniform[:, :, index] * rates[:, index, None, None]
        return found

    def _folded(self, dn: FloatArray) -> FloatArray:
        """Value of each channel from those of the units: the last axis n_units -> n_channels."""
        if self.straight or (self.setup.scenario.target is None and self.n_units == self._readout.shape[2]):
            return dn
        return self._weighed(dn, self._readout)

    def _weighed(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        """Sums over the units by their `weights`, ndarray[n_cases, n_units, n_channels]."""
        self.work["readout"] += values.size
        repeats = values.shape[1] // self.n_cases
        return np.asarray(values @ np.repeat(weights, repeats, axis=0))

    def smooth(self, curves: FloatArray) -> FloatArray:
        """Unquantized, unclipped response, DN, ndarray[n_designs, n_cases, n_signals, n_channels]."""
        exposure_s = self.exposure_s(curves)
        return self._folded(unquantized(self.electrons(curves, self.scales(exposure_s), exposure_s), self.pixel))

    def smooth_gradient(self, curves: FloatArray, curves_gradient: FloatArray) -> FloatArray:
        """Exact derivative of `smooth` at one design, with that of its exposure; a pulse's share of it is held.

        `curves`: ndarray[n_modified, n_wavelengths]; `curves_gradient`: ndarray[n_parameters, n_modified,
        n_wavelengths]. Returns DN per unit of parameter, ndarray[n_parameters, n_cases, n_signals, n_channels].
        """
        one = curves[None]
        exposure_s = self.exposure_s(one)
        scales = self.scales(exposure_s)
        whole = self.electrons(one, scales, exposure_s)[0]
        light = (self.rates(curves_gradient) - self._fixed)[:, :, None] * scales[0][None, None, :, None, None]
        uniform = self._through_filters(curves_gradient @ self._background)
        slope = (light + uniform[:, :, None, None, :]).reshape(len(curves_gradient), *whole.shape) * exposure_s
        if isinstance(self.setup.scenario.exposure, WhitePatchExposure):
            rates = one[0] @ self._white
            fixed = self.setup.qe[list(self.setup.fixed)] @ self._white
            if rates.size and rates.max() > fixed.max(initial=0.0):
                top = int(np.argmax(rates))
                relative = (curves_gradient[:, top] @ self._white) / rates[top]
                slope = slope - relative[:, None, None, None] * whole
        return self._folded(slope * self.pixel.dn_per_e)

    @cached_property
    def anywhere(self) -> AnyPlace | None:
        """The scene with the light at any place, where that is asked for and more than a lattice of places counts."""
        return AnyPlace(self.setup, self.work) if phase.all_count(self.setup) else None

    def light_dn(self, curves: FloatArray, exposure_s: float) -> FloatArray:
        """What each signal gives through each channel's filter where its image is whole, in a pulse's darkest moment.

        `curves`: of one design, ndarray[n_modified, n_wavelengths]. DN, ndarray[n_signals, n_channels, n_wavelengths].
        """
        qe = self.setup.qe.copy()
        qe[list(self.setup.modified)] = curves
        scale = self.scales(np.array([exposure_s]))[0].min() * exposure_s * self.pixel.dn_per_e
        return np.asarray(self.signals[:, None] * self._looked_at(qe) * scale, dtype=float)

    def per_qe(self, modified: int, curves: FloatArray) -> FloatArray:
        """DN per QE of one modified channel at every wavelength, with the exposure of the design `curves`.

        ndarray[n_cases, n_signals, n_units, n_wavelengths]; the smooth response is linear in it where N does not set
        the exposure.
        """
        exposure_s = self.exposure_s(curves[None])
        scales = self.scales(exposure_s)[0]
        light = self._light[:, None, None, :, self.setup.modified[modified]] * self.signals[:, None, :]
        uniform = self._uniform[:, None, None, :, self.setup.modified[modified], None] * self._background
        both = light * scales[None, :, None, None, None] + uniform
        return np.asarray(both.reshape(-1, *both.shape[2:]) * (exposure_s[0] * self.pixel.dn_per_e), dtype=float)

    def channels_of(self, pixels: FloatArray, place: int) -> FloatArray:
        """Readout of each channel from its pixels (those of `pixel_electrons`) at a place of the light.

        ndarray[n, n_pixels] -> ndarray[n, n_channels].
        """
        setup = self.setup
        if setup.scenario.target is None:
            own = setup.mosaic.indices.ravel()[:, None] == np.arange(len(setup.mosaic.channels))
            return np.asarray(pixels @ (own / setup.mosaic.counts), dtype=float)
        return np.asarray(pixels @ self._readout[place], dtype=float)

    @property
    def few_pixels(self) -> tuple[IndexArray, ...] | None:
        """For each channel the pixels of `pixel_electrons` of which it is the mean; None where they are many."""
        setup = self.setup
        if setup.scenario.target is not None or setup.mosaic.counts.max() > _FEW:
            return None
        channels = setup.mosaic.indices.ravel()
        return tuple(np.flatnonzero(channels == at) for at in range(len(setup.mosaic.channels)))

    @property
    def pixel(self) -> Pixel:
        """The pixel, without a pedestal where that is skipped."""
        pixel = self.setup.pixel
        return pixel.model_copy(update={"offset_dn": 0.0}) if self.setup.methods.pedestal == "skip" else pixel

    def read(self, curves: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The readout, DN, ndarray[n_designs, n_cases, n_signals, n_channels], and exposure, s, ndarray[n_designs]."""
        exposure_s = self.exposure_s(curves)
        own = np.concatenate([self._folded(self.transfer(e)) for e in self._blocks(curves, exposure_s)])
        return np.concatenate([own, *(other.read(curves)[0] for other in self._rest())], axis=1), exposure_s

    def _rest(self) -> Iterator[Imager]:
        """The places whose kernels are not held, block by block."""
        return (Imager(self.setup, self.work, cases=block) for block in self._others)

    def read_with_noise(self, curves: FloatArray) -> NoisyReadout:
        """The readout as from `read`, with its variance and what errors need to know of it.

        Pixels are read one by one, so saturation and quantization must be among the setup's methods.
        """
        exposure_s = self.exposure_s(curves)
        parts = []
        for electrons in self._blocks(curves, exposure_s):
            dn, variance_dn = self.transfer(electrons), self.variance_dn(electrons)
            # A digital number that is the same in all but one of a billion readouts: what is left of its noise is
            # rounding of the arithmetic, by which two signals would seem told apart for certain.
            certain = variance_dn < _CERTAIN_DN2
            dn, variance_dn = np.where(certain, np.rint(dn), dn), np.where(certain, 0.0, variance_dn)
            mean, variance = self._folded(dn), self._weighed(variance_dn, self._spread)
            parts.append((mean, variance, *self._shape_of_noise(electrons, variance)))
        found = [tuple(np.concatenate(values) for values in zip(*parts, strict=True))]
        for other in self._rest():
            more = other.read_with_noise(curves)
            found.append((more.mean, more.variance, more.gaussian, more.reach_dn))
        mean, variance, gaussian, reach = (np.concatenate(values, axis=1) for values in zip(*found, strict=True))
        return NoisyReadout(mean, variance, gaussian, reach, exposure_s)

    def _shape_of_noise(self, electrons: FloatArray, variance: FloatArray) -> tuple[BoolArray, FloatArray]:
        """`NoisyReadout.gaussian` and `reach_dn` of a block."""
        repeats = electrons.shape[1] // self.n_cases
        heaviest = self._readout.max(axis=1) if self.setup.scenario.target else 1 / self.setup.mosaic.counts[None]
        heaviest = np.repeat(np.broadcast_to(heaviest, (self.n_cases, variance.shape[-1])), repeats, axis=0)[:, None]
        cut = self._weighed(is_cut(electrons, self.pixel), (self._readout > 0).astype(float)) > 0
        return is_gaussian(variance, heaviest, cut, self.pixel), reach_dn(electrons, self.pixel) * heaviest

    def _blocks(self, curves: FloatArray, exposure_s: FloatArray) -> Iterator[FloatArray]:
        """`electrons` of blocks of designs."""
        scales = self.scales(exposure_s)
        step = max(1, _BLOCK // (self.n_cases * scales.shape[1] * len(self.signals) * self.n_units))
        for start in range(0, len(curves), step):
            block = slice(start, start + step)
            yield self.electrons(curves[block], scales[block], exposure_s[block])

    def pixel_electrons(self, curves: FloatArray) -> FloatArray:
        """Expected electrons of the pixels that are read, ndarray[n_designs, n_cases, n_signals, n_pixels].

        Of a light that fills the field, the pixels of one tile, row by row. Raises SweepError where the pixels of all
        places do not fit into memory.
        """
        if self._others:
            most = f"at most those of {self.n_cases} places: a smaller light, or a named place"
            raise SweepError(Fault("too many pixels to draw", value=f"{self.n_places} places", allowed=most))
        exposure_s = self.exposure_s(curves)
        found = self.electrons(curves, self.scales(exposure_s), exposure_s)
        if self.setup.scenario.target is None and self.n_units == len(self.setup.mosaic.channels):
            return found[..., self.setup.mosaic.indices.ravel()]
        return found

    def transfer(self, electrons: FloatArray) -> FloatArray:
        """Digital numbers of the units from their expected electrons, as far as the methods go."""
        methods, noisy, pixel = self.setup.methods, self.setup.scenario.noise is not None, self.pixel
        soft, rounds = noisy and methods.noise == "expected", methods.quantization != "skip"
        if methods.saturation == "skip":
            dn = unquantized(electrons, pixel)
        elif soft:
            self.work["noise"] += electrons.size
            dn = (noise_table.rounded if rounds else noise_table.unrounded)(electrons, pixel)
        else:
            self.work["saturation"] += electrons.size
            dn = unquantized(saturation.clipped(electrons, pixel), pixel)
        if not rounds:
            return dn
        self.work["quantization"] += electrons.size
        if soft and methods.saturation != "skip":
            return dn
        if noisy:
            return dn + noise_table.rounded(electrons, pixel) - noise_table.unrounded(electrons, pixel)
        held = electrons if methods.saturation == "skip" else saturation.clipped(electrons, pixel)
        return quantization.rounded(held * pixel.dn_per_e, pixel)

    def variance_dn(self, electrons: FloatArray) -> FloatArray:
        """Variance of the units' digital numbers, DN^2, with their rounding."""
        self.work["variance"] += electrons.size
        return noise_table.variance(electrons, self.pixel)


_CERTAIN_DN2 = 1e-9
_FEW = 16
_imagers: Cache[bytes, Imager] = Cache(16)


def imager_of(setup: Setup) -> Imager:
    """The imager of a setup; the latest ones are kept, so that a kernel is made once in a process."""
    return _imagers.get(hashlib.sha256(pickle.dumps(setup)).digest(), lambda: Imager(setup))


def smooth_imager(setup: Setup) -> Imager:
    """The imager of a setup without clipping and rounding, on every wavelength: what a search sees."""
    straight = {"saturation": "skip", "quantization": "skip", "noise": "skip", "quadrature": "grid"}
    if setup.methods.flicker == "fine":  # of a straight response the ends are the extremes
        straight["flicker"] = "ends"
    return imager_of(replace(setup, methods=Methods(**{**asdict(setup.methods), **straight})))
