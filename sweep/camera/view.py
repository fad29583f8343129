"""View of a block of designs: sensor, CFA, lights and scene, and how accurately the scene is simulated."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..curves.lights import Lights
from ..curves.spectrum import WavelengthGrid
from ..curves.tasks import StudyTasks
from ..designs.technology import Technology, index_of
from .accuracy import STANDARD, Accuracy
from .mosaic import Mosaic
from .own_effects import OwnEffect
from .pixel import Pixel
from .scene import Scene

READOUT = frozenset({"noise", "quantization", "saturation"})
"""Effects without which digital numbers are linear in electrons."""


@dataclass(frozen=True)
class View:
    """Sensor, CFA, lights and scene that a block of designs shares.

    `qe`: ndarray[n_channels, n_wavelengths] of the mosaic's channels, electrons per photon; the rows of `modified`
    (channel indices, one per curve that a family makes) hold the base curve. `clear_qe`: the reference of the CFA's
    sensitivity, ndarray[n_wavelengths]. `technologies`: by what each channel's filter works, None where that is not
    stated; empty where it is of none. `tasks`: what else the study asks of its designs. `accuracy`: numerical settings;
    `left_out`: effects that are not computed (see `effects`); `own_effects`: those of a user's own.
    """

    grid: WavelengthGrid
    mosaic: Mosaic
    qe: FloatArray
    modified: tuple[int, ...]
    clear_qe: FloatArray
    lights: Lights
    pixel: Pixel
    scenario: Scene
    technologies: tuple[Technology | None, ...] = field(default=(), kw_only=True)
    tasks: StudyTasks | None = field(default=None, kw_only=True)
    accuracy: Accuracy = field(default=STANDARD, kw_only=True)
    left_out: frozenset[str] = field(default=frozenset(), kw_only=True)
    own_effects: tuple[OwnEffect, ...] = field(default=(), kw_only=True)

    @property
    def base_qe(self) -> FloatArray:
        """Curves that the modified channels replace, ndarray[n_modified, n_wavelengths]."""
        return self.qe[list(self.modified)]

    @property
    def fixed(self) -> tuple[int, ...]:
        """Channels that no design modifies."""
        return tuple(i for i in range(len(self.mosaic.channels)) if i not in self.modified)

    def effective_index(self, channel: int) -> float:
        """Effective index of a channel's filter; infinite for one that does not move with the angle of the light."""
        return index_of(self.technologies[channel]) if self.technologies else math.inf

    @property
    def moving(self) -> tuple[int, ...]:
        """Channels whose filter moves with the angle of the light."""
        return tuple(c for c in range(len(self.mosaic.channels)) if math.isfinite(self.effective_index(c)))

    def carrier(self, channel: int) -> FloatArray:
        """Curve of a channel under its filter, the same at every angle: its base, or if plain the clear pixel's."""
        return self.qe[channel] if channel in self.modified else self.clear_qe

    @property
    def longest_distance_dn(self) -> float:
        """No two points of the unclipped response that fit into the range are further apart; DN."""
        return float(2 * self.pixel.full_scale_dn * np.sqrt(len(self.mosaic.channels)))

    @property
    def members(self) -> dict[str, IndexArray]:
        """Signal type -> indices of its signals."""
        return self.lights.members

    def computes(self, effect: str) -> bool:
        """True for an effect that is not left out."""
        return effect not in self.left_out

    @property
    def with_all_effects(self) -> View:
        """The view with no effect left out."""
        return replace(self, left_out=frozenset())

    @property
    def linear(self) -> bool:
        """True where digital numbers are linear in electrons: neither clipped nor rounded."""
        return self.left_out >= READOUT

    @property
    def all_phases(self) -> bool:
        """True where the worst of all sampling phases is asked for."""
        return self.scenario.any_phase

    @property
    def positions_differ(self) -> bool:
        """True where field positions see something else by the effects that are computed."""
        tilted = self.computes("angle") and bool(self.moving)
        return tilted or (self.computes("illumination") and self.scenario.off_axis_deg != 0)

    @property
    def all_heights(self) -> bool:
        """True where the worst of all field positions is asked for, and they differ."""
        field = self.scenario.field
        return field is not None and field.everywhere and self.positions_differ


def per_photon(view: View) -> float:
    """Electrons per second, for each unit of sum over wavelengths of irradiance times QE: A FF dl."""
    return view.grid.step_nm * view.pixel.area_m2
