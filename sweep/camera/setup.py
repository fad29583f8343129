"""Setup of a batch of designs: camera, lights, scene and accuracy."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, ClassVar
from uuid import uuid4
from weakref import WeakValueDictionary

from ..base.types import MemberNumbers
from ..spectra.lights import Lights
from ..spectra.population import stated_yield
from .accuracy import STANDARD, Accuracy
from .camera import Camera
from .curve_errors import CurveErrors
from .scene import Scene
from .user_effects import UserEffect

READOUT = frozenset({"noise", "quantization", "saturation"})
"""Effects without which digital numbers are linear in electrons."""


class Feature:
    """What a study asks of a feature, which its setups carry; `slow`: a design takes long."""

    slow: ClassVar[bool] = False

    @property
    def columns(self) -> Hashable:
        """What its columns depend on."""
        return True


@dataclass(frozen=True, eq=False)
class Setup:
    """Camera, lights and scene that a batch of designs shares; each is itself alone, and may own a model.

    `features`: what the study asks of features, by their names;
    `left_out`: effects that are not computed (see `effects`).
    """

    camera: Camera
    lights: Lights
    scene: Scene
    features: Mapping[str, Feature] = field(default_factory=dict, kw_only=True)
    accuracy: Accuracy = field(default=STANDARD, kw_only=True)
    left_out: frozenset[str] = field(default=frozenset(), kw_only=True)
    user_effects: tuple[UserEffect, ...] = field(default=(), kw_only=True)

    @cached_property
    def _token(self) -> str:
        """Name under which copies in other processes know one another, so that one model serves them there."""
        token = uuid4().hex
        _ALIVE[token] = self
        return token

    def __reduce__(self) -> tuple[Any, ...]:
        return _arrived, (self._token, {each.name: getattr(self, each.name) for each in fields(self)})

    def with_camera(self, **changes: Any) -> Setup:
        """Return the setup with some attributes of its camera changed."""
        return replace(self, camera=replace(self.camera, **changes))

    @property
    def members(self) -> dict[str, MemberNumbers]:
        """Indices of the signals of each signal type."""
        return self.lights.members

    @property
    def wanted_yield(self) -> float:
        """The share of random cameras, or lamps and cameras, of a yield; 0: none."""
        return stated_yield(self._errors, self.lights.population)

    @property
    def draws_sensors(self) -> bool:
        """True if the cameras of a yield have random curves."""
        return self._errors is not None and self._errors.wanted_yield is not None

    @property
    def _errors(self) -> CurveErrors | None:
        uncertain = self.camera.uncertain
        return None if uncertain is None else uncertain.errors

    def computes(self, effect: str) -> bool:
        """Return whether an effect is computed."""
        return effect not in self.left_out

    @property
    def with_all_effects(self) -> Setup:
        """The setup with every effect computed."""
        return replace(self, left_out=frozenset())

    @cached_property
    def steady(self) -> Setup:
        """The setup without pulses of its lamps."""
        return replace(self, scene=self.scene.model_copy(update={"drive": None}))

    @cached_property
    def over_brightness(self) -> Setup:
        """The setup in which lamps of any brightness are read: pixels may fill; without noise, unrounded."""
        left_out = self.left_out - {"saturation", "noise"}
        return replace(self, left_out=left_out if self.scene.noise is not None else left_out | {"quantization"})

    @property
    def linear(self) -> bool:
        """True if digital numbers are linear in electrons: neither clipped nor rounded."""
        return self.left_out >= READOUT

    @property
    def all_phases(self) -> bool:
        """True if the scene asks for the worst sampling phase."""
        return self.scene.any_phase

    @property
    def moves(self) -> bool:
        """True if filters move with the angle of the light, and that is computed."""
        return bool(self.camera.moving) and self.computes("angle")

    @property
    def positions_differ(self) -> bool:
        """True if field positions differ in an effect that is computed."""
        return self.moves or (self.computes("illumination") and self.scene.off_axis_deg != 0)

    @property
    def all_heights(self) -> bool:
        """True if the scene asks for the worst of all field positions, and they differ."""
        field = self.scene.field
        return field is not None and field.everywhere and self.positions_differ


_ALIVE: WeakValueDictionary[str, Setup] = WeakValueDictionary()


def _arrived(token: str, values: dict[str, Any]) -> Setup:
    """Return the setup that came to this process with a call, the same for all calls that carry it."""
    setup = _ALIVE.get(token)
    if setup is None:
        setup = _ALIVE[token] = Setup(**values)
    return setup
