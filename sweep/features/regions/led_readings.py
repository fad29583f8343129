"""Readings of LEDs beside the lamps of a study, and how far two of them are apart."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.types import Array, Float, IndexArray, Int
from ...camera.model import SceneModel
from ...metrics.chromatic import squared_distance
from ...runs.analysis import NamedDesign
from ...spectra.lights import Lights

_TOGETHER = 128
"""LEDs that are read out at once."""


@dataclass(frozen=True)
class Readings:
    """Numbers of LEDs in each phase, DN, and those without light."""

    dn: Float[Array, "phases lights channels"]
    dark: Float[Array, "phases channels"]


def read(design: NamedDesign, photons: Float[Array, "lights wavelengths"]) -> Readings:
    """Return the readings of LEDs with the photons of the study's lights, with all effects."""
    setup, parts = design.setup.with_all_effects, []
    for start in range(0, len(photons), _TOGETHER):
        part = photons[start : start + _TOGETHER]
        names = tuple(map(str, range(len(part))))
        lights = Lights("leds", names, names, part, setup.lights.photon_ratio, "modeled", surrogate=True)
        parts.append(SceneModel(replace(setup, lights=lights)).read(design.curves)[0][0])
    model = SceneModel(setup)
    return Readings(np.concatenate(parts, axis=1), model.unlit(design.curves, model.exposure_s(design.curves))[0])


def apart(
    first: Readings,
    second: Readings,
    firsts: Int[IndexArray, " firsts"] | slice = slice(None),
    seconds: Int[IndexArray, " seconds"] | slice = slice(None),
) -> tuple[Float[Array, "firsts seconds"], Float[Array, "firsts seconds"]]:
    """Return the CSD of each two lights and that of lamps of any brightness, the smallest over all phases, DN."""
    csd, chromatic = list[np.ndarray](), list[np.ndarray]()
    for a, b, dark in zip(first.dn, second.dn, first.dark, strict=True):
        one, other = a[firsts], b[seconds]
        csd.append(np.linalg.norm(one[:, None] - other[None], axis=2))
        lit = (np.repeat(one - dark, len(other), axis=0), np.tile(other - dark, (len(one), 1)))
        chromatic.append(np.sqrt(squared_distance(*lit)).reshape(len(one), len(other)))
    return np.asarray(np.min(csd, axis=0), dtype=float), np.asarray(np.min(chromatic, axis=0), dtype=float)
