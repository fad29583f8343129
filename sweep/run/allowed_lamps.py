"""How far each design tells the yellow and red LEDs apart that a norm allows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.forward import ForwardModel
from ..camera.setup import Setup
from ..curves.lights import Lights
from ..curves.single_leds import Norm, SingleLeds, every_led
from ..results.designs import row_curves
from ..results.tables import FEW
from ..study import Study

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


def regions_table(study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """A row per plain CFA, named design or answer of the search, norm, peak of the yellow and peak of the red LED.

    `pairs`: how many pairs of widths are allowed, `separated`: how many of these have at least the wanted distance, as
    read out with everything on; `least_dn`: the smallest distance, and the widths of these two LEDs.
    """
    asked = study.section.regions
    assert asked is not None
    leds = every_led(asked)
    allowed = {norm: (leds.allowed(norm, "yellow"), leds.allowed(norm, "red")) for norm in asked.norms}
    shown = rows[rows["kind"].isin(FEW) & (rows["status"] == "ok")].to_dict("records")
    calls = []
    for row in shown:
        space, curves = row_curves(study, row)
        setup = study.setup(space, row["scenario"]).with_all_effects
        calls.append(delayed(_cells, setup, curves, allowed, asked.wanted_dn))
    found: list[dict[str, Any]] = []
    for done, (row, cells) in enumerate(zip(shown, parallel(calls), strict=True), 1):
        found += [{"design_id": row["design_id"], **cell} for cell in cells]
        progress("color regions", done, len(shown))
    return pa.Table.from_pylist(found, schema=_SCHEMA)


def _cells(
    setup: Setup, curves: FloatArray, allowed: Mapping[Norm, tuple[SingleLeds, SingleLeds]], wanted_dn: float
) -> list[dict[str, Any]]:
    """The rows of a design; `allowed`: the yellow and the red LEDs of each norm."""
    found = list[dict[str, Any]]()
    for norm, (yellow, red) in allowed.items():
        yellow_dn, red_dn = (_read(setup, curves, each) for each in (yellow, red))
        for one in np.unique(yellow.peak_nm):
            of_one = np.flatnonzero(yellow.peak_nm == one)
            apart = apart_dn(yellow_dn[:, of_one], red_dn)
            for other in np.unique(red.peak_nm):
                of_other = np.flatnonzero(red.peak_nm == other)
                own = apart[:, of_other]
                at = np.unravel_index(int(own.argmin()), own.shape)
                found.append(
                    {
                        "norm": norm,
                        "yellow_nm": float(one),
                        "red_nm": float(other),
                        "pairs": own.size,
                        "separated": int((own >= wanted_dn).sum()),
                        "least_dn": float(own[at]),
                        "yellow_fwhm_nm": float(yellow.fwhm_nm[of_one[at[0]]]),
                        "red_fwhm_nm": float(red.fwhm_nm[of_other[at[1]]]),
                    }
                )
    return found


def _read(setup: Setup, curves: FloatArray, leds: SingleLeds) -> FloatArray:
    """What a design reads of LEDs with the photons of the study's lights, DN, ndarray[n_cases, n_leds, n_channels]."""
    photons, parts = leds.photons(setup.camera.grid), []
    for start in range(0, len(photons), _TOGETHER):
        some = photons[start : start + _TOGETHER]
        names = tuple(str(number) for number in range(len(some)))
        lights = Lights("leds", names, names, some, setup.lights.photon_ratio, "modeled", surrogate=True)
        parts.append(ForwardModel(replace(setup, lights=lights), once=True).read(curves)[0][0])
    return np.concatenate(parts, axis=1)


def apart_dn(first: FloatArray, second: FloatArray) -> FloatArray:
    """The smallest distance over all cases of each two lights, DN, ndarray[n_first, n_second].

    `first`, `second`: ndarray[n_cases, n_lights, n_channels].
    """
    each = [np.linalg.norm(a[:, None] - b[None], axis=2) for a, b in zip(first, second, strict=True)]
    return np.asarray(np.min(each, axis=0), dtype=float)
