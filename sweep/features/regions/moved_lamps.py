"""Lamps a design fails on: from which peak of a red LED on it separates less than RGGB does at the same red."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ...base.types import Array, Float, delayed
from ...metrics.columns.chromatic import CHROMATIC_CSD
from ...metrics.columns.color_separation import CSD
from ...results.tables import REFERENCE, RGGB
from ...runs.analysis import Calls, NamedDesign, named_designs, table_of_calls
from ...spectra.color import chromaticity
from ...spectra.signal_color import VISIBLE
from ...study import Study
from . import LAMP_LIMITS
from .led_readings import apart, read
from .moved_leds import FIRST_NM, moved, red_shapes

if TYPE_CHECKING:
    import pandas as pd

PAIR = ("yellow", "red")
_STEP_NM, _STEPS = 0.1, 600
"""Steps in which reds move, and how many."""
_MARGIN_NM = 20.0
"""Peaks so near an end of the grid are left out: it would cut the LED."""
_NUMBERS = ("red_limit_nm", "red_limit_x", "red_limit_y", "red_limit_dn", "yellow_limit_nm", "wanted_limit_nm",
            "deepest_nm", "deepest_ratio")  # fmt: skip
_SCHEMA = pa.schema(
    [
        ("design_id", pa.int64()),
        ("shape", pa.string()),
        ("quantity", pa.string()),
        *((n, pa.float64()) for n in _NUMBERS),
    ]
)


def _asked(study: Study) -> bool:
    """Return whether lamps fill the field of one scene, read once, and RGGB is there to compare with."""
    scenes = list(study.scenarios.values())
    plain = len(scenes) == 1 and scenes[0].target is None and scenes[0].drive is None and scenes[0].field is None
    pair = study.quantities[study.trade_off[0]].pair
    return plain and pair == PAIR and RGGB in study.mosaics and not study.section.pixel.captures


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Compute limits of designs with a filter: a row for each shape of the LED and quantity.

    `red_limit_nm` is the peak from which on the least distance of a red to the study's yellows is less than RGGB's at
    the same red, with its color, x and y, and the distance there; `yellow_limit_nm` the same toward the yellow;
    `wanted_limit_nm` the peak from which on it is below the distance that the study wants. None: not up to 60 nm away.
    `deepest_ratio` is its distance over RGGB's at the deepest peak of the study's own reds.
    """
    designs = [*named_designs(study, rows)]
    rggb = next((one for one in designs if one.row["name"] == RGGB), None)
    population, regions = study.section.population, study.section.key("regions")
    wanted_dn = next(
        (of.wanted_dn for of in (population, regions) if of is not None and of.wanted_dn is not None), None
    )
    for design in designs:
        if rggb is not None and design.row["kind"] != REFERENCE:
            yield design.key, delayed(_limits, design, rggb, wanted_dn)


def _limits(design: NamedDesign, rggb: NamedDesign, wanted_dn: float | None) -> list[dict[str, Any]]:
    """Return the rows of one design."""
    peaks_nm, rows = np.asarray(FIRST_NM + _STEP_NM * np.arange(-_STEPS, _STEPS + 1), dtype=float), []
    for name, shape in red_shapes().items():
        grid = design.setup.camera.grid
        reds = moved(shape, peaks_nm, grid)
        own, its = _nearest(design, reds), _nearest(rggb, reds)
        peaks_of_study = design.setup.lights.photons[design.setup.members[PAIR[1]]].argmax(axis=1)
        deepest = int(np.abs(peaks_nm - grid.nodes_nm[peaks_of_study.max()]).argmin())
        inside = (peaks_nm >= grid.start_nm + _MARGIN_NM) & (peaks_nm <= grid.stop_nm - _MARGIN_NM)
        for quantity in (CSD, CHROMATIC_CSD):
            below = inside & (own[quantity] < its[quantity])
            red, yellow = _first(below[_STEPS:]), _first(below[_STEPS::-1])
            row: dict[str, Any] = {"shape": name, "quantity": f"{quantity}_{'_'.join(PAIR)}"}
            if its[quantity][deepest] > 0:
                row |= {
                    "deepest_nm": peaks_nm[deepest],
                    "deepest_ratio": own[quantity][deepest] / its[quantity][deepest],
                }
            if red is not None:
                peak = peaks_nm[_STEPS + red]
                x, y = chromaticity(VISIBLE, moved(shape, np.array([peak]), VISIBLE))[0]
                row |= {"red_limit_nm": peak, "red_limit_x": x, "red_limit_y": y}
                row["red_limit_dn"] = own[quantity][_STEPS + red]
            if yellow is not None:
                row["yellow_limit_nm"] = peaks_nm[_STEPS - yellow]
            near = inside & (own[quantity] < (wanted_dn or 0.0))
            if (at := _first(near[_STEPS:])) is not None:
                row["wanted_limit_nm"] = peaks_nm[_STEPS + at]
            rows.append({key: value if isinstance(value, str) else float(value) for key, value in row.items()})
    return rows


def _first(below: np.ndarray) -> int | None:
    """Return the place of the first that is true."""
    return int(below.argmax()) if below.any() else None


def _nearest(design: NamedDesign, reds: Float[Array, "reds wavelengths"]) -> dict[str, Float[Array, " reds"]]:
    """Return least distances of reds to the study's yellows, DN: CSD and that of lamps of any brightness."""
    yellows = design.setup.lights.photons[design.setup.members[PAIR[0]]]
    both = apart(read(design, yellows), read(design, reds))
    return dict(zip((CSD, CHROMATIC_CSD), (distances.min(axis=0) for distances in both), strict=True))


MOVED_LAMPS = table_of_calls(LAMP_LIMITS, "lamps that designs fail on", _asked, lambda _: _SCHEMA, _calls)
