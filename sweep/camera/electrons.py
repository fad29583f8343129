"""Expected electrons per second of the pixels of a scene, for a batch of designs; nothing is clipped or noisy yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.types import Array, DesignCurves, Float, IndexArray, Int
from .image import Image
from .place import Position
from .readout import Exposure
from .setup import Setup

Lit = Float[Array, "elements designs signals"]
Dark = Float[Array, "elements designs"]


@dataclass(frozen=True, eq=False)
class View:
    """Cases of a scene at one image height: lamps and filters there, and the image on the pixels.

    `known`: what `fixed` returns for each exposure.
    """

    setup: Setup
    position: Position
    image: Image
    known: dict[Exposure, tuple[Float[Array, "elements 1 signals"], Float[Array, "elements 1"]]] = field(
        default_factory=dict
    )

    def subset(self, cases: Int[IndexArray, " cases"]) -> View:
        """Return the view of some cases."""
        image, used = self.image.subset(cases)
        return replace(self, image=image, known={of: (lit[used], dark[used]) for of, (lit, dark) in self.known.items()})

    def lit(self, qe: DesignCurves, channels: Sequence[int], exposure: Exposure) -> Lit:
        """Return electrons/s of each signal behind some filters alone."""
        rates = self.position.lit(exposure.seen(qe, channels), channels, self.image.shares)
        lit = self.image.lit(rates, channels, exposure.crosstalk)
        return lit.reshape(len(lit), len(qe), -1)

    def background(self, qe: DesignCurves, channels: Sequence[int], exposure: Exposure) -> Dark:
        """Return electrons/s of the background behind some filters alone."""
        if not self.position.has_background:
            return np.zeros((self.image.channel.size, len(qe)))
        rates = self.position.of_background(exposure.seen(qe, channels), channels)
        return self.image.uniform(rates, channels, exposure.crosstalk)

    def fixed(self, exposure: Exposure) -> tuple[Float[Array, "elements 1 signals"], Float[Array, "elements 1"]]:
        """Return electrons/s behind the filters that no design modifies: of the signals, and without them."""
        if exposure not in self.known:
            camera = self.setup.camera
            behind = camera.qe[None, list(camera.fixed)], camera.fixed, exposure
            self.known[exposure] = self.lit(*behind), self.background(*behind) + camera.pixel.dark_e_per_s
        return self.known[exposure]

    def rates(self, curves: DesignCurves, exposure: Exposure) -> Lit:
        """Return electrons/s of each signal."""
        lit = self.lit(curves, self.setup.camera.modified, exposure)
        lit += self.fixed(exposure)[0]
        return lit

    def unlit(self, curves: DesignCurves, exposure: Exposure) -> Dark:
        """Return electrons/s without lamps: of the background, and dark current."""
        return self.background(curves, self.setup.camera.modified, exposure) + self.fixed(exposure)[1]
