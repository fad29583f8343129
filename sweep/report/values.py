"""What the figures of the report show, as plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from ..curves.color import display_colors
from ..curves.spectrum import WavelengthGrid
from ..metrics.evaluate import BEST_PLACE, WORST
from ..results.output import Output
from .figures import TYPE_COLORS, ChartFigure, Cloud, CurvesFigure, ParetoFigure, Points
from .names import amount, axis_label, label, worst_case
from .series import Line, SeriesFigure

LIMIT_NAME = "limit of any filter, unquantized"
_SENSITIVITY_LABELS = {
    "sensitivity": "sensitivity of the modified channel (1 = the channel it replaces)",
    "cfa_sensitivity": "sensitivity of the CFA (1 = a sensor without color filters)",
}


def pareto_figure(output: Output, scenario: str, cfa: str | None) -> ParetoFigure:
    """CSD against sensitivity in a scenario, for the designs of one CFA (None: named designs of any CFA)."""
    table = output.table[(output.table["scenario"] == scenario) & (output.table["status"] == "ok")]
    designs = table if cfa is None else table[table["cfa"] == cfa]
    swept = designs[designs["kind"] == "sweep"]
    named = designs[designs["kind"] == "design"]
    found = designs[designs["kind"] == "search"]
    references = table[table["kind"] == "reference"]
    front = swept["pareto"] & swept["feasible"]
    groups = {
        "infeasible": _points(output, swept[~swept["feasible"]]),
        "feasible": _points(output, swept[swept["feasible"] & ~front]),
        "front": _points(output, swept[front]),
        "named": _points(output, named, list(named["name"])),
        "best": _points(output, found, [amount(output.trade_off[0], v) for v in found[output.trade_off[0]]]),
    }
    bound = output.constraints.get(output.trade_off[1])
    limit = None if bound is None else bound.min
    where = "" if cfa is None else f", {cfa}"
    return ParetoFigure(
        title=f"{output.study['study']}{where}: what separation costs in sensitivity",
        x_label=worst_case(output.trade_off[1]) + _SENSITIVITY_LABELS[output.trade_off[1].removeprefix(WORST)],
        y_label=axis_label(output.trade_off[0]),
        groups=groups,
        lines=_trade_offs(output, scenario, cfa),
        levels=dict(zip(references["cfa"], references[output.trade_off[0]], strict=True)),
        bound=limit,
        bound_text="" if limit is None else f"{worst_case(output.trade_off[1])}sensitivity >= {limit:g}",
    )


def _trade_offs(output: Output, scenario: str, cfa: str | None) -> dict[str, Points]:
    """What the search traced, and the limit, where the search is of this CFA and scenario."""
    if output.front is None or cfa not in set(output.kind("search")["cfa"]):
        return {}
    if output.provenance["search"]["scenario"] != scenario:
        return {}
    traced = output.front.dropna(subset=["objective"])
    bounded = output.front.dropna(subset=["limit"])
    lines = {"front of the search": Points(traced["sensitivity"].to_numpy(), traced["objective"].to_numpy())}
    if len(bounded):
        lines[LIMIT_NAME] = Points(bounded["sensitivity_min"].to_numpy(), bounded["limit"].to_numpy())
    return lines


def _points(output: Output, rows: pd.DataFrame, labels: Sequence[str] = ()) -> Points:
    separation, sensitivity = output.trade_off
    x = rows[sensitivity].to_numpy(dtype=float)
    return Points(x, rows[separation].to_numpy(dtype=float), tuple(map(str, labels)))


def scenario_series(output: Output) -> dict[tuple[str, str], dict[str, float]]:
    """Sets of scenarios that differ in one number: (name, key) -> scenario -> number, in order of the numbers."""
    groups: dict[tuple[str, str], dict[str, float]] = {}
    for name in output.study["scenarios"]:
        base, _, last = str(name).rpartition(" ")
        key, equals, number = last.partition("=")
        value = _number(number)
        if base and equals and "=" not in base and value is not None:
            groups.setdefault((base, key), {})[name] = value
    ordered = {group: dict(sorted(found.items(), key=lambda item: item[1])) for group, found in groups.items()}
    return {group: found for group, found in ordered.items() if len(found) > 1}


def _number(text: str) -> float | None:
    """A finite number, or None: a scenario that a person named may have an `=` followed by anything."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def over_series(rows: pd.DataFrame, scenarios: Mapping[str, float], column: str) -> dict[str, np.ndarray]:
    """Values of a column over a series' numbers for every design that has them all, ndarray[n_scenarios] each."""
    found = {}
    for name, own in rows[rows["scenario"].isin(list(scenarios))].groupby("name", observed=True, sort=False):
        if len(own) == len(scenarios):
            found[str(name)] = own.set_index("scenario")[column].reindex(list(scenarios)).to_numpy(dtype=float)
    return found


def series_figures(output: Output) -> list[SeriesFigure]:
    """A figure for each set of scenarios that differ in one number: the separation of every named design over it."""
    rows = output.kind("reference", "design", "search")
    separation = output.trade_off[0]
    best_place = BEST_PLACE + separation
    figures = []
    for (base, key), scenarios in scenario_series(output).items():
        upper = over_series(rows, scenarios, best_place) if best_place in rows else {}
        upper = {name: values for name, values in upper.items() if np.isfinite(values).all()}
        lines = {n: Line(y, upper.get(n)) for n, y in over_series(rows, scenarios, separation).items()}
        if lines:
            band = "over the places on the mosaic" if upper else ""
            title = f"{output.study['study']}: {base}"
            x = np.array(list(scenarios.values()))
            figures.append(SeriesFigure(title, key, axis_label(separation), x, lines, band))
    return figures


def sensor_figure(output: Output) -> CurvesFigure:
    """The sensor's QE curves."""
    curves = _curves(output, "qe:")
    return CurvesFigure(f"Quantum efficiency, {_origin(output, 'sensor')}", "QE", _wave(output), curves)


def lights_figure(output: Output) -> CurvesFigure:
    """The photon spectra of all signals."""
    bundles = {f"{kind} ({len(photons)})": photons for kind, photons in _lights(output).items()}
    colors = {name: TYPE_COLORS[kind] for kind in TYPE_COLORS for name in bundles if name.startswith(f"{kind} (")}
    title = f"Signals, {_origin(output, 'lights')}"
    return CurvesFigure(title, "photons per nm, each signal 1 photon", _wave(output), bundles, colors=colors)


def chart_figure(output: Output) -> ChartFigure:
    """The color checker chart that the signals make."""
    grid = WavelengthGrid(**output.study["wavelengths"])
    patches = {kind: display_colors(grid, photons) for kind, photons in _lights(output).items()}
    return ChartFigure("Color checker chart: a patch per signal, as near as sRGB comes", patches)


def _lights(output: Output) -> dict[str, np.ndarray]:
    """Signal type -> photon spectra, ndarray[n_signals, n_wavelengths]."""
    types: dict[str, list[str]] = {}
    for column in output.curves.columns:
        if column.startswith("light:"):
            types.setdefault(column.split(":")[1], []).append(column)
    return {kind: output.curves[columns].to_numpy().T for kind, columns in types.items()}


def clouds(output: Output, *kinds: str) -> list[list[Cloud]]:
    """Point clouds of the designs of some kinds: a row per design, the first channel against each other one.

    A CFA of one channel has none.
    """
    rows = output.kind(*kinds)
    rows = rows[(rows["scenario"] == next(iter(output.study["scenarios"]))) & (rows["status"] == "ok")]
    found = []
    for row in rows.to_dict("records"):
        points = output.points[output.points["design_id"] == row["design_id"]]
        first, *others = dict.fromkeys(points["channel"])
        if others:
            found.append([_cloud(points, f"{label(row)}: {first}, {other}", first, other) for other in others])
    return found


def _cloud(points: pd.DataFrame, title: str, first: str, other: str) -> Cloud:
    types = {}
    for kind, signals in points.groupby("signal_type", sort=False):
        by_channel = {name: values["dn"].to_numpy() for name, values in signals.groupby("channel")}
        types[str(kind)] = (by_channel[first], by_channel[other])
    return Cloud(title, f"{first} / DN", f"{other} / DN", types)


def filters_figure(output: Output, cfa: str) -> CurvesFigure:
    """Modified channels of the named designs and the best ones of a CFA, beside the green and yellow pixels' curves and
    those that they go between.
    """
    rows = drawn(output)
    rows = rows[rows["cfa"] == cfa]
    ends = end_curves(output, cfa)
    curves = {name: values for name, values in _curves(output, "qe:").items() if name in ends}
    for row in rows.to_dict("records"):
        made = [c for c in output.curves.columns if c.startswith(f"design:{row['design_id']}:")]
        for number, column in enumerate(made):
            name = label(row) if len(made) == 1 else f"{label(row)}, {'ab'[number]}"
            curves[name] = output.curves[column].to_numpy()
    if f"limit:{cfa}" in output.curves.columns:
        curves[LIMIT_NAME] = output.curves[f"limit:{cfa}"].to_numpy()
    dashed = (*ends, LIMIT_NAME)
    return CurvesFigure(f"{cfa}: modified channel", "QE", _wave(output), curves, dashed, {LIMIT_NAME: "#000000"})


def end_curves(output: Output, cfa: str) -> list[str]:
    """Names of the sensor's curves that a CFA's filters go between, and those of the green and the yellow pixel."""
    entries = [entry for entry in modifications(output) if entry["cfa"] == cfa]
    ends = {end for entry in entries for end in (entry["base"], entry.get("to")) if isinstance(end, str)} | {"G", "Y"}
    return [name for name in _curves(output, "qe:") if name in ends]


def modifications(output: Output) -> list[dict[str, object]]:
    """The study's named designs and sweeps."""
    return [entry for key in ("designs", "sweeps", "boxes") for entry in output.study.get(key, {}).values()]


def drawn(output: Output) -> pd.DataFrame:
    """Rows whose filter's curve was kept: named designs, the search's answer, the best of each sweep."""
    ids = [int(c.split(":")[1]) for c in output.curves.columns if c.startswith("design:")]
    return output.table[output.table["design_id"].isin(ids)]


def _curves(output: Output, prefix: str) -> dict[str, np.ndarray]:
    return {c.removeprefix(prefix): output.curves[c].to_numpy() for c in output.curves.columns if c.startswith(prefix)}


def _wave(output: Output) -> np.ndarray:
    return output.curves["wavelength_nm"].to_numpy()


def _origin(output: Output, what: str) -> str:
    origin = output.provenance[what]
    return f"{origin['name']}{' (surrogate: modeled, not measured)' if origin['surrogate'] else ''}"
