"""Cameras that a study can name instead of stating its pixel and its lens."""

from __future__ import annotations

from typing import Any, Literal

CameraName = Literal["road", "road_read_once"]
_LENS = {"f_number": 2}
_PIXEL = {"pitch_um": 2.8, "offset_dn": 64, "prnu": 0.005}
CAMERAS: dict[str, dict[str, dict[str, Any]]] = {
    "road": {"pixel": _PIXEL | {"captures": "split_pixel"}, "optics": _LENS},
    "road_read_once": {"pixel": _PIXEL | {"well_e": 22_000, "read_noise_e": 3.05}, "optics": _LENS},
}
"""`road`: f/2 and a split pixel of 2.8 um; `road_read_once`: its large photodiode alone, read once at 49 uV/e (see
`captures.NAMED_CAPTURES`). Pedestal and PRNU are assumed."""


def with_camera(value: Any) -> Any:
    """Fill in pixel and optics of a study from the camera that it names; what the study states itself stays."""
    camera = CAMERAS.get(value["camera"]) if isinstance(value, dict) and isinstance(value.get("camera"), str) else None
    if camera is None:
        return value
    return value | {
        "pixel": _filled(camera["pixel"], value.get("pixel", {})),
        "scenarios": _scenes(value.get("scenarios", {"chart": {}}), camera["optics"]),
    }


def _scenes(scenarios: Any, optics: dict[str, Any]) -> Any:
    if not isinstance(scenarios, dict):
        return scenarios
    return {
        name: scene | {"optics": _filled(optics, scene.get("optics", {}))} if isinstance(scene, dict) else scene
        for name, scene in scenarios.items()
    }


def _filled(defaults: dict[str, Any], given: Any) -> Any:
    """Return a section with the defaults of keys that it lacks; anything else than a mapping stays as it is."""
    return defaults | given if isinstance(given, dict) else given
