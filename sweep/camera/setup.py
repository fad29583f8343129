"""Setup of a block of designs: camera, lights, scene, and how accurately the scene is simulated."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from ..base.types import IndexArray
from ..curves.lights import Lights
from ..curves.tasks import StudyTasks
from .accuracy import STANDARD, Accuracy
from .camera import Camera
from .own_effects import OwnEffect
from .scene import Scene

READOUT = frozenset({"noise", "quantization", "saturation"})
"""Effects without which digital numbers are linear in electrons."""


@dataclass(frozen=True)
class Setup:
    """Camera, lights and scene that a block of designs shares.

    Attributes
    ----------
    camera : Camera
    lights : Lights
        The signals and their types.
    scene : Scene
        What a scenario of a study states.
    tasks : StudyTasks or None
        What else the study asks of its designs.
    accuracy : Accuracy
        Numerical settings.
    left_out : frozenset of str
        Effects that are not computed (see `effects`).
    own_effects : tuple of OwnEffect
        Those of a user's own.
    """

    camera: Camera
    lights: Lights
    scene: Scene
    tasks: StudyTasks | None = field(default=None, kw_only=True)
    accuracy: Accuracy = field(default=STANDARD, kw_only=True)
    left_out: frozenset[str] = field(default=frozenset(), kw_only=True)
    own_effects: tuple[OwnEffect, ...] = field(default=(), kw_only=True)

    def with_camera(self, **changes: Any) -> Setup:
        """The setup with some attributes of its camera changed."""
        return replace(self, camera=replace(self.camera, **changes))

    @property
    def members(self) -> dict[str, IndexArray]:
        """Signal type -> indices of its signals."""
        return self.lights.members

    def computes(self, effect: str) -> bool:
        """True for an effect that is not left out."""
        return effect not in self.left_out

    @property
    def with_all_effects(self) -> Setup:
        """The setup with no effect left out."""
        return replace(self, left_out=frozenset())

    @property
    def linear(self) -> bool:
        """True where digital numbers are linear in electrons: neither clipped nor rounded."""
        return self.left_out >= READOUT

    @property
    def all_phases(self) -> bool:
        """True where the worst of all sampling phases is asked for."""
        return self.scene.any_phase

    @property
    def positions_differ(self) -> bool:
        """True where field positions see something else by the effects that are computed."""
        tilted = self.computes("angle") and bool(self.camera.moving)
        return tilted or (self.computes("illumination") and self.scene.off_axis_deg != 0)

    @property
    def all_heights(self) -> bool:
        """True where the worst of all field positions is asked for, and they differ."""
        field = self.scene.field
        return field is not None and field.everywhere and self.positions_differ
