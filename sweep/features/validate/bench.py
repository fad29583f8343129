"""A camera before uniform lights: what it should read, and the unknowns with which that is nearest to what it read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ...base.errors import DataError, ValidationIssue
from ...base.types import Array, Bool, BoolArray, Float, PerFree, PerWavelength
from ...camera.pixel import Pixel, unquantized
from ...camera.setup import Setup
from ...study import Study

UNKNOWNS = {
    "black": ("black level", "DN", "readings of the lamp `dark`, or of a lamp at two exposures"),
    "gain": ("gain", "DN/e", "`sigma_dn` and `pixels`, or an irradiance"),
    "shift": ("shift of the IR cut", "nm", "lamps with light where the IR cut falls"),
    "crosstalk": ("crosstalk", "%", "more lamps, or channels"),
    "read_noise": ("read noise", "e", "`sigma_dn` and `pixels` of dark readings"),
}
"""What is fitted beside the light of each lamp: in words, its unit, and what tells it."""
_N = len(UNKNOWNS)
ODD = 0.01
"""Probability of the residuals below which the readings do not fit the model."""
_ROUNDS = 3
_MOST_SHIFT_NM, _MOST_ERROR_NM = 50.0, 2.0
"""Largest shift, and largest standard deviation of one: an interval as wide as the edge of the IR cut says nothing."""
_UNTOLD, _PART = 1e-6, 0.1
"""Least singular value of the readings' derivatives, relative to the largest; least part of an untold unknown in it."""
_DITHERED_DN = 0.7
"""Noise from which on rounding adds 1/12 DN^2 to its variance, whatever the mean."""
_BAND_NM, _CHANGE = 20.0, 0.05
"""Width of the bands in which a QE may be wrong, and by how much it usually is."""
_FAR_BETTER = 0.05
"""Share of the misfit that is left where channels were exchanged in the table."""
_Readings = Float[Array, " readings"]
_Residuals = Float[Array, " residuals"]
_All = Float[Array, " unknowns"]
"""Black level, DN; gain, DN/e; shift, nm; crosstalk; variance of the read noise, e^2; photons/s of each light."""


def tells_noise(table: pd.DataFrame) -> Bool[BoolArray, " readings"]:
    """Return which readings tell the noise of a value."""
    return np.asarray((table["sigma_dn"] >= _DITHERED_DN) & (table["pixels"] * table["frames"].fillna(1) > 1))


def _step(numbers: _Readings) -> float:
    """Return the step to which all numbers of a column are rounded; 0 for none."""
    steps = (step for step in (1.0, 0.1, 0.01) if np.allclose(numbers / step, np.rint(numbers / step), 0, 1e-6))
    return next(steps, 0.0)


@dataclass(frozen=True)
class Bench:
    """Readings that count, and the camera that they are of.

    `table`: readings with numbers of light, -1 for the dark, and place; `left_out`: other readings; `lights`: names;
    `photons`: spectra of the lights, which integrate to 1, times the bins; `bare`: curves without the IR cut, as they
    are, and `seen`, as each light sees them in the cone of rays of its scene; `cut`: transmission of the IR cut,
    1 where none is known; `own`, `around`: shares of the channels in the light of a place that comes through its own
    filter, and through those of its neighbors; `first`: unknowns as the study or the table say them; `free`: those that
    are fitted.
    """

    study: Study
    setup: Setup
    table: pd.DataFrame
    left_out: pd.DataFrame
    lights: Sequence[str]
    photons: Float[Array, "lights wavelengths"]
    bare: Float[Array, "channels wavelengths"]
    seen: Float[Array, "lights channels wavelengths"]
    cut: PerWavelength
    own: Float[Array, "places channels"]
    around: Float[Array, "places channels"]
    first: _All
    free: Bool[BoolArray, " unknowns"]

    @property
    def pixel(self) -> Pixel:
        """Pixel of the study."""
        return self.setup.camera.pixel

    @property
    def names(self) -> list[str]:
        """Names of all unknowns."""
        return [*UNKNOWNS, *self.lights]

    @cached_property
    def arrays(self) -> dict[str, np.ndarray]:
        """Columns of the readings."""
        columns = {str(name): column.to_numpy() for name, column in self.table.items()}
        counts = {name: np.fmax(columns[name].astype(float), 1) for name in ("pixels", "frames")}
        return columns | counts | {"noise": tells_noise(self.table)}

    def with_fitted(self, x: PerFree) -> _All:
        """Return all unknowns from those that are fitted."""
        unknowns = self.first.copy()
        unknowns[self.free] = x
        return unknowns

    def moved(self, shift_nm: float) -> PerWavelength:
        """Return the transmission of the IR cut, shifted to longer wavelengths."""
        wave = self.study.grid.nodes_nm
        return np.asarray(np.maximum(self._spline(np.clip(wave - shift_nm, wave[0], wave[-1])), 0.0), dtype=float)

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import)

        return CubicSpline(self.study.grid.nodes_nm, self.cut)

    def lit(self, unknowns: _All, seen: Float[Array, "lights channels"]) -> _Readings:
        """Return electrons of the lamps in the readings, from what channels see of a photon of them."""
        crosstalk, of = unknowns[3], self.arrays
        places = seen @ ((1 - crosstalk) * self.own + crosstalk * self.around).T
        rates = np.vstack([places * unknowns[_N:, None], np.zeros(len(self.own))])  # the last row is that of number -1
        return np.asarray(rates[of["light"], of["place"]] * of["exposure_s"])

    def moments(self, unknowns: _All) -> tuple[_Readings, _Readings]:
        """Return mean and variance of the values of the readings."""
        black, gain, shift_nm, _, read_e2 = unknowns[:_N]
        seen = np.einsum("lw,lcw->lc", self.photons * self.moved(shift_nm), self.seen)
        electrons = self.lit(unknowns, seen) + self.pixel.dark_e_per_s * self.arrays["exposure_s"]
        mean = unquantized(electrons, self.pixel.model_copy(update={"gain_dn_per_e": gain, "offset_dn": black}))
        return mean, gain**2 * (electrons + read_e2) + 1 / 12

    def sigma_dn(self, unknowns: _All) -> _Readings:
        """Return the standard deviation of the means: noise, unequal gains, rounding of readings and of the table."""
        mean, variance = self.moments(unknowns)
        of, unequal = self.arrays, (self.pixel.prnu * (mean - unknowns[0])) ** 2  # alike in all frames of a pixel
        rounding = np.exp(-4 * np.pi**2 * (variance - 1 / 12)) / (2 * np.pi**2) + _step(of["dn"]) ** 2 / 12
        return np.asarray(np.sqrt((variance / of["frames"] + unequal) / of["pixels"] + rounding))

    def residuals(self, x: PerFree, sigma_dn: _Readings, variance_dn2: _Readings) -> _Residuals:
        """Return what is left of means, then of variances, whose cube root is nearly normal (Wilson, Hilferty 1931).

        `sigma_dn`, `variance_dn2`: their weights, which stay while unknowns change, or large noise would weigh less.
        """
        mean, variance = self.moments(self.with_fitted(x))
        of, at = self.arrays, self.arrays["noise"]
        frames, noise_dn = of["frames"][at], of["sigma_dn"][at]
        freedom = np.where(frames > 1, of["pixels"][at] * (frames - 1), of["pixels"][at] - 1)
        spread, weight = 2 / (9 * freedom), np.cbrt(variance_dn2[at])
        rounding = (_step(noise_dn) / noise_dn) ** 2 / 27
        of_noise = (np.cbrt(noise_dn**2) - np.cbrt(variance[at]) * (1 - spread)) / weight / np.sqrt(spread + rounding)
        return np.concatenate([(of["dn"] - mean) / sigma_dn, of_noise])

    @cached_property
    def start(self) -> _All:
        """Unknowns as they are said, and lights with which each lamp is as bright as it was read."""
        unit = np.where(self.free & (np.arange(self.first.size) >= _N), 1.0, self.first)
        mean, _ = self.moments(unit)
        unit_dn, read_dn = mean - unit[0], np.maximum(self.arrays["dn"] - unit[0], 0.5)
        for at in np.flatnonzero(self.free[_N:]):
            mine = self.arrays["light"] == at
            unit[_N + at] = unit_dn[mine] @ read_dn[mine] / max(unit_dn[mine] @ unit_dn[mine], 1e-99)
        return unit

    def exchanged(self) -> tuple[int, int] | None:
        """Return two channels whose readings are far more alike those of the study when exchanged."""
        n, best = self.own.shape[1], (_FAR_BETTER * self._misfit, (-1, -1))
        for one, other in combinations(range(n), 2):
            order = np.arange(n)
            order[[one, other]] = other, one
            exchanged = replace(self, own=self.own[:, order], around=self.around[:, order])
            best = min(best, (exchanged._misfit, (one, other)))
        return None if best[1][0] < 0 else best[1]

    @property
    def _misfit(self) -> float:
        mean, variance = self.moments(self.start)
        return float(np.sum((self.arrays["dn"] - mean) ** 2 / variance))

    def fitted(self) -> Fit:
        """Return the fit; raises DataError for an unknown that the readings do not tell."""
        from scipy.optimize import least_squares  # noqa: PLC0415  (slow to import)

        low = np.array([-np.inf, 1e-9, -_MOST_SHIFT_NM, *np.zeros(self.first.size - 3)])[self.free]
        high = np.array([np.inf, np.inf, _MOST_SHIFT_NM, 0.8, *np.full(self.first.size - 4, np.inf)])[self.free]
        x = np.clip(self.start[self.free], low, high)
        if x.size >= len(self.table) + self.arrays["noise"].sum():
            problem = "as many unknowns as readings: nothing is left to check"
            raise DataError(ValidationIssue(problem, value=x.size, allowed="more readings, or unknowns to hold"))
        for _ in range(_ROUNDS):
            sigma_dn = self.sigma_dn(self.with_fitted(x))
            weights = sigma_dn, self.moments(self.with_fitted(x))[1]
            found = least_squares(self.residuals, x, "3-point", (low, high), x_scale="jac", args=weights)
            x = found.x
        self._refuse_untold(found.jac)
        return Fit(self, x, found.fun, found.jac, sigma_dn)

    def _refuse_untold(self, jacobian: Float[Array, "residuals free"]) -> None:
        """Raise DataError for unknowns that others can replace in all readings."""
        numbers, size = np.flatnonzero(self.free), np.linalg.norm(jacobian, axis=0)
        rows = np.vstack([jacobian / np.where(size > 0, size, 1), np.zeros((size.size, size.size))])  # as many, or more
        _, singular, directions = np.linalg.svd(rows, full_matrices=False)
        untold = numbers[size == 0].tolist()
        for direction in directions[singular <= _UNTOLD * singular[0]]:
            untold += numbers[np.abs(direction) > _PART][:1].tolist()
        if not untold and self.free[2]:
            variances = np.diag(np.linalg.inv(jacobian.T @ jacobian))
            untold += numbers[(numbers == 2) & (variances > _MOST_ERROR_NM**2)].tolist()
        lit = self.table[self.table["light"] >= 0]
        exposures = lit.groupby(["light", "place"])["exposure_s"].nunique()
        if self.free[0] and len(lit) == len(self.table) and not (exposures > 1).any():
            untold.append(0)
        if untold:
            raise DataError([self._untold(number) for number in dict.fromkeys(untold)])

    def _untold(self, number: int) -> ValidationIssue:
        name = self.names[number]
        if name not in UNKNOWNS:
            allowed = "an irradiance, or brighter readings"
            return ValidationIssue("the readings do not tell its light", key=name, allowed=allowed)
        words, _, tells = UNKNOWNS[name]
        return ValidationIssue(
            f"the readings do not tell the {words}", key=name, allowed=f"{tells}; or hold it (--hold {name})"
        )


class Mended(NamedTuple):
    """Change of a channel's QE: chi-square that it takes away, less what chance takes, and what it leaves.

    `middle_nm`, `change`: middle of the band that does most, and relative change there.
    """

    gained: float
    channel: int
    middle_nm: float
    change: float
    chi2_left: float


@dataclass(frozen=True)
class Fit:
    """What fits best; residuals over `sigma_dn`, and their derivatives."""

    bench: Bench
    x: PerFree
    residuals: _Residuals
    jacobian: Float[Array, "residuals free"]
    sigma_dn: _Readings

    @cached_property
    def unknowns(self) -> _All:
        """All unknowns, fitted or not."""
        return self.bench.with_fitted(self.x)

    @property
    def freedom(self) -> int:
        """Degrees of freedom."""
        return self.residuals.size - self.x.size

    @property
    def chi2(self) -> float:
        """Chi-square: the sum of the squared residuals."""
        return float(self.residuals @ self.residuals)

    @cached_property
    def p(self) -> float:
        """Probability of a larger chi-square where the model is right."""
        from scipy.stats import chi2  # noqa: PLC0415  (slow to import)

        return float(chi2.sf(self.chi2, self.freedom))

    @cached_property
    def values(self) -> dict[str, tuple[float, float, float]]:
        """Value of each unknown and the ends of its 95 % interval, NaN where it is held.

        Where the readings do not fit the model, intervals are wider by what it leaves.
        """
        from scipy.stats import t  # noqa: PLC0415  (slow to import)

        more, half = self.chi2 / self.freedom if self.p < ODD else 1.0, np.full(self.unknowns.size, np.nan)
        variances = np.diag(np.linalg.inv(self.jacobian.T @ self.jacobian)) * more
        half[self.bench.free] = np.sqrt(variances) * t.ppf(0.975, self.freedom)
        ends = np.stack([self.unknowns, self.unknowns - half, self.unknowns + half])
        ends[1:, 3] = np.maximum(ends[1:, 3], 0.0)
        ends[:, 4] = np.sqrt(np.maximum(ends[:, 4], 0.0))
        return {name: tuple(ends[:, at].tolist()) for at, name in enumerate(self.bench.names)}

    @cached_property
    def mended(self) -> Mended:
        """Change of one channel's QE that takes most of chi-square away.

        Changes of bands of 20 nm are independent, and 5 % of the QE each before anything is seen.
        """
        bench, wave = self.bench, self.bench.study.grid.nodes_nm
        told, _ = np.linalg.qr(self.jacobian)
        band = ((wave - wave[0]) // _BAND_NM).astype(int)
        n_bands, changes = band[-1] + 1, list[Mended]()
        light = (bench.photons * bench.moved(self.unknowns[2]))[:, None] * bench.seen
        for channel in range(bench.own.shape[1]):
            columns = np.zeros((self.residuals.size, n_bands))
            for at in range(n_bands):
                seen = np.zeros(light.shape[:2])
                seen[:, channel] = light[:, channel, band == at].sum(axis=1)
                columns[: self.sigma_dn.size, at] = self.unknowns[1] * bench.lit(self.unknowns, seen) / self.sigma_dn
            columns -= told @ (told.T @ columns)
            precision = columns.T @ columns + np.eye(n_bands) / _CHANGE**2
            change = np.linalg.solve(precision, columns.T @ self.residuals)
            taken = float(self.residuals @ columns @ change)
            gained = taken - float(np.linalg.slogdet(precision * _CHANGE**2)[1])
            best = int(np.argmax(np.abs(change) * np.linalg.norm(columns, axis=0)))
            middle_nm = float(wave[band == best].mean())
            changes.append(Mended(gained, channel, middle_nm, float(change[best]), self.chi2 - taken))
        return max(changes)
