"""Separations of designs over the yellow and red LEDs that a norm allows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import Array, Float, IndexArray, Int, delayed
from ..camera.model import SceneModel
from ..metrics.chromatic import squared_distance
from ..results.tables import RGGB
from ..spectra.lights import Lights
from ..spectra.single_leds import Norm, SingleLeds, all_leds
from ..study import Study
from .analysis import Analysis, Calls, NamedDesign, named_designs

if TYPE_CHECKING:
    import pandas as pd

_TOGETHER = 128
"""LEDs that are read out at once."""
_SCHEMA = pa.schema(
    [
        ("design_id", pa.int64()),
        ("norm", pa.string()),
        *((name, pa.float64()) for name in ("yellow_nm", "red_nm")),
        *((name, pa.int64()) for name in ("pairs", "separated", "below_rggb", "chromatic_below_rggb")),
        *((name, pa.float64()) for name in ("least_dn", "yellow_fwhm_nm", "red_fwhm_nm")),
    ]
)


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Compute the separations of modeled LEDs with all effects.

    One row per design, norm, peak of the yellow and peak of the red LED. `pairs` counts allowed pairs of widths,
    `separated` those with at least the wanted CSD, `below_rggb` and `chromatic_below_rggb` those that RGGB keeps
    farther apart, also of any brightness; `least_dn` is the smallest CSD, with the widths of both LEDs.
    """
    regions = study.section.regions
    assert regions is not None
    leds = all_leds(regions)
    allowed = {norm: (leds.allowed(norm, "yellow"), leds.allowed(norm, "red")) for norm in regions.norms}
    designs = [*named_designs(study, rows)]
    of_rggb = {one.row["scenario"]: one for one in designs if one.row["name"] == RGGB}
    for design in designs:
        yield design.key, delayed(_cells, design, of_rggb.get(design.row["scenario"]), allowed, regions.wanted_dn)


def _cells(
    design: NamedDesign,
    rggb: NamedDesign | None,
    allowed: Mapping[Norm, tuple[SingleLeds, SingleLeds]],
    wanted_dn: float,
) -> list[dict[str, Any]]:
    """Return the rows of one design."""
    cells = []
    for norm, (yellow, red) in allowed.items():
        own, its = (None if one is None else (_read(one, yellow), _read(one, red)) for one in (design, rggb))
        assert own is not None
        for yellow_nm, red_nm in product(np.unique(yellow.peak_nm), np.unique(red.peak_nm)):
            yellows, reds = np.flatnonzero(yellow.peak_nm == yellow_nm), np.flatnonzero(red.peak_nm == red_nm)
            csd, chromatic = _apart(*own, yellows, reds)
            below: tuple[int | None, ...] = (None, None)
            if its is not None:
                both = zip((csd, chromatic), _apart(*its, yellows, reds), strict=True)
                below = tuple(int((mine < of_rggb).sum()) for mine, of_rggb in both)
            at = np.unravel_index(int(csd.argmin()), csd.shape)
            cells.append(
                {
                    "norm": norm,
                    "yellow_nm": float(yellow_nm),
                    "red_nm": float(red_nm),
                    "pairs": csd.size,
                    "separated": int((csd >= wanted_dn).sum()),
                    "below_rggb": below[0],
                    "chromatic_below_rggb": below[1],
                    "least_dn": float(csd[at]),
                    "yellow_fwhm_nm": float(yellow.fwhm_nm[yellows[at[0]]]),
                    "red_fwhm_nm": float(red.fwhm_nm[reds[at[1]]]),
                }
            )
    return cells


@dataclass(frozen=True)
class _Readings:
    """Numbers of LEDs in each phase, DN, and those without light."""

    dn: Float[Array, "phases lights channels"]
    dark: Float[Array, "phases channels"]


def _read(design: NamedDesign, leds: SingleLeds) -> _Readings:
    """Return DN of LEDs with the photons of the study's lights."""
    setup, parts = design.setup.with_all_effects, []
    photons = leds.photons(setup.camera.grid)
    for start in range(0, len(photons), _TOGETHER):
        part = photons[start : start + _TOGETHER]
        names = tuple(map(str, range(len(part))))
        lights = Lights("leds", names, names, part, setup.lights.photon_ratio, "modeled", surrogate=True)
        parts.append(SceneModel(replace(setup, lights=lights)).read(design.curves)[0][0])
    model = SceneModel(setup)
    return _Readings(np.concatenate(parts, axis=1), model.unlit(design.curves, model.exposure_s(design.curves))[0])


def _apart(
    first: _Readings, second: _Readings, firsts: Int[IndexArray, " firsts"], seconds: Int[IndexArray, " seconds"]
) -> tuple[Float[Array, "firsts seconds"], Float[Array, "firsts seconds"]]:
    """Return the CSD of each two lights and that of lamps of any brightness, the smallest over all phases, DN."""
    csd, chromatic = list[np.ndarray](), list[np.ndarray]()
    for a, b, dark in zip(first.dn, second.dn, first.dark, strict=True):
        one, other = a[firsts], b[seconds]
        csd.append(np.linalg.norm(one[:, None] - other[None], axis=2))
        lit = (np.repeat(one - dark, len(other), axis=0), np.tile(other - dark, (len(one), 1)))
        chromatic.append(np.sqrt(squared_distance(*lit)).reshape(len(one), len(other)))
    return np.asarray(np.min(csd, axis=0), dtype=float), np.asarray(np.min(chromatic, axis=0), dtype=float)


ALLOWED_LAMPS = Analysis("color regions", lambda study: study.section.regions is not None, lambda _: _SCHEMA, _calls)
