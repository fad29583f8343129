"""Spectra on one wavelength grid: checks, resampling rules, photons and energy.

A curve that is not clean (NaN, negative, unsorted, duplicated or truncated data) is refused, never repaired.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import model_validator

from ..base.errors import DataError, ValidationIssue
from ..base.types import Array, Float, PerKnot, PerSample, PerWavelength, Positive, SameShape, Section

Resampling = Literal["linear", "mean"]
Outside = Literal["refuse", "zero"]
Quantity = Literal[
    "qe",
    "responsivity",
    "relative_responsivity",
    "transmission",
    "density",
    "decibel",
    "reflectance",
    "energy",
    "photons",
]

PLANCK_J_S = 6.62607015e-34
"""Planck constant, exact in the SI of 2019."""
LIGHT_M_S = 299792458.0
"""Speed of light in vacuum, exact in the SI."""
LARGEST = 1e100
"""UpperBound of a curve's values, in any unit. Products of larger values overflow."""
LEAST_PEAK = 1e-100
"""Least peak of a curve that is not 0; its other values may be as small as they like."""
_GRID_SLACK = 1e-9
_MOST_STEPS = 20_000


class WavelengthGrid(Section):
    """Equidistant wavelengths; each node stands for a bin of `step_nm` centered on it, the ends for half a bin.

    So a flat spectrum of height 1 integrates to `stop_nm` - `start_nm`, whatever the step.
    """

    start_nm: Positive = 400.0
    """First wavelength, nm."""
    stop_nm: Positive = 700.0
    """Last wavelength, nm."""
    step_nm: Positive = 1.0
    """Step, nm."""

    @model_validator(mode="after")
    def _whole_steps(self) -> WavelengthGrid:
        steps = (self.stop_nm - self.start_nm) / self.step_nm
        if not self.start_nm < self.stop_nm:
            raise ValueError(f"start_nm {self.start_nm:g} must be below stop_nm {self.stop_nm:g}")
        if not 200 <= self.start_nm < self.stop_nm <= 2000:
            raise ValueError("wavelengths must be in nm, between 200 and 2000")
        if steps > _MOST_STEPS:
            raise ValueError(f"step_nm {self.step_nm:g} is too fine: at most {_MOST_STEPS} steps")
        if round(steps) < 1 or not abs(steps - round(steps)) < 1e-6:
            raise ValueError(
                f"step_nm {self.step_nm:g} must divide stop_nm - start_nm = {self.stop_nm - self.start_nm:g}"
            )
        return self

    @property
    def size(self) -> int:
        """Number of nodes."""
        return round((self.stop_nm - self.start_nm) / self.step_nm) + 1

    @property
    def nodes_nm(self) -> PerWavelength:
        """Wavelengths, nm."""
        return self.start_nm + self.step_nm * np.arange(self.size, dtype=float)

    @property
    def span_nm(self) -> float:
        """Width of the range, nm."""
        return self.stop_nm - self.start_nm

    @property
    def bins_nm(self) -> PerWavelength:
        """Width of the bin of each node, nm; their sum is the range."""
        bins = np.full(self.size, self.step_nm)
        bins[[0, -1]] /= 2
        return bins

    def integrate(self, values: Float[Array, "*batch nodes"]) -> SameShape:
        """Sum value times bin width over the last axis.

        Parameters
        ----------
        values : ndarray of shape (..., size)
            Values.

        Returns
        -------
        ndarray of shape (...)
            Integrals.
        """
        return np.asarray(values @ self.bins_nm, dtype=float)


@dataclass(frozen=True)
class Unit:
    """What a head says of its numbers: words for messages, quantity, factor to plain numbers, and why it is unclear.

    `loss`: dB of a loss are positive. `group`: file of a folder, whose numbers have one scale.
    """

    words: str = ""
    quantity: Quantity | None = None
    factor: float | None = None
    unclear: str = ""
    loss: bool = False
    group: str = ""

    def over(self, other: Unit) -> Unit:
        """Return this unit, completed by one of the whole table."""
        if not other.words or (self.unclear and not (self.unclear.startswith("does not") and other.quantity)):
            return self
        if self.quantity and other.quantity and self.quantity != other.quantity:
            return Unit(f"{self.words}, {other.words}", unclear="contradicts itself")
        quantity, factor = self.quantity or other.quantity, self.factor if self.factor is not None else other.factor
        words = ", ".join(dict.fromkeys(filter(None, (self.words, other.words))))
        return Unit(words, quantity, factor, other.unclear if quantity is None else "", self.loss or other.loss)


@dataclass(frozen=True)
class Curves:
    """Named curves on common wavelengths, nm, as they came from `source`; NaN beyond the samples of a curve.

    `notes`: on the way a file was read. `units`: what the heads of its columns say.
    """

    wavelength_nm: PerWavelength
    values: Mapping[str, PerWavelength]
    source: str
    surrogate: bool = False
    notes: tuple[str, ...] = ()
    units: Mapping[str, Unit] = field(default_factory=dict)

    def samples(self, name: str) -> tuple[PerSample, PerSample]:
        """Return wavelengths, nm, and values of a curve between its first and last sample."""
        known = np.isfinite(self.values[name])
        return self.wavelength_nm[known], self.values[name][known]

    def on(
        self, grid: WavelengthGrid, name: str, method: Resampling = "linear", outside: Outside = "refuse"
    ) -> PerWavelength:
        """Resample a curve to a grid; see `resample`.

        `outside`: values beyond the samples.
        """
        try:
            return resample(*self.samples(name), grid, method, outside)
        except DataError as error:
            raise DataError(
                [ValidationIssue(f.problem, self.source, None, name, f.value, f.allowed) for f in error.issues]
            ) from None


def _wavelength_issues(wave: PerSample) -> Iterator[ValidationIssue]:
    if not np.isfinite(wave).all():
        yield ValidationIssue("wavelength is not a finite number", allowed="finite nm")
        return
    step = np.diff(wave)
    if (step == 0).any():
        twice = float(wave[1:][step == 0][0])
        yield ValidationIssue("wavelength occurs twice", value=twice, allowed="strictly increasing")
    elif not (step > 0).all():
        first = float(wave[1:][step < 0][0])
        yield ValidationIssue("wavelengths are not sorted", value=first, allowed="strictly increasing")
    if not (wave[0] >= 100 and wave[-1] <= 20000):
        hints = ((1e-4, "looks like m"), (20.0, "looks like um"), (np.inf, "not optical wavelengths in nm"))
        hint = next(hint for below, hint in hints if not wave[-1] >= below)
        yield ValidationIssue(
            f"wavelength unit: {hint}", value=(float(wave[0]), float(wave[-1])), allowed="100 to 20000 nm"
        )


def _value_issues(wave: PerSample, data: PerSample) -> Iterator[ValidationIssue]:
    bad = ~np.isfinite(data)
    if bad.any():
        yield ValidationIssue(
            f"value at {wave[bad][0]:g} nm is not a finite number", value=float(data[bad][0]), allowed=">= 0"
        )
    elif (data < 0).any():
        at = int(np.argmax(data < 0))
        yield ValidationIssue(f"negative value at {wave[at]:g} nm", value=float(data[at]), allowed=">= 0")
    elif data.max() > LARGEST:
        at, allowed = int(np.argmax(data)), f"0 to {LARGEST:g}"
        yield ValidationIssue(f"value at {wave[at]:g} nm is too large", value=float(data[at]), allowed=allowed)
    elif 0 < data.max() < LEAST_PEAK:
        allowed = f"0 everywhere, or {LEAST_PEAK:g} or more somewhere"
        yield ValidationIssue("the largest value is too small", value=float(data.max()), allowed=allowed)


def check_samples(wavelength_nm: ArrayLike, values: ArrayLike, *, signed: bool = False) -> tuple[PerSample, PerSample]:
    """Check samples of a curve.

    Raises DataError: with one issue for everything that is wrong.
    """
    wave = np.asarray(wavelength_nm, dtype=float)
    data = np.asarray(values, dtype=float)
    if wave.ndim != 1 or data.shape != wave.shape or wave.size < 2:
        raise DataError(
            ValidationIssue(
                "a curve needs two or more samples, one value per wavelength", value=(wave.shape, data.shape)
            )
        )
    issues = [*_wavelength_issues(wave), *_value_issues(wave, np.abs(data) if signed else data)]
    if issues:
        raise DataError(issues)
    return wave, data


def sample_issues(
    file: str, wave: PerSample, names: Sequence[str], data: Float[Array, "samples curves"], signed: Container[int] = ()
) -> list[list[ValidationIssue]]:
    """Return the issues of the curves of a file, by `check_samples`; `signed`: curves in dB."""
    groups = []
    for index, name in enumerate(names):
        try:
            known = np.isfinite(data[:, index])
            check_samples(wave[known], data[known, index], signed=index in signed)
        except DataError as error:
            groups.append([ValidationIssue(f.problem, file, None, name, f.value, f.allowed) for f in error.issues])
    return groups


def resample(
    wavelength_nm: ArrayLike,
    values: ArrayLike,
    grid: WavelengthGrid,
    method: Resampling = "linear",
    outside: Outside = "refuse",
) -> PerWavelength:
    """Bring a sampled curve to a grid.

    `linear` is the value of the piecewise linear interpolant at each node. `mean` is its exact mean over each bin,
    which keeps the integral (of bins inside the samples) if the source is finer than the grid. Splines are not
    offered: they ring below zero at LED peaks.

    `outside`: if the samples end inside the grid: an error, or 0. Raises DataError if samples are not clean, or end
    inside the grid with `refuse`.
    """
    wave, data = check_samples(wavelength_nm, values)
    nodes = grid.nodes_nm
    slack = _GRID_SLACK * grid.stop_nm
    if outside == "refuse" and (wave[0] > nodes[0] + slack or wave[-1] < nodes[-1] - slack):
        raise DataError(
            ValidationIssue(
                "the curve is truncated: it does not cover the wavelength grid",
                value=f"{wave[0]:g} to {wave[-1]:g} nm",
                allowed=f"at least {nodes[0]:g} to {nodes[-1]:g} nm, or `outside: zero`",
            )
        )
    if method == "linear":
        gridded = np.interp(nodes, wave, data, left=0.0, right=0.0)
        # A node that misses the first or last sample by rounding alone still takes that sample.
        gridded[np.abs(nodes - wave[0]) <= slack] = data[0]
        gridded[np.abs(nodes - wave[-1]) <= slack] = data[-1]
        return gridded
    low = np.clip(np.maximum(nodes - grid.step_nm / 2, nodes[0]), wave[0], wave[-1])
    high = np.clip(np.minimum(nodes + grid.step_nm / 2, nodes[-1]), wave[0], wave[-1])
    width = high - low
    area = _integral_to(wave, data, high) - _integral_to(wave, data, low)
    return np.asarray(np.divide(area, width, out=np.zeros_like(area), where=width > 0), dtype=float)


def integral_between(wavelength_nm: PerWavelength, values: PerWavelength, low_nm: float, high_nm: float) -> float:
    """Return the integral of a curve, linear between its samples and 0 beyond them."""
    ends = np.clip(np.array([low_nm, high_nm]), wavelength_nm[0], wavelength_nm[-1])
    return float(np.diff(_integral_to(wavelength_nm, values, ends))[0])


def _integral_to(wave: PerSample, data: PerSample, at: Float[Array, " at"]) -> Float[Array, " at"]:
    """Return the integral of the piecewise linear interpolant from the first sample to `at`."""
    cumulative = np.concatenate([[0.0], np.cumsum(np.diff(wave) * (data[1:] + data[:-1]) / 2)])
    index = np.clip(np.searchsorted(wave, at, side="right") - 1, 0, wave.size - 2)
    part = at - wave[index]
    slope = (data[index + 1] - data[index]) / (wave[index + 1] - wave[index])
    return np.asarray(cumulative[index] + part * (data[index] + slope * part / 2), dtype=float)


def photons_from_energy(
    wavelength_nm: PerWavelength, energy: Float[Array, "*batch wavelengths"]
) -> Float[Array, "*batch wavelengths"]:
    """Convert spectral radiant energy to photons: Q lambda / (h c) (Planck).

    `energy`: energy per nm.
    """
    return energy * (wavelength_nm * 1e-9) / (PLANCK_J_S * LIGHT_M_S)


def energy_from_photons(
    wavelength_nm: PerWavelength, photons: Float[Array, "*batch wavelengths"]
) -> Float[Array, "*batch wavelengths"]:
    """Convert photons to spectral radiant energy: Q h c / lambda (Planck).

    `photons`: photons per nm. Returns energy per nm.
    """
    return photons * (PLANCK_J_S * LIGHT_M_S) / (wavelength_nm * 1e-9)


def equal_photons(
    grid: WavelengthGrid, photons: Float[Array, "*batch wavelengths"]
) -> Float[Array, "*batch wavelengths"]:
    """Scale spectra to an integral of one photon.

    Raises DataError if a spectrum has no photons on the grid.
    """
    total = grid.integrate(photons)
    if not (total >= LEAST_PEAK).all():
        raise DataError(
            ValidationIssue(
                "a light has no photons on the wavelength grid",
                allowed=f"{grid.start_nm:g} to {grid.stop_nm:g} nm",
            )
        )
    return photons / total[..., None]


def linear_basis(at: Float[Array, " at"], knots: PerKnot) -> Float[Array, "knots at"]:
    """Return the linear basis of interpolation between knots; constant beyond the ends.

    `knots`: knots, ascending. Any f of values at the knots is f @ weights at the points.
    """
    if knots.size == 1:
        return np.ones((1, at.size))
    left = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, knots.size - 2)
    share = np.clip(1 / np.diff(knots)[left] * (at - knots[left]), 0.0, 1.0)
    share[at >= knots[-1]] = 1.0
    weights, points = np.zeros((knots.size, at.size)), np.arange(at.size)
    weights[left, points], weights[left + 1, points] = 1 - share, share
    return weights
