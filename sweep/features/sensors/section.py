"""Keys `sensors` and `pixels` of a study."""

from __future__ import annotations

from ...base.types import Section
from ...camera.captures import CaptureNames
from ...camera.pixel import Pixel
from ...camera.sensor import BUILT_IN_SENSORS
from ...study.schema_curves import Name, SensorSection, named


class Keys(Section):
    """Keys of a study."""

    sensors: list[named(BUILT_IN_SENSORS) | SensorSection] | None = None  # type: ignore[valid-type]
    """Several sensors instead of `sensor`: one run for each, and their comparison; `rawtoaces/*` are all that fit."""
    pixels: dict[Name, CaptureNames | Pixel | None] | None = None
    """Several pixels: one run for each, and their comparison; NAME: keys that differ from `pixel`, or captures."""


class CfaKeys(Section):
    """Keys of a CFA."""

    only: list[Name] = []
    """Sensors of `sensors` that the CFA and its filters are for, with `*` for any letters; left out, all."""


KEYS = {"StudySection": Keys, "CfaSection": CfaKeys}
