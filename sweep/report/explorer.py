"""Data of the explorer: the front and named designs, their curves and their readings, as plain values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.limiting import BETWEEN, limited_by_name
from ..results.output import Output
from ..results.tables import NAMED, REFERENCE, SEARCHED, SWEPT
from .leaders import Row, answering, label, leaders_of, reference_of
from .look import CHANNELS, DIM, LAMPS, styles_of
from .sections.trade_off import lamp_areas
from .words import lamp, quantity

_STEP_NM = 4.0
_MOST = 150
_MOST_COLUMNS = 8


def explorer_data(output: Output) -> dict[str, Any] | None:
    """Return what the page's script draws, ready for JSON; None where no design was swept or searched."""
    scenario, column = leaders_of(output).scenario, output.trade_off[0]
    rows = output.table[(output.table["scenario"] == scenario) & (output.table["status"] == "ok")]
    if not rows["kind"].isin([SWEPT, SEARCHED]).any():
        return None
    named = rows[rows["kind"].isin([REFERENCE, NAMED, SEARCHED])]
    front = rows[(rows["kind"] == SWEPT) & rows["pareto"] & rows["design_id"].isin(list(output.curves.designs))]
    front = (
        front.iloc[np.unique(np.linspace(0, max(0, len(front) - 1), min(_MOST, len(front))).round().astype(int))]
        if len(front)
        else front
    )
    shown = [*named.to_dict("records"), *front.to_dict("records")]
    shown = [row for row in shown if np.isfinite(float(row[column.name]))]
    columns = _columns(output, shown)
    nm = output.curves.wavelength_nm
    at = np.unique(np.searchsorted(nm, np.arange(nm[0], nm[-1] + 1e-6, _STEP_NM)).clip(max=len(nm) - 1))
    best, rggb = answering(output), reference_of(output, scenario)
    styles = styles_of(label(row) for row in shown if row["kind"] != SWEPT)
    return {
        "x": CFA_SENSITIVITY,
        "y": column.name,
        "level": None if rggb is None else [label(rggb), _number(rggb[column.name])],
        "columns": [{"name": name, "words": words, "factor": factor} for name, words, factor in columns],
        "nm": [float(value) for value in nm[at]],
        "sensor": {
            name: {"color": CHANNELS.get(name, DIM), "qe": _thousandths(curve[at])}
            for name, curve in output.curves.sensor.items()
        },
        "lamps": [
            {"color": LAMPS.get(kind, "#bbbbbb"), "v": _thousandths(area[at])}
            for kind, area in lamp_areas(output).items()
        ],
        "designs": [
            {
                "name": label(row),
                "kind": str(row["kind"]),
                "color": styles[label(row)].color if row["kind"] != SWEPT else "#7aa7e0",
                "best": best is not None and row["design_id"] == best["design_id"],
                "feasible": bool(row["feasible"]),
                "v": [_number(row[name]) for name, _, _ in columns],
                "qe": {
                    channel: _thousandths(qe[at])
                    for channel, qe in output.curves.designs.get(int(row["design_id"]), {}).items()
                },
                "plain": _plain(output, str(row["cfa"])),
                "reading": _reading(output, row),
            }
            for row in shown
        ],
    }  # fmt: skip


def _columns(output: Output, shown: Sequence[Row]) -> list[tuple[str, str, float]]:
    """Return name, words and factor of the columns: separation, light, parameters, constraints, other separations."""
    used = [name for name in output.parameters if any(np.isfinite(float(row.get(name, np.nan))) for row in shown)]
    names = [output.trade_off[0].name, CFA_SENSITIVITY, *used[:4], *output.constraints, *output.distances]
    columns = []
    for name in dict.fromkeys(names):
        if name in (shown[0] if shown else {}) and any(np.isfinite(float(row[name])) for row in shown):
            light = name in output.columns and output.columns[name].role == "light"
            unit = output.columns[name].unit if name in output.columns else ""
            known = output.columns.get(name)
            words = name.removesuffix("_nm").replace("_", " ") if known is None else quantity(known)
            unit = "%" if light else "nm" if name.endswith("_nm") else unit
            columns.append((name, f"{words} / {unit}" if unit else words, 100.0 if light else 1.0))
    return columns[:_MOST_COLUMNS]


def _plain(output: Output, cfa: str) -> list[str]:
    """Return the names of the sensor's curves of a CFA's channels; a modified channel has none."""
    renamed = output.study.cfas[cfa].curves
    names = (renamed.get(channel, channel) for channel in output.mosaic(cfa).channels)
    return [name for name in dict.fromkeys(names) if name in output.curves.sensor]


def _reading(output: Output, row: Row) -> str:
    """Return the digital numbers of the two lamps that limit a design, channel by channel."""
    pair = output.trade_off[0].pair
    limited = row.get(limited_by_name(pair)) if pair else None
    if not isinstance(limited, str):
        return ""
    points = output.points[output.points["design_id"] == row["design_id"]]
    parts = []
    for kind, name in zip(pair or (), limited.split(BETWEEN), strict=True):
        own = points[(points["signal"] == name) & (points["signal_type"] == kind)]
        if own.empty:
            return ""
        parts.append(f"{lamp(name)}: {', '.join(f'{r.channel} {r.dn:,.0f}' for r in own.itertuples())} DN")
    return "; ".join(parts)


def _number(value: Any) -> float | None:
    number = float(value)
    return float(f"{number:.5g}") if np.isfinite(number) else None


def _thousandths(values: np.ndarray) -> list[int]:
    return [round(1000 * float(value)) for value in values]
