"""Data of the report's figures, as plain values."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..results.facts import Origin
from ..results.output import Output
from ..results.shown import even
from ..results.tables import SWEPT
from ..study.schema import Modification
from .figures import TYPE_COLORS, CurvesFigure

if TYPE_CHECKING:
    import pandas as pd


_MOST_POINTS = 2500
"""Feasible and other designs each that a page draws beside the front."""


def sensor_figure(output: Output) -> CurvesFigure:
    """Return the sensor's QE curves."""
    title = f"Quantum efficiency, {_name(output.provenance.sensor)}"
    return CurvesFigure(title, "QE", output.curves.wavelength_nm, output.curves.sensor, shades=light_shades(output))


def lights_figure(output: Output) -> CurvesFigure:
    """Return the photon spectra of all signals."""
    bundles = {f"{kind} ({len(photons)})": photons for kind, photons in output.curves.bundles.items()}
    colors = {name: TYPE_COLORS[kind] for kind in TYPE_COLORS for name in bundles if name.startswith(f"{kind} (")}
    title = f"Signals, {_name(output.provenance.lights)}"
    return CurvesFigure(
        title, "photons per nm, each signal 1 photon", output.curves.wavelength_nm, bundles, colors=colors
    )


def light_shades(output: Output) -> dict[str, np.ndarray]:
    """Return the largest spectrum of each signal type at each wavelength, with peaks of 1."""
    return {
        kind: np.max(photons / photons.max(axis=1, keepdims=True), axis=0)
        for kind, photons in output.curves.bundles.items()
    }


def channel_curves(output: Output, cfa: str) -> list[str]:
    """Return the names of the sensor's curves of a CFA's channels; a modified channel has none."""
    renamed = output.study.cfas[cfa].curves
    names = (renamed.get(channel, channel) for channel in output.mosaic(cfa).channels)
    return [name for name in dict.fromkeys(names) if name in output.curves.sensor]


def modifications(output: Output) -> list[Modification]:
    """Return the study's named designs, sweeps and boxes."""
    study = output.study
    return [*study.designs.values(), *study.sweeps.values(), *study.boxes.values()]


def drawn_rows(output: Output) -> pd.DataFrame:
    """Return the rows that figures show as points: CFAs, named designs, answers, and an even sample of swept ones."""
    table = output.table[output.table["status"] == "ok"]
    is_drawn = (table["kind"] != SWEPT) | (table["feasible"] & table["pareto"])
    is_drawn |= table["design_id"].isin(output.points["design_id"])
    others = ~is_drawn
    for feasible in (True, False):
        group = np.flatnonzero(others & (table["feasible"] == feasible))
        is_drawn.iloc[group[even(group.size, _MOST_POINTS)]] = True
    return table[is_drawn].reset_index(drop=True)


def end_curves(output: Output, cfa: str) -> list[str]:
    """Return the names of the curves that a CFA's filters lie between, and those of the green and yellow pixel."""
    entries = [entry for entry in modifications(output) if entry.cfa == cfa]
    ends = {end for entry in entries for end in (entry.base, entry.to) if isinstance(end, str)} | {"G", "Y"}
    return [name for name in output.curves.sensor if name in ends]


def _name(origin: Origin) -> str:
    return f"{origin.name}{' (surrogate: modeled, not measured)' if origin.surrogate else ''}"
