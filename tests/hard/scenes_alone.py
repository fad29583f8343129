"""Scenes that show what a single effect changes with all others computed: under noise the reference is smooth."""

from __future__ import annotations

from typing import Any

from .scenes import DARK, F2, F4, FAR, FINE, FIXED, GRID, MIDDLE, TINY, DesignScene, scene


def noisy(name: str, cfa: str, given: dict[str, Any], pixel: dict[str, Any] = DARK, **more: Any) -> DesignScene:
    return scene(f"noise, {name}", cfa, {"noise": True} | given, pixel, **more)


def lit(intensity_cd: float, exposure_s: float) -> dict[str, Any]:
    return {"intensity_cd": intensity_cd, "exposure": {"kind": "fixed", "exposure_s": exposure_s}}


def pulsed(intensity_cd: float, exposure_s: float, duty: float, frequency_hz: float) -> dict[str, Any]:
    return lit(intensity_cd, exposure_s) | {"drive": {"duty": duty, "frequency_hz": frequency_hz}}


def center(place: dict[str, Any], x_px: float, y_px: float) -> dict[str, Any]:
    """A light at a place of the pixel, whose center is read out."""
    return {"target": place | {"readout": "center", "phase_px": [x_px, y_px]}}


def hazy(visibility_m: float, off_axis_deg: float) -> dict[str, Any]:
    return {"visibility_m": visibility_m, "off_axis_deg": off_axis_deg}


ALONE: tuple[DesignScene, ...] = (
    noisy("dark", "RYNCy", {"photon_radiance": 3e15, "exposure": FIXED}, {"read_noise_e": 6.0, "offset_dn": 1.5}),
    noisy("a fraction of a pedestal", "RGGB", {}, {"read_noise_e": 0.5, "offset_dn": 168.5}),
    noisy(
        "hazy and far",
        "RGGB",
        center(FAR, 0.4, 0.3) | hazy(3000, 10) | pulsed(200, 0.02, 0.6, 90) | {"optics": {"f_number": 16.0}},
        DARK | {"crosstalk": 0.03},
        grid=FINE,
    ),
    noisy(
        "out of focus",
        "RYNCy",
        center(MIDDLE, 1.2, 0.7)
        | hazy(600, 25)
        | pulsed(200, 0.02, 0.3, 190)
        | {"optics": {"f_number": 4.0, "focus_m": 2.0}},
        DARK | {"crosstalk": 0.1, "offset_dn": 10.3},
        grid=FINE,
    ),
    noisy(
        "blurred quad Bayer",
        "quad",
        center(MIDDLE, 0.9, 2.4)
        | hazy(1000, 5)
        | pulsed(800, 0.05, 0.5, 45)
        | {"background_cd_m2": 30, "optics": {"f_number": 40.0}},
        DARK | {"crosstalk": 0.05, "prnu": 0.01},
        grid=FINE,
    ),
    noisy("any place", "RYNCy", {"target": TINY, "optics": F2}),
    noisy("any place, center", "RGGB", {"target": TINY | {"readout": "center"}, "optics": F2}),
    noisy("any place, 1x3 tile", "1x3", {"target": TINY, "optics": F4}),
    noisy("flicker, saturated", "RYNCy", pulsed(127, 0.0051, 0.25, 165)),
    *(
        noisy(name, cfa, center(FAR, x, y) | lit(800, 0.05) | {"optics": {"f_number": 40.0}}, grid=FINE)
        for name, cfa, x, y in (("f/40, center", "RCCC", 0.5, 0.5), ("f/40, center of a 3x3 tile", "3x3", 1.4, 0.6))
    ),
    *(
        noisy(name, cfa, given | {"optics": {"f_number": f, "cra_deg": cra}}, grid=grid, wide=wide, index=index)
        for name, cfa, given, f, cra, index, grid, wide in (
            ("at an angle", "RYNCy", {}, 1.0, 30.0, 1.5, FINE, False),
            ("at an angle, box", "RYNCy", {"background_cd_m2": 300}, 1.2, 25.0, 1.6, GRID, True),
            ("at an angle, far", "RYNCy", {"target": FAR} | lit(800, 5e-5), 0.8, 20.0, 1.4, FINE, False),
            ("at an angle, 1x3 tile", "1x3", {"target": MIDDLE}, 1.4, 40.0, 1.8, FINE, False),
        )
    ),
    noisy(
        "a field",
        "RYNCy",
        {
            "optics": {"f_number": 1.2},
            "field": {"cra_max_deg": 30, "places": 3},
            "off_axis_deg": 30,
            "background_cd_m2": 90,
        },
        index=1.7,
    ),
    # Where the full well ends below the ADC's range, rounding does not end it again.
    scene(
        "well below the ADC, RGGB, a fraction of a pedestal",
        "RGGB",
        lit(400, 1e-2),
        {"well_e": 3000, "gain_dn_per_e": 0.4, "offset_dn": 100.5},
    ),
    scene(
        "well below the ADC, far",
        "RCCC",
        lit(200, 2e-3) | {"target": FAR, "optics": F2},
        {"well_e": 4000, "gain_dn_per_e": 0.5, "offset_dn": 20.25},
    ),
)
