"""Scenes that show what a single method changes with everything else on: under noise the reference is smooth."""

from __future__ import annotations

from .scenes import DARK, F2, F4, FAR, FINE, FIXED, MIDDLE, TINY, Scene, scene

ALONE: tuple[Scene, ...] = (
    scene(
        "noise, dark",
        "RYNCy",
        {"noise": True, "photon_radiance": 3e15, "exposure": FIXED},
        {"read_noise_e": 6.0, "offset_dn": 1.5},
    ),
    scene("noise, a fraction of a pedestal", "RGGB", {"noise": True}, {"read_noise_e": 0.5, "offset_dn": 168.5}),
    scene(
        "noise, hazy and far",
        "RGGB",
        {
            "noise": True,
            "target": FAR | {"readout": "center", "phase_px": [0.4, 0.3]},
            "visibility_m": 3000,
            "off_axis_deg": 10,
            "intensity_cd": 200,
            "exposure": {"kind": "fixed", "exposure_s": 0.02},
            "drive": {"duty": 0.6, "frequency_hz": 90},
            "optics": {"f_number": 16.0},
        },
        DARK | {"crosstalk": 0.03},
        grid=FINE,
    ),
    scene(
        "noise, out of focus",
        "RYNCy",
        {
            "noise": True,
            "target": MIDDLE | {"readout": "center", "phase_px": [1.2, 0.7]},
            "visibility_m": 600,
            "off_axis_deg": 25,
            "intensity_cd": 200,
            "exposure": {"kind": "fixed", "exposure_s": 0.02},
            "drive": {"duty": 0.3, "frequency_hz": 190},
            "optics": {"f_number": 4.0, "focus_m": 2.0},
        },
        DARK | {"crosstalk": 0.1, "offset_dn": 10.3},
        grid=FINE,
    ),
    scene(
        "noise, blurred quad Bayer",
        "quad",
        {
            "noise": True,
            "target": MIDDLE | {"readout": "center", "phase_px": [0.9, 2.4]},
            "visibility_m": 1000,
            "off_axis_deg": 5,
            "background_cd_m2": 30,
            "intensity_cd": 800,
            "exposure": {"kind": "fixed", "exposure_s": 0.05},
            "drive": {"duty": 0.5, "frequency_hz": 45},
            "optics": {"f_number": 40.0},
        },
        DARK | {"crosstalk": 0.05, "prnu": 0.01},
        grid=FINE,
    ),
    scene("noise, any place", "RYNCy", {"noise": True, "target": TINY, "optics": F2}, DARK),
    scene(
        "noise, any place, center", "RGGB", {"noise": True, "target": TINY | {"readout": "center"}, "optics": F2}, DARK
    ),
    scene("noise, any place, RCCC", "RCCC", {"noise": True, "target": TINY, "optics": F4}, DARK),
    scene("noise, any place, 1x3 tile", "1x3", {"noise": True, "target": TINY, "optics": F4}, DARK),
    scene(
        "noise, flicker, saturated",
        "RYNCy",
        {
            "noise": True,
            "intensity_cd": 127,
            "exposure": {"kind": "fixed", "exposure_s": 0.0051},
            "drive": {"duty": 0.25, "frequency_hz": 165},
        },
        DARK,
    ),
    scene(
        "noise, flicker, saturated, RGGB",
        "RGGB",
        {
            "noise": True,
            "intensity_cd": 114,
            "exposure": {"kind": "fixed", "exposure_s": 0.0092},
            "drive": {"duty": 0.07, "frequency_hz": 154},
        },
        DARK,
    ),
    scene(
        "noise, flicker, saturated, 1x3 tile",
        "1x3",
        {
            "noise": True,
            "intensity_cd": 422,
            "exposure": {"kind": "fixed", "exposure_s": 0.0048},
            "drive": {"duty": 0.32, "frequency_hz": 148},
        },
        DARK,
    ),
    scene(
        "noise, f/40, center",
        "RCCC",
        {
            "noise": True,
            "target": FAR | {"phase_px": [0.5, 0.5], "readout": "center"},
            "intensity_cd": 800,
            "exposure": {"kind": "fixed", "exposure_s": 0.05},
            "optics": {"f_number": 40.0},
        },
        DARK,
        grid=FINE,
    ),
    scene(
        "noise, f/40, center of a 3x3 tile",
        "3x3",
        {
            "noise": True,
            "target": FAR | {"phase_px": [1.4, 0.6], "readout": "center"},
            "intensity_cd": 800,
            "exposure": {"kind": "fixed", "exposure_s": 0.05},
            "optics": {"f_number": 40.0},
        },
        DARK,
        grid=FINE,
    ),
    scene(
        "noise, f/64",
        "RYNCy",
        {
            "noise": True,
            "target": FAR | {"phase_px": [0.5, 0.5]},
            "intensity_cd": 800,
            "exposure": {"kind": "fixed", "exposure_s": 0.1},
            "optics": {"f_number": 64.0},
        },
        DARK,
        grid=FINE,
    ),
    # Where the full well ends below the ADC's range, rounding does not end it again.
    scene(
        "well below the ADC, RGGB, a fraction of a pedestal",
        "RGGB",
        {"intensity_cd": 400, "exposure": {"kind": "fixed", "exposure_s": 1e-2}},
        {"well_e": 3000, "gain_dn_per_e": 0.4, "offset_dn": 100.5},
    ),
    scene(
        "well below the ADC, far",
        "RCCC",
        {"intensity_cd": 200, "target": FAR, "exposure": {"kind": "fixed", "exposure_s": 2e-3}, "optics": F2},
        {"well_e": 4000, "gain_dn_per_e": 0.5, "offset_dn": 20.25},
    ),
)
