"""Curves of a sensor that are not known exactly: random curves within stated errors, the same for all designs.

A curve is c(l) = d(l) r(l), with the transmission r of the IR cut where that is known apart. As it may be:

    d(l - s) (1 + g) (1 + n(l)) r(l - e)

with a gain g, a shift s and a smooth noise n of its own, and the shift e of the IR cut that all curves share; each is
evenly distributed within its error to either side. n is A (2 Phi(z) - 1) of a Gaussian process z of variance 1 with the
correlation exp(-d^2 / 2 L^2) over a distance d.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from ..base.types import Array, Float, PerSample, PerWavelength, Section
from ..spectra.population import check_draws
from ..spectra.spectrum import WavelengthGrid
from .noise.gaussian import share_below
from .sensor import SensorCurves

_LEAST_CUT = 1e-3
"""Transmission of the IR cut below which nothing is known of what is behind it."""
_LEAST_BASE = 1e-6
"""Share of a curve's peak below which the transmission of a filter on it is not known."""
_MOST_HELD = 20_000
"""Random sensors that every worker of a search holds: of so many about 1 GB."""
_IR_CUT = "IR cut"
_JITTER = 1e-10


UNCLIPPED = "pixels may saturate: random sensors are read before clipping"
"""Note of a run whose random sensors would clip."""


class CurveErrors(Section):
    """Errors of the sensor's curves, each to either side and evenly distributed within.

    A filter keeps its transmission relative to the curve that it replaces, and has the errors of that curve.
    """

    gain: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    """Relative error of each curve's height."""
    shift_nm: Annotated[float, Field(ge=0, le=50)] = 0.0
    """Error of each curve's wavelengths, nm."""
    noise: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    """Largest relative error of a curve at any wavelength, smooth over `correlation_nm`."""
    correlation_nm: Annotated[float, Field(ge=1, le=1000)] = 40.0
    """Correlation length of this error, nm."""
    ir_cut_nm: Annotated[float, Field(ge=0, le=50)] = 0.0
    """Shift of the IR cut, nm; of sensors whose IR cut is known apart (`ar0820`, `opencam`)."""
    draws: Annotated[int, Field(ge=100, le=100_000)] = 2000
    """Random sensors."""
    wanted_yield: float | None = Field(default=None, ge=0.5, le=0.9999)
    """Share of random cameras: `yield_csd_...` is the CSD that this share has at least, as objective or constraint.
    A camera has random curves and a production error of its own, and sees all lights of the study, or, where these have
    a `population`, two random lamps. At most 20,000 `draws`; designs are judged on ten times as many others."""

    @model_validator(mode="after")
    def _enough(self) -> CurveErrors:
        check_draws(self.wanted_yield, self.draws)
        if self.wanted_yield is not None and self.draws > _MOST_HELD:
            raise ValueError(f"wanted_yield takes at most {_MOST_HELD:,} `draws`, not {self.draws:,}")
        return self

    @property
    def linear(self) -> bool:
        """True if every curve's response is linear in the errors."""
        return self.shift_nm == 0 and self.ir_cut_nm == 0


@dataclass(frozen=True)
class UncertainCurves:
    """Curves of a camera's channels that are not known exactly; `names`: of the sensor's curve in each channel."""

    sensor: SensorCurves
    names: tuple[str, ...]
    errors: CurveErrors

    def drawn(self, grid: WavelengthGrid, seed: Sequence[int]) -> Float[Array, "draws channels wavelengths"]:
        """Draw curves of all channels, those of modified ones without their filter."""
        return drawn_curves(self.sensor, grid, self.names, self.errors, seed)


def drawn_curves(
    sensor: SensorCurves, grid: WavelengthGrid, names: Sequence[str], errors: CurveErrors, seed: Sequence[int]
) -> Float[Array, "draws names wavelengths"]:
    """Draw curves of a sensor; those of a name are the same whatever others are drawn."""
    wave, cut = grid.nodes_nm, sensor.ir_cut
    known = np.ones(wave.size) if cut is None else np.maximum(cut, _LEAST_CUT)
    (moved,) = _evenly(_IR_CUT, errors, seed, 1) * errors.ir_cut_nm
    cuts = np.stack([np.interp(wave - e, wave, known) for e in moved]) if errors.ir_cut_nm else known[None]
    root = _root(wave, errors.correlation_nm)
    curves = np.empty((errors.draws, len(names), wave.size))
    for at, name in enumerate(names):
        dye = sensor.curve(name) / known
        gain, shift = _evenly(name, errors, seed, 2)
        z = _rng(name, seed, 1).standard_normal((errors.draws, wave.size)) @ root.T
        height = (1 + errors.gain * gain[:, None]) * (1 + errors.noise * (2 * share_below(z) - 1))
        there = [np.interp(wave - s, wave, dye) for s in errors.shift_nm * shift] if errors.shift_nm else dye
        curves[:, at] = there * height * cuts
    return curves


def _rng(name: str, seed: Sequence[int], part: int) -> np.random.Generator:
    """Return a generator of a curve's own."""
    return np.random.default_rng([*seed, zlib.crc32(name.encode()), part])


def _evenly(name: str, errors: CurveErrors, seed: Sequence[int], count: int) -> Float[Array, "rows columns"]:
    """Return numbers from -1 to 1."""
    return np.asarray(_rng(name, seed, 0).uniform(-1, 1, (count, errors.draws)), dtype=float)


def _root(wave: PerSample, length_nm: float) -> Float[Array, "samples samples"]:
    """Return a root of the correlation matrix."""
    correlation = np.exp(-0.5 * ((wave[:, None] - wave) / length_nm) ** 2)
    return np.asarray(np.linalg.cholesky(correlation + _JITTER * np.eye(wave.size)), dtype=float)


def linear_in_filter(
    curves: Float[Array, "draws wavelengths"], base: PerWavelength
) -> tuple[Float[Array, "draws wavelengths"], Float[Array, "draws wavelengths"]]:
    """Return weights and rest of drawn curves: behind a filter of QE N they are weights N + rest; N / base stays."""
    known = base > _LEAST_BASE * base.max()
    weights = np.divide(curves, base, out=np.zeros_like(curves), where=np.broadcast_to(known, curves.shape))
    return weights, np.where(known, 0.0, curves)
