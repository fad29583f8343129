"""Curves of the filters of a study's designs."""

from __future__ import annotations

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
        curves |= {label(row) + (f", {channel}" if len(made) > 1 else ""): qe for channel, qe in made.items()}
    if cfa in output.curves.limits:
        curves[BOUND_FILTER_NAME] = output.curves.limits[cfa]
    dashed = (*ends, BOUND_FILTER_NAME)
    return CurvesFigure(
        f"{cfa}: modified channel",
        "QE",
        output.curves.wavelength_nm,
        curves,
        dashed,
        {BOUND_FILTER_NAME: "#000000"},
        light_shades(output),
    )


def end_curves(output: Output, cfa: str) -> list[str]:
    """Names of the sensor's curves that a CFA's filters go between, and those of the green and the yellow pixel."""
    entries = [entry for entry in modifications(output) if entry.cfa == cfa]
    ends = {end for entry in entries for end in (entry.base, entry.to) if isinstance(end, str)} | {"G", "Y"}
    return [name for name in output.curves.sensor if name in ends]
