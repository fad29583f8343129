"""A random generator of scenes: any mixture of effects, with boxes of designs, and all their CSDs."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sweep.camera.accuracy import Accuracy
from sweep.camera.camera import Camera
from sweep.camera.effects import Box
from sweep.camera.model import SceneModel
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.camera.setup import Setup
from sweep.designs.families.dual import Dual
from sweep.designs.families.stopband import MultiStopband
from sweep.designs.family import Family
from sweep.designs.technology import Technology
from sweep.designs.tolerance import SHIFTS, ProductionError
from sweep.metrics.evaluate import evaluate
from sweep.metrics.quantity import WORST
from sweep.metrics.separation import csd_name
from sweep.spectra.lights import class_pairs

from .scenes import FAMILY, GRID, SENSOR, TILES, csd_columns, lights, moving, target

_DUAL = Dual(GRID.nodes_nm, SENSOR.qe["Y"], SENSOR.qe["C"])
_TWO_BANDS = MultiStopband(GRID.nodes_nm, SENSOR.qe["Y"], SENSOR.qe["G"], 2)
_TWO = Mosaic.from_rows("two", [["R", "N"], ["M", "Cy"]])
_DESIGNS = 4
_SHIFT_NM = 3.0
_ANY_PLACE_PX = 6.0
"""Larger lights at any place take too long."""
_MOVED_EVERY = 3
"""In scenes of some seeds filters move with the angle of the light."""
_GLARE_EVERY = 4
_FIELD_EVERY, _EVERYWHERE_EVERY = 6, 30
"""Of these, in some there are three places of the sensor, in some all places count."""
_ANY_PLACE_EVERY = 14
"""Any place is asked for only in scenes of some seeds: the reference then takes a hundred times as long."""


@dataclass(frozen=True)
class RandomScene:
    """A scene, the box of designs that a plan is for, and some of its designs.

    `curves`: QE of the modified channels for each shift of the edges, ndarray[n_designs, n_modified, n_wavelengths]
    each, the nominal ones first.
    """

    name: str
    setup: Setup
    curves: tuple[np.ndarray, ...]
    box: Box
    tolerance_dn: float


def random_scene(seed: int) -> RandomScene:
    """The scene of a seed, always the same."""
    rng = np.random.default_rng([seed, 17])
    given = _scenario(rng, may_be_anywhere=seed % _ANY_PLACE_EVERY == 0)
    if seed % _GLARE_EVERY == 0 and "target" in given:
        share, field = np.random.default_rng([seed, 21]).uniform(-5, -0.5), np.random.default_rng([seed, 22])
        given["veiling_glare"] = {"share": float(10**share), "field_cd_m2": float(10 ** field.uniform(0, 4.5))}
    cra_deg = float(np.random.default_rng([seed, 19]).uniform(0, 35))
    if seed % _FIELD_EVERY == 0 and given.get("target", {}).get("phase_px") != "any":
        given["field"] = {"cra_max_deg": cra_deg, "places": 3 if seed % _EVERYWHERE_EVERY else "any"}
    else:
        given["optics"]["cra_deg"] = cra_deg
    pixel = _pixel(rng, noisy=given["noise"] is not False)
    cfa = str(rng.choice([*TILES, "two"]))
    mosaic = _TWO if cfa == "two" else TILES[cfa]
    modified = tuple(mosaic.channels.index(name) for name in ("N", "M") if name in mosaic.channels)
    scenario = Scene.model_validate(given)
    camera = Camera(
        grid=GRID,
        mosaic=mosaic,
        qe=SENSOR.mosaic_qe(mosaic, dict.fromkeys((mosaic.channels[i] for i in modified), "Y") if modified else None),
        modified=modified,
        clear_qe=SENSOR.qe["C"],
        pixel=Pixel(**pixel) if scenario.noise is None else scenario.noise.of(Pixel(**pixel)),
        technologies=_technologies(seed, mosaic),
    )
    setup = Setup(camera, lights(), scenario)
    low, high = setup.camera.qe.copy(), setup.camera.qe.copy()
    curves: tuple[np.ndarray, ...] = (np.empty((1, 0, GRID.size)),)
    if modified:
        curves, lower, upper = _designs(rng, len(modified))
        low[list(modified)], high[list(modified)] = lower, upper
    tolerance = float(10 ** rng.uniform(-2, 2.5))
    return RandomScene(f"random {seed}", setup, curves, Box(setup, low, high), tolerance)


def _technologies(seed: int, mosaic: Mosaic) -> tuple[Technology, ...]:
    """In a third of the scenes the modified channels move with the angle of the light, where they do not exceed it."""
    if seed % _MOVED_EVERY or "M" in mosaic.channels:
        return ()
    return moving(mosaic, float(np.random.default_rng([seed, 20]).uniform(1.4, 2.2)))


def columns(made: RandomScene, left_out: frozenset[str], accuracy: Accuracy) -> dict[str, np.ndarray]:
    """Every CSD of all designs of a scene, ndarray[n_designs], as a run has them."""
    model = SceneModel(replace(made.setup, left_out=left_out, accuracy=accuracy))
    cases = [evaluate(model, curves) for curves in made.curves]
    found = {name: cases[0][name] for name in csd_columns(made.setup)}
    if len(cases) > 1:
        distances = [csd_name(pair) for pair in class_pairs(made.setup.lights.classes)]
        found |= {WORST + name: np.min([case[name] for case in cases], axis=0) for name in distances}
    return found


def _now(rng: np.random.Generator, probability: float) -> bool:
    return bool(rng.uniform() < probability)


def _scenario(rng: np.random.Generator, *, may_be_anywhere: bool) -> dict[str, Any]:
    given: dict[str, Any] = {"optics": {"f_number": float(2 ** rng.uniform(0.3, 4))}}
    if _now(rng, 0.55):
        given["target"] = _light(rng, may_be_anywhere=may_be_anywhere)
        if _now(rng, 0.3):
            given["visibility_m"] = float(10 ** rng.uniform(2, 4.5))
        if _now(rng, 0.15):
            given["optics"]["focus_m"] = float(10 ** rng.uniform(0.5, 2))
    if _now(rng, 0.3):
        given["off_axis_deg"] = float(rng.uniform(0, 50))
    if _now(rng, 0.5):
        given["exposure"] = {"kind": "fixed", "exposure_s": float(10 ** rng.uniform(-3.5, -1.0))}
        if _now(rng, 0.6):
            given["intensity_cd"] = float(rng.choice([50.0, 200.0, 800.0]))
    else:
        given["exposure"] = {"kind": "white_patch", "level": float(rng.uniform(0.02, 1))}
        if _now(rng, 0.4):  # signals as bright as the white patch
            given["exposure"]["photon_ratio"] = float(10 ** rng.uniform(-1, 0.3))
    if _now(rng, 0.25):
        given["background_cd_m2"] = float(10 ** rng.uniform(0, 3.5))
    if _now(rng, 0.25):
        given["drive"] = {"duty": float(rng.uniform(0.1, 1)), "frequency_hz": float(10 ** rng.uniform(1.0, 3.5))}
    given["noise"] = _now(rng, 0.5)
    return given


def _light(rng: np.random.Generator, *, may_be_anywhere: bool) -> dict[str, Any]:
    distance_m, fov_deg = float(10 ** rng.uniform(1.5, 2.9)), float(rng.uniform(20, 120))
    light = target(distance_m, fov_deg, readout="center" if _now(rng, 0.3) else "mean")
    across_px = 3840 / fov_deg * math.degrees(0.2 / distance_m)
    anywhere, place = _now(rng, 0.25) and across_px < _ANY_PLACE_PX, [float(v) for v in rng.uniform(0, 2, 2)]
    light["phase_px"] = "any" if anywhere and may_be_anywhere else place
    return light


def _pixel(rng: np.random.Generator, *, noisy: bool) -> dict[str, Any]:
    pixel: dict[str, Any] = {
        "fill_factor": float(rng.uniform(0.3, 1)),
        "bits": int(rng.choice([8, 10, 12, 12, 12, 14])),
    }
    top = 2 ** pixel["bits"] - 1
    whole = float(rng.integers(0, top // 8))
    pixel["offset_dn"] = float(
        rng.choice(
            [0.0, 0.0, whole, whole + 0.5, rng.uniform(0, top / 8), rng.uniform(0, 2), rng.uniform(0.5, 0.99) * top]
        )
    )
    if _now(rng, 0.3):  # the well is full below the ADC's end, or above it
        pixel["well_e"] = float(10 ** rng.uniform(2.5, 4.3))
        pixel["gain_dn_per_e"] = float(top / pixel["well_e"] * 10 ** rng.uniform(-0.7, 0.5))
    if _now(rng, 0.3):
        pixel["crosstalk"] = float(rng.uniform(0, 0.2))
    if _now(rng, 0.3):
        pixel["dark_e_per_s"] = float(10 ** rng.uniform(0, 5))
    if noisy:
        pixel["read_noise_e"] = float(rng.choice([0.0, rng.uniform(0.05, 1), rng.uniform(0.2, 5), rng.uniform(5, 60)]))
        pixel["prnu"] = float(rng.choice([0.0, 0.0, 0.01, rng.uniform(0, 0.1)]))
    return pixel


def _box(rng: np.random.Generator, bands: int, *, wide: bool) -> tuple[np.ndarray, np.ndarray]:
    """Ends of a box of bands, ndarray[5 bands] each; the same where it is not wide."""
    middle = np.tile([550.0, 10.0, 595.0, 10.0, 0.8], bands)
    middle += np.tile([60.0, 0, 60, 0, 0], bands) * np.repeat(np.arange(bands), 5)
    middle += np.tile([30, 8, 30, 8, 0.2], bands) * rng.uniform(-1, 1, middle.size)
    half = np.tile([15.0, 8, 15, 8, 0.4], bands) * rng.uniform(0, 1, middle.size) * wide
    low, high = middle - half, middle + half
    low[1::5], low[3::5], low[4::5] = (np.maximum(low[at::5], 0.0) for at in (1, 3, 4))
    high[4::5] = np.minimum(high[4::5], 1.0)
    return low, high


def _designs(rng: np.random.Generator, n_modified: int) -> tuple[tuple[np.ndarray, ...], np.ndarray, np.ndarray]:
    """Designs of a box in its middle and at its corners, at every shift, and the limits of the box's curves.

    In a wide box edges may come out of order; none has a negative QE.
    """
    family: Family = _DUAL if n_modified == 2 else _TWO_BANDS if _now(rng, 0.2) else FAMILY
    wide, moved = _now(rng, 0.4), _now(rng, 0.25)
    shifts = [0.0, *(_SHIFT_NM * s for s in SHIFTS if s)] if moved else [0.0]
    families = [family.perturbed(ProductionError(shift)) if shift else family for shift in shifts]
    while True:
        low, high = _box(rng, len(family.parameters) // 5, wide=wide)
        share = rng.uniform(size=(_DESIGNS if wide else 1, low.size))
        share[1::2] = np.round(share[1::2])
        curves = tuple(f.curves(low + (high - low) * share) for f in families)
        if min(c.min() for c in curves) >= 0:
            break
    lowers, uppers = zip(*(f.hull(low, high) for f in families), strict=True)
    return curves, np.min(lowers, axis=0), np.max(uppers, axis=0)
