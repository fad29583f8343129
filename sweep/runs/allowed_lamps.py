"""Separations of designs over the yellow and red LEDs that a norm allows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import Array, DesignCurves, Float, delayed
from ..camera.model import SceneModel
from ..camera.setup import Setup
from ..spectra.lights import Lights
from ..spectra.single_leds import Norm, SingleLeds, all_leds
from ..study import Study
from .analysis import Analysis, Calls, named_designs

if TYPE_CHECKING:
    import pandas as pd

_TOGETHER = 128
"""LEDs that are read out at once."""
_SCHEMA = pa.schema(
    [
        ("design_id", pa.int64()),
        ("norm", pa.string()),
        *((name, pa.float64()) for name in ("yellow_nm", "red_nm")),
        *((name, pa.int64()) for name in ("pairs", "separated")),
        *((name, pa.float64()) for name in ("least_dn", "yellow_fwhm_nm", "red_fwhm_nm")),
    ]
)


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Compute the separations of modeled LEDs with all effects.

    One row per design, norm, peak of the yellow and peak of the red LED. `pairs` counts allowed pairs of widths,
    `separated` those with at least the wanted CSD; `least_dn` is the smallest CSD, with the widths of both LEDs.
    """
    regions = study.section.regions
    assert regions is not None
    leds = all_leds(regions)
    allowed = {norm: (leds.allowed(norm, "yellow"), leds.allowed(norm, "red")) for norm in regions.norms}
    for design in named_designs(study, rows):
        yield design.key, delayed(_cells, design.setup.with_all_effects, design.curves, allowed, regions.wanted_dn)


def _cells(
    setup: Setup, curves: DesignCurves, allowed: Mapping[Norm, tuple[SingleLeds, SingleLeds]], wanted_dn: float
) -> list[dict[str, Any]]:
    """Return the rows of one design."""
    cells = []
    for norm, (yellow, red) in allowed.items():
        yellow_dn, red_dn = (_read(setup, curves, leds) for leds in (yellow, red))
        for yellow_nm, red_nm in product(np.unique(yellow.peak_nm), np.unique(red.peak_nm)):
            yellows, reds = np.flatnonzero(yellow.peak_nm == yellow_nm), np.flatnonzero(red.peak_nm == red_nm)
            csd = least_csd(yellow_dn[:, yellows], red_dn[:, reds])
            at = np.unravel_index(int(csd.argmin()), csd.shape)
            cells.append(
                {
                    "norm": norm,
                    "yellow_nm": float(yellow_nm),
                    "red_nm": float(red_nm),
                    "pairs": csd.size,
                    "separated": int((csd >= wanted_dn).sum()),
                    "least_dn": float(csd[at]),
                    "yellow_fwhm_nm": float(yellow.fwhm_nm[yellows[at[0]]]),
                    "red_fwhm_nm": float(red.fwhm_nm[reds[at[1]]]),
                }
            )
    return cells


def _read(setup: Setup, curves: DesignCurves, leds: SingleLeds) -> Float[Array, "phases _lights channels"]:
    """Return DN of LEDs with the photons of the study's lights."""
    photons, parts = leds.photons(setup.camera.grid), []
    for start in range(0, len(photons), _TOGETHER):
        part = photons[start : start + _TOGETHER]
        names = tuple(map(str, range(len(part))))
        lights = Lights("leds", names, names, part, setup.lights.photon_ratio, "modeled", surrogate=True)
        parts.append(SceneModel(replace(setup, lights=lights)).read(curves)[0][0])
    return np.concatenate(parts, axis=1)


def least_csd(
    first: Float[Array, "phases first channels"], second: Float[Array, "phases second channels"]
) -> Float[Array, "first second"]:
    """Return the smallest CSD over all phases of each two lights, DN."""
    csd = [np.linalg.norm(a[:, None] - b[None], axis=2) for a, b in zip(first, second, strict=True)]
    return np.asarray(np.min(csd, axis=0), dtype=float)


ALLOWED_LAMPS = Analysis("color regions", lambda study: study.section.regions is not None, lambda _: _SCHEMA, _calls)
