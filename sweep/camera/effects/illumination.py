"""Relative illumination: off axis, a lens without vignetting gives cos^4 of the light."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from ...base.types import FloatArray
from ..shot import Shot
from .base import Change, Designs, LightEffect, SceneOptions, ShareChange


class Options(SceneOptions):
    """`off_axis_deg`: the field angle."""

    off_axis_deg: float = Field(default=0.0, ge=0, lt=90)


class Illumination(LightEffect):
    """The same share of the light at all wavelengths, of the background, too."""

    name = "illumination"
    methods = ("skip", "cos4")
    order = 2
    Options = Options

    def exact(self, shot: Shot) -> str | None:
        """Only off axis there is less light."""
        return "on axis" if Options.of(shot.scenario).off_axis_deg == 0 else None

    def share(self, shot: Shot, method: str) -> float:
        """cos^4 of the field angle, or 1."""
        return 1.0 if method == "skip" else math.cos(math.radians(Options.of(shot.scenario).off_axis_deg)) ** 4

    def transmittance(self, shot: Shot, method: str, wavelength_nm: FloatArray) -> FloatArray:
        """`share` at every wavelength, ndarray[n_wavelengths]."""
        return np.full(wavelength_nm.size, self.share(shot, method))

    def change(self, shot: Shot, before: str, after: str, designs: Designs, *, straight: bool) -> Change:
        """One share, whatever the wavelength."""
        return ShareChange(1 - self.share(shot, after) / self.share(shot, before), of_background=True)
