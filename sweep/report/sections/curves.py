"""The sensor's curves and the lamps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Float
from ...results.output import Output
from ..look import CHANNELS, DIM
from ..panels import Curves, Picture
from ..section import Section
from ..terms import response_of
from .trade_off import lamp_areas

Values = Float[Array, " wavelengths"]


@dataclass(frozen=True)
class SensorCurves(Section):
    """QE of the sensor over the lamps."""

    sensor: str
    lights: str
    wavelength_nm: Values
    curves: Mapping[str, Values]
    lamps: Mapping[str, Values]
    counts: Mapping[str, int]

    heading = "Sensor and lamps"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for every run."""
        facts = output.provenance
        counts = {kind: len(photons) for kind, photons in output.curves.bundles.items()}
        yield cls(
            facts.sensor.name,
            facts.lights.name,
            output.curves.wavelength_nm,
            output.curves.sensor,
            lamp_areas(output),
            counts,
        )

    @property
    def picture(self) -> Picture | None:
        """All curves over the lamps."""
        colors = {name: CHANNELS.get(name, DIM) for name in self.curves}
        panel = Curves(
            response_of(self.curves),
            self.wavelength_nm,
            {n: np.asarray(c) for n, c in self.curves.items()},
            self.lamps,
            colors,
            height=230,
        )
        lamps = ", ".join(f"{count} {kind}" for kind, count in self.counts.items())
        return Picture(
            (panel,),
            f"The sensor's {response_of(self.curves)} over the lamps.",
            f"Sensor {self.sensor}; lamps {self.lights} ({lamps}): areas, largest photon spectrum of each color.",
        )
