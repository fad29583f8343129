"""Data of the explorer: the front of the designs that were swept, and those with names, as plain values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..results.tables import SEARCHED, SWEPT
from .numbers import unit_shown
from .panels import LAMPS, styles_of
from .run import LIGHT, Run, name_of, unit_of, words_of

_STEP_NM, _MOST, _MOST_PARAMETERS = 4.0, 150, 4


def explorer_data(run: Run) -> dict[str, Any] | None:
    """Return designs with their figures and curves, ready for JSON; None where none was swept."""
    table, curves = run.output.table, run.output.curves
    own = (table["kind"] == SWEPT) & table["pareto"] & (table["scenario"] == run.scene) & (table["status"] == "ok")
    front = table[own & table["design_id"].isin([*curves.designs])]
    if front.empty or not run.output.table["kind"].isin([SWEPT, SEARCHED]).any():
        return None
    shown = front.iloc[np.unique(np.linspace(0, len(front) - 1, min(_MOST, len(front))).astype(int))]
    rows = {name_of(row): row for row in shown.to_dict("records")} | run.here
    names = [run.goal.name, LIGHT]
    for name in (*run.output.parameters, *run.output.constraints):
        known = [row[name] for row in rows.values() if np.isfinite(row.get(name, np.nan))]
        if known and np.ptp(known) > 0 and len(names) < _MOST_PARAMETERS + 2:
            names.append(name)
    names = list(dict.fromkeys(names))
    columns, factors = [], []
    for name in names:
        column = run.output.columns.get(name)
        words, unit = (
            (name.removesuffix("_nm").replace("_", " "), "nm")
            if column is None
            else (words_of(column), unit_of(column))
        )
        factors.append(unit_shown(unit)[0])
        columns.append(f"{words} / {unit_shown(unit)[1]}".removesuffix(" / "))
    nm = curves.wavelength_nm
    at = np.unique(np.searchsorted(nm, np.arange(nm[0], nm[-1] + 1e-6, _STEP_NM)).clip(max=len(nm) - 1))
    styles = styles_of(run.here)
    designs = [
        {
            "name": name,
            "hero": name == run.hero,
            "color": styles[name].color if name in styles else "#7aa7e0",
            "values": _numbers(
                factor * float(row.get(key, np.nan)) for key, factor in zip(names, factors, strict=True)
            ),
            "qe": {
                channel: _numbers(100 * qe[at]) for channel, qe in curves.designs.get(int(row["design_id"]), {}).items()
            },
        }
        for name, row in rows.items()
        if np.isfinite([row[run.goal.name], row[LIGHT]]).all()
    ]
    lamps = [{"color": LAMPS.get(kind, "#bbbbbb"), "values": _numbers(area[at])} for kind, area in run.lamps.items()]
    return {"columns": columns, "nm": _numbers(nm[at]), "lamps": lamps, "designs": designs}


def _numbers(values: Iterable[float]) -> list[float | None]:
    """Return numbers of five digits; null for what is none."""
    return [float(f"{value:.5g}") if np.isfinite(value) else None for value in values]
