"""Curves of the filters of a study's designs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..base.types import FloatArray
from ..designs.glass import IN_FRONT
from ..results.output import Output
from .figures import BOUND_FILTER_NAME, CurvesFigure
from .names import label
from .values import drawn, light_shades, modifications


def filters_figure(output: Output, cfa: str) -> CurvesFigure:
    """Modified channels of the named designs and the best ones of a CFA, beside the green and yellow pixels' curves and
    those that they go between.
    """
    rows = drawn(output)
    rows = rows[rows["cfa"] == cfa]
    ends = end_curves(output, cfa)
    curves = {name: values for name, values in output.curves.sensor.items() if name in ends}
    for row in rows.to_dict("records"):
        made = output.curves.drawn[row["design_id"]]
        if str(row["family"]).endswith(IN_FRONT):
            curves[label(row)] = _transmission(output, cfa, made)
        else:
            curves |= {label(row) + (f", {channel}" if len(made) > 1 else ""): qe for channel, qe in made.items()}
    if cfa in output.curves.limits:
        curves[BOUND_FILTER_NAME] = output.curves.limits[cfa]
    dashed = (*ends, BOUND_FILTER_NAME)
    in_front = any(str(family).endswith(IN_FRONT) for family in rows["family"])
    return CurvesFigure(
        f"{cfa}: filters in front of the lens" if in_front else f"{cfa}: modified channel",
        "QE; of filters in front of the lens transmission" if in_front else "QE",
        output.curves.wavelength_nm,
        curves,
        dashed,
        {BOUND_FILTER_NAME: "#000000"},
        light_shades(output),
    )


def _transmission(output: Output, cfa: str, made: Mapping[str, FloatArray]) -> FloatArray:
    """Of a filter in front of the lens, from the channels behind it: 0 where none of them sees anything."""
    renamed = output.study.cfas[cfa].curves
    bare = np.sum([output.curves.sensor[renamed.get(channel, channel)] for channel in made], axis=0)
    behind = np.sum(list(made.values()), axis=0)
    return np.asarray(np.divide(behind, bare, out=np.zeros_like(behind), where=bare > 0), dtype=float)


def end_curves(output: Output, cfa: str) -> list[str]:
    """Names of the sensor's curves that a CFA's filters go between, and those of the green and the yellow pixel."""
    entries = [entry for entry in modifications(output) if entry.cfa == cfa]
    ends = {end for entry in entries for end in (entry.base, entry.to) if isinstance(end, str)} | {"G", "Y"}
    return [name for name in output.curves.sensor if name in ends]
