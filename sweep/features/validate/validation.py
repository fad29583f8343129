"""The fit of readings by lamps and places, and the separation of lamps that follows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd

from ...base.types import Array, Float
from ...camera.model import scene_model
from ...camera.setup import Setup
from ...spectra.lights import Pair
from .bench import ODD, Fit, Mended

_SIGMAS = 1.96
_USUAL = ("yellow", "red")


class Separation(NamedTuple):
    """Separation of two signal types as measured, with the half width of its 95 % interval, and as predicted, DN."""

    types: Pair
    measured_dn: float
    half_width_dn: float
    predicted_dn: float


@dataclass(frozen=True)
class Validation:
    """A fit, and its tables."""

    fit: Fit

    @cached_property
    def rows(self) -> pd.DataFrame:
        """All readings, with what is predicted of those that count, and why others do not."""
        bench = self.fit.bench
        mean, _ = bench.moments(self.fit.unknowns)
        counted = bench.table.assign(predicted_dn=mean, uncertainty_dn=self.fit.sigma_dn)
        counted["residual_dn"] = counted["dn"] - mean
        counted["signal_dn"] = mean - self.fit.unknowns[0]
        return pd.concat([counted, bench.left_out]).sort_values("line")

    @cached_property
    def shown(self) -> pd.DataFrame:
        """Brightest reading of each light and place; mean residual of all, relative to the signal, and its sigma."""
        lit = self.rows[self.rows["light"] >= 0].astype({"light": int})
        weight = (lit["signal_dn"] / lit["uncertainty_dn"]) ** 2
        lit = lit.assign(weight=weight, part=lit["residual_dn"] / lit["signal_dn"] * weight)
        groups = lit.groupby(["light", "place"], sort=False)
        total = groups[["weight", "part"]].sum()
        brightest = lit.loc[groups["signal_dn"].idxmax()].set_index(["light", "place"])
        return brightest.assign(residual=total["part"] / total["weight"], sigma=1 / np.sqrt(total["weight"]))

    @cached_property
    def within(self) -> float:
        """Largest residual of a reading, relative to its signal."""
        return float((self.rows["residual_dn"] / self.rows["signal_dn"])[self.rows["light"] >= 0].abs().max())

    @property
    def mended(self) -> Mended | None:
        """Change of one curve that mends most; None where readings fit, or where no change is more than chance."""
        return self.fit.mended if self.fit.p < ODD and self.fit.mended.gained > 0 else None

    @cached_property
    def corrected(self) -> Setup:
        """The first scene with the curves and the pixel that fit best."""
        bench, (black, gain, shift_nm, crosstalk) = self.fit.bench, self.fit.unknowns[:4]
        numbers = {"gain_dn_per_e": gain, "offset_dn": black, "crosstalk": crosstalk}
        pixel = bench.pixel.model_copy(update=numbers)
        return bench.setup.with_camera(qe=bench.bare * bench.moved(shift_nm), pixel=pixel)

    @cached_property
    def separation(self) -> Separation | None:
        """Separation of the lamps that were read in all channels, as bright as in the first scene; None without."""
        setup, study = self.corrected, self.fit.bench.study
        if setup.scene.target is not None:
            return None
        dn, _ = scene_model(setup).read(np.empty((1, 0, study.grid.size)))
        shown, n = self.shown.reset_index(), len(setup.camera.qe)
        lamps: dict[str, list[Float[Array, "3 channels"]]] = {}
        for (lamp, _), group in shown[shown["place"] < n].sort_values("place").groupby(["lamp", "light"]):
            if len(group) == n and lamp in study.lights.names:
                at = study.lights.names.index(lamp)
                signal = dn[0, 0, at] - setup.camera.pixel.offset_dn
                vectors = signal, signal * (1 + group["residual"]), signal * group["sigma"]
                lamps.setdefault(study.lights.types[at], []).append(np.stack(vectors))
        pairs = [pair for pair in study.pairs if {*pair} <= lamps.keys()]
        if not pairs:
            return None
        pair = _USUAL if _USUAL in pairs else pairs[0]
        apart = [(one - other, np.hypot(one[2], other[2])) for one, other in product(*(lamps[kind] for kind in pair))]
        predicted = min(float(np.linalg.norm(vectors[0])) for vectors, _ in apart)
        nearest, sigma = min(apart, key=lambda of: float(np.linalg.norm(of[0][1])))
        measured = float(np.linalg.norm(nearest[1]))
        error = float(np.linalg.norm(nearest[1] * sigma)) / max(measured, 1e-9)
        return Separation(pair, measured, _SIGMAS * error, predicted)
