"""Separations of designs over the yellow and red LEDs that a norm allows."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ...base.types import delayed
from ...results.tables import RGGB
from ...runs.analysis import Calls, NamedDesign, named_designs, table_of_calls
from ...study import Study
from . import REGIONS_MAP
from .led_readings import Readings, apart, read
from .section import Norm, SingleLeds, all_leds

if TYPE_CHECKING:
    import pandas as pd

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
    regions = study.section.key("regions")
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
        own = _both(design, yellow, red)
        its = None if rggb is None else _both(rggb, yellow, red)
        for yellow_nm, red_nm in product(np.unique(yellow.peak_nm), np.unique(red.peak_nm)):
            yellows, reds = np.flatnonzero(yellow.peak_nm == yellow_nm), np.flatnonzero(red.peak_nm == red_nm)
            csd, chromatic = apart(*own, yellows, reds)
            below: tuple[int | None, ...] = (None, None)
            if its is not None:
                both = zip((csd, chromatic), apart(*its, yellows, reds), strict=True)
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


def _both(design: NamedDesign, yellow: SingleLeds, red: SingleLeds) -> tuple[Readings, Readings]:
    grid = design.setup.camera.grid
    return read(design, yellow.photons(grid)), read(design, red.photons(grid))


ALLOWED_LAMPS = table_of_calls(
    REGIONS_MAP, "color regions", lambda study: study.section.key("regions") is not None, lambda _: _SCHEMA, _calls
)
