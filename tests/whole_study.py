"""A study with every number that pixel, optics, scene, exposure, noise and search can have."""

from __future__ import annotations

from typing import Any

from ruamel.yaml import YAML

WHOLE: dict[str, Any] = YAML(typ="safe", pure=True).load("""\
study: all
sensor: ar0820
lights: tl16
wavelengths: {start_nm: 400.0, stop_nm: 700.0, step_nm: 10.0}
pixel: {pitch_um: 2.1, fill_factor: 0.9, well_e: 10000.0, bits: 12, gain_dn_per_e: 0.4, offset_dn: 0.5, crosstalk: 0.01,
  read_noise_e: 2.0, dark_e_per_s: 5.0, prnu: 0.01}
tolerance_dn: 1.0
geometry: {far: {distance_m: 100.0, fov_deg: 60.0, width_px: 3840, diameter_m: 0.2}}
cfas: [RYNCy]
designs:
  one: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 600.0, left_width_nm: 10.0, right_nm: 650.0, right_width_nm: 10.0}}
sweeps:
  grid: {cfa: RYNCy, channel: N, base: Y, to: 0.1, grid: {left_nm: {min: 590.0, max: 610.0, count: 2}, left_width_nm: [5.0],
    right_nm: 650.0, right_width_nm: {values: [5.0]}, depth: 1.0}}
production: {edge_shift_nm: 2.0}
recognition: {error_max: 0.001}
objective: {minimum: {csd_yellow_red: 1.0}}
constraints: {sensitivity: {min: 0.9}, slope_per_nm: {max: 0.06}}
search: {space: grid, starts: 2, max_evaluations: 20, front: {min: 0.9, max: 1.0, count: 2}}
seed: 3
published: {table: {RYNCy: {csd_yellow_red: 31.0}}}
scenarios:
  patch:
    photon_radiance: 2.0e+18
    off_axis_deg: 5.0
    exposure: {kind: white_patch, level: 0.95, photon_ratio: 0.08}
    optics: {f_number: 4.0, transmission: 0.9, cra_deg: 12.0}
    noise: {read_noise_e: 3.0, dark_e_per_s: 2.0, prnu: 0.02}
  road:
    intensity_cd: 200.0
    exposure: {kind: fixed, exposure_s: 0.004}
    optics: {f_number: 2.0, focus_m: 90.0, transmission: 0.9}
    target: {distance_m: 100.0, fov_deg: 60.0, width_px: 3840, diameter_m: 0.2, phase_px: [0.25, 0.5]}
    off_axis_deg: 10.0
    visibility_m: 500.0
    background_cd_m2: 10.0
    drive: {duty: 0.5, frequency_hz: 90.0}
    noise: {read_noise_e: 3.0, dark_e_per_s: 2.0, prnu: 0.02}
""")
