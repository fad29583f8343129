"""Data of the script of the report's page, as plain values and packed numbers."""

from __future__ import annotations

import base64
import shlex
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from ..metrics.columns.color_separation import CSD
from ..metrics.limiting import limited_by_name
from ..metrics.pareto import knee
from ..results.output import Output
from ..results.tables import NAMED, REFERENCE, SEARCHED, SWEPT
from . import values as content
from .figures import COLORS, CURVE_COLORS, TYPE_COLORS
from .leaders import leaders_of
from .noise import all_series
from .series import SeriesFigure
from .signal_figures import nearest_lights, signals_of
from .trade_off import TradeOff, around_designs, pareto_figure, traded_cfas

_OF_PARAMETERS, _OF_OTHERS = 2, 4
"""Digits of columns that are no quantities."""
GROUPS = ("infeasible", "feasible", "front", "named", "best", "plain")
_PUBLISHED = "RYN4Cy"
_PUBLISHED_LABEL = "model of the paper's RYN4Cy"


def payload(output: Output) -> dict[str, Any]:
    """Return the data of the page's script, ready for JSON.

    NaN only inside packed numbers.
    """
    rows = content.drawn_rows(output)
    columns, named = _columns(output, rows), rows[rows["name"].notna()]
    return {
        "study": output.study.study,
        "axes": {"x": output.trade_off[1].name, "y": output.trade_off[0].name},
        "objective": output.goal.name,
        "parameters": [name for name in output.parameters if name in columns],
        "columns": columns,
        "groups": list(GROUPS),
        "group": _packed(_groups(rows), "u1"),
        "design_id": _packed(rows["design_id"], "u4"),
        "filter_id": _packed(rows["filter_id"], "u4"),
        "scenario": _words(rows["scenario"]),
        "cfa": _words(rows["cfa"]),
        "names": {str(at): _names(output, row) for at, row in named.to_dict("index").items()},
        "overviews": [
            {"scenario": scenario, **_around(around_designs(output, scenario))} for scenario in output.scenarios
        ],
        "chosen": _chosen(output, rows),
        "views": list(_views(output, rows)),
        "curves": _curves(output),
        "clouds": _clouds(output, rows),
        "cloud_scenario": output.scenarios[0],
        "limited": _limited(output, rows),
        "nearest": _nearest(output, rows),
        "front": _front(output, rows),
        "series": [_series(series) for series in all_series(output)],
        "swept": bool((rows["kind"] == SWEPT).any()),
        "colors": {"groups": COLORS, "curves": CURVE_COLORS, "types": TYPE_COLORS},
        "folder": shlex.quote(output.folder.as_posix()),
    }


def _chosen(output: Output, rows: pd.DataFrame) -> dict[str, int]:
    """Return the row of the best design of each scenario, as the answer names it."""
    place = {design: at for at, design in enumerate(rows["design_id"].tolist())}
    best = {scenario: leaders_of(output, scenario).chosen for scenario in output.scenarios}
    return {scenario: place[row["design_id"]] for scenario, row in best.items() if row and row["design_id"] in place}


def _packed(values: Any, kind: str) -> dict[str, str]:
    """Return numbers as base64 of little-endian bytes."""
    return {"dtype": kind, "bdata": base64.b64encode(np.asarray(values).astype(f"<{kind}").tobytes()).decode("ascii")}


def _numbers(values: np.ndarray) -> dict[str, Any]:
    """Return numbers, or if there are few, these and their indices."""
    distinct, codes = np.unique(values, return_inverse=True)
    if len(distinct) > 256:
        return {"values": _packed(values, "f4")}
    return {"values": _packed(distinct, "f4"), "codes": _packed(codes, "u1")}


def _words(values: pd.Series) -> dict[str, Any]:
    """Return the words of a column, and the index of each row's word."""
    codes, words = pd.factorize(values.astype(str))
    return {"words": [str(word) for word in words], "codes": _packed(codes, "u1" if len(words) <= 256 else "u2")}


def _groups(rows: pd.DataFrame) -> np.ndarray:
    """Return the index into GROUPS of each row."""
    front = rows["feasible"] & rows["pareto"]
    kinds = [rows["kind"] == kind for kind in (REFERENCE, SEARCHED, NAMED)]
    return np.select([*kinds, front, rows["feasible"]], [5, 4, 3, 2, 1], default=0)


def _names(output: Output, row: Mapping[Any, Any]) -> dict[str, str]:
    """Return a design's name, short and in full; the published one is marked."""
    name = str(row["name"])
    entry = output.study.designs.get(name)
    published = f" ({_PUBLISHED_LABEL})" if entry is not None and entry.at == _PUBLISHED else ""
    return {"short": name, "long": name + published}


def _columns(output: Output, rows: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """Return label, digits and values of every column with information on designs."""
    axes = [axis.name for axis in output.trade_off]
    names = (*axes, *output.parameters, *output.distances, *output.light, *output.further, "violation")
    columns = {}
    for name in dict.fromkeys(names):
        values = rows[name].to_numpy(dtype=float)
        if np.isfinite(values).any() or name in axes:
            quantity, digits = output.columns.get(name), _OF_PARAMETERS if name in output.parameters else _OF_OTHERS
            digits = digits if quantity is None else quantity.digits
            columns[name] = {"label": output.words(name), "digits": digits, **_numbers(values)}
    return columns


def _views(output: Output, rows: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Yield lines, levels of plain CFAs, bound and knee of each scenario and CFA."""
    for scenario in output.scenarios:
        for cfa in traded_cfas(output):
            figure = pareto_figure(output, scenario, cfa)
            yield {
                "scenario": scenario,
                "cfa": cfa,
                **_around(figure),
                "levels": {name: float(level) for name, level in figure.levels.items() if np.isfinite(level)},
                "counts": dict(figure.counts),
                "bound": figure.bound,
                "bound_text": figure.bound_text,
                "knee": _knee(figure, output, rows[(rows["scenario"] == scenario) & (rows["cfa"] == cfa)]),
            }


def _around(figure: TradeOff) -> dict[str, Any]:
    """Return words of a trade-off, and optima and upper bound of the search as lists of x and y."""
    lines = {"traced": figure.traced, "limit": figure.limit}
    return {
        **{name: getattr(figure, name) for name in ("title", "x_label", "y_label", "limit_name")},
        **{name: None if points is None else [points.x.tolist(), points.y.tolist()] for name, points in lines.items()},
    }


def _limited(output: Output, rows: pd.DataFrame) -> dict[str, Any]:
    """Return label and limiting lights of each CSD column; no word where they are unknown."""
    columns = [column for column in map(output.columns.get, output.distances) if column and column.metric == CSD]
    return {
        column.name: {"label": f"{column.words} limited by", **_words(rows[limited_by_name(column.pair)].fillna(""))}
        for column in columns
        if column.pair is not None and limited_by_name(column.pair) in rows
    }


def _nearest(output: Output, rows: pd.DataFrame) -> dict[str, Any]:
    """Return the two lights that limit the trade-off's CSD, by design_id."""
    drawn = rows[rows["design_id"].isin(output.points["design_id"])]
    nearest = {str(row["design_id"]): nearest_lights(output, row) for row in drawn.to_dict("records")}
    return {design: lights for design, lights in nearest.items() if lights is not None}


def _knee(figure: TradeOff, output: Output, rows: pd.DataFrame) -> int | None:
    """Return the row of the front's knee."""
    front = figure.groups["front"]
    order = np.argsort(front.x, kind="stable")
    at = knee(np.stack([front.x[order], front.y[order]], axis=1))
    if at is None:
        return None
    separation, sensitivity = (rows[axis.name] for axis in output.trade_off)
    return int(rows.index[(sensitivity == front.x[order][at]) & (separation == front.y[order][at])][0])


def _curves(output: Output) -> dict[str, Any]:
    """Return QE of sensor and kept designs, and those of upper bounds, over the wavelength."""
    curves = output.curves
    return {
        "wavelength_nm": _packed(curves.wavelength_nm, "f4"),
        "sensor": {name: _packed(qe, "f4") for name, qe in curves.sensor.items()},
        "limits": {cfa: _packed(qe, "f4") for cfa, qe in curves.limits.items()},
        "designs": {
            str(at): {channel: _packed(qe, "f4") for channel, qe in filters.items()}
            for at, filters in curves.designs.items()
        },
        "shades": {kind: _packed(shade, "f4") for kind, shade in content.light_shades(output).items()},
        "plain": {cfa: content.channel_curves(output, cfa) for cfa in output.study.cfas},
        "ends": {cfa: content.end_curves(output, cfa) for cfa in dict.fromkeys(output.table["cfa"].astype(str))},
    }


def _clouds(output: Output, rows: pd.DataFrame) -> dict[str, Any]:
    """Return digital numbers of the signals of kept designs, channel by channel."""
    clouds: dict[str, Any] = {"designs": {}, "channels": {}, "types": [], "names": []}
    cfas = dict(zip(rows["design_id"], rows["cfa"].astype(str), strict=True))
    for design in output.points["design_id"].unique():
        if design in cfas:
            channels, signals, dn = signals_of(output, design)
            clouds["types"], clouds["names"] = [kind for kind, _ in signals], [name for _, name in signals]
            clouds["channels"][cfas[design]] = channels
            clouds["designs"][str(design)] = _packed(dn, "f4")
    return clouds


def _finite(values: np.ndarray) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


_OF_SERIES = ("title", "x_label", "y_label", "band", "note", "log_x", "log_y", "from_zero", "level")


def _series(series: SeriesFigure) -> dict[str, Any]:
    lines = {
        name: {
            "y": _finite(line.y),
            "upper": None if line.upper is None else _finite(line.upper),
            "passes": line.passes,
            "drawn": [_finite(values) for values in line.over(series.x)],
        }
        for name, line in series.lines.items()
    }
    return {**{key: getattr(series, key) for key in _OF_SERIES}, "x": series.x.tolist(), "lines": lines}


def _front(output: Output, rows: pd.DataFrame) -> dict[str, Any]:
    """Return the feasible front with every digit, for its file."""
    front = rows[rows["feasible"] & rows["pareto"] & (rows["kind"] == SWEPT)]
    used = [name for name in output.parameters if front[name].notna().any()]
    names = ["design_id", "filter_id", "scenario", "cfa", *used, *output.distances]
    names += [name for name in dict.fromkeys((*output.light, *output.further)) if name not in names]
    return {
        "columns": names,
        "rows": [[_plain(value) for value in row] for row in front[names].itertuples(index=False)],
    }


def _plain(value: Any) -> Any:
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return str(value)
