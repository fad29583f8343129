"""Expected electrons per second of the pixels of a scene, for a batch of designs; nothing is clipped or noisy yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.types import Array, DesignCurves, Float, IndexArray, Int
from .image import Image
from .place import Position
from .readout import CaptureLight, Exposure
from .setup import Setup

Lit = Float[Array, "elements designs signals"]
Dark = Float[Array, "elements designs"]


@dataclass(frozen=True, eq=False)
class View:
    """Cases of a scene at one image height: lamps and filters there, and the image on the pixels.

    `fixed`: electrons/s behind the filters that no design modifies, of signals and background, for each exposure.
    """

    setup: Setup
    position: Position
    image: Image
    fixed: dict[Exposure, tuple[Float[Array, "elements signals"], Float[Array, "elements 1"]]] = field(
        default_factory=dict
    )

    def subset(self, cases: Int[IndexArray, " cases"]) -> View:
        """Return the view of some cases."""
        image, used = self.image.subset(cases)
        return replace(self, image=image, fixed={of: (lit[used], dark[used]) for of, (lit, dark) in self.fixed.items()})

    def added(self, curves: DesignCurves, exposure: Exposure, channels: Sequence[int]) -> tuple[Lit, Dark]:
        """Return electrons/s of each signal, and of the background, behind some filters alone."""
        qe = curves if exposure.plain else curves * exposure.factors[list(channels), None]
        rates, background = self.position.rates(qe, channels, self.image.shares)
        lit = self.image.lit(rates, channels, exposure.crosstalk)
        return lit.reshape(len(lit), len(curves), -1), self.image.uniform(background, channels, exposure.crosstalk)

    def fixed_rates(self, exposure: Exposure) -> tuple[Float[Array, "elements signals"], Float[Array, "elements 1"]]:
        """Return electrons/s in the channels that no design modifies: of the signals, and without them."""
        camera = self.setup.camera
        if exposure not in self.fixed:
            lit, dark = self.added(camera.qe[None, list(camera.fixed)], exposure, camera.fixed)
            self.fixed[exposure] = lit[:, 0], dark + camera.pixel.dark_e_per_s
        return self.fixed[exposure]

    def rates(self, curves: DesignCurves, exposure: Exposure) -> tuple[Lit, Dark]:
        """Return electrons/s of each signal, and without lamps: of the background, and dark current."""
        fixed_lit, fixed_dark = self.fixed_rates(exposure)
        lit, dark = self.added(curves, exposure, self.setup.camera.modified)
        lit += fixed_lit[:, None]
        dark += fixed_dark
        return lit, dark

    def capture_light(self, exposures: Sequence[Exposure]) -> CaptureLight:
        """Return the light of exposures on the elements, relative to a pixel of full sensitivity."""
        return np.stack([exposure.light * exposure.factors[self.image.channel] for exposure in exposures])
