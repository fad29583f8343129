"""What the figures of the report show, as plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..curves.color import display_colors
from ..metrics.limiting import BETWEEN, limited_by_name
from ..metrics.quantity import Column
from ..results.facts import Origin
from ..results.output import Output
from ..results.tables import FOUND, NAMED, PLAIN, SWEPT
from ..study.axes import series_of
from ..study.schema import Modification
from .figures import TYPE_COLORS, CurvesFigure, ParetoFigure, Points
from .names import label
from .series import Line, SeriesFigure
from .signal_figures import ChartFigure, Cloud
from .upper_bound import bounds_figure, limit_name

if TYPE_CHECKING:
    import pandas as pd

Nearest = tuple[tuple[str, str], tuple[str, str], str]
"""(type, name) of two lights, and their distance in words."""
_LEAST_RANGE = 1e-3
"""Designs whose sensitivities differ by less do not trade it for anything."""


def pareto_figure(output: Output, scenario: str, cfa: str) -> ParetoFigure:
    """CSD against sensitivity in a scenario, for the designs of one CFA."""
    table = output.table[(output.table["scenario"] == scenario) & (output.table["status"] == "ok")]
    designs = table[table["cfa"] == cfa]
    swept, named, found = (designs[designs["kind"] == kind] for kind in (SWEPT, NAMED, FOUND))
    references = table[table["kind"] == PLAIN]
    separation, sensitivity = output.trade_off
    front = swept["pareto"] & swept["feasible"]
    groups = {
        "infeasible": _points(output, swept[~swept["feasible"]]),
        "feasible": _points(output, swept[swept["feasible"] & ~front]),
        "front": _points(output, swept[front]),
        "named": _points(output, named, list(named["name"])),
        "best": _points(output, found, [separation.told(v) for v in found[separation.name]]),
    }
    bound = output.constraints.get(sensitivity.name)
    least = None if bound is None else bound.min
    traced, limit = _trade_offs(output, scenario, cfa)
    return ParetoFigure(
        title=f"{output.study.study}, {cfa}: what separation costs in sensitivity",
        x_label=_whole_words(output, sensitivity),
        y_label=separation.axis,
        groups=groups,
        traced=traced,
        limit=limit,
        levels=dict(zip(references["cfa"], references[separation.name], strict=True)),
        bound=least,
        bound_text="" if least is None else f"{sensitivity.words} at least {least:g}",
        limit_name=limit_name(output),
        counts={
            "infeasible": output.counts.feasible(scenario, cfa, met=False),
            "feasible": output.counts.feasible(scenario, cfa),
            "front": output.counts.front(scenario, cfa),
        },
    )


def _whole_words(output: Output, column: Column) -> str:
    """What a column means; of a worst case that of the quantity itself."""
    plain = output.columns[column.of] if column.extreme else column
    return column.words.removesuffix(plain.words) + plain.meaning


def _trade_offs(output: Output, scenario: str, cfa: str) -> tuple[Points | None, Points | None]:
    """What the search traced, and the limit, where the search is of this CFA and scenario."""
    search = output.provenance.search
    if output.front is None or search is None or (search.scenario, search.cfa) != (scenario, cfa):
        return None, None
    traced = output.front.dropna(subset=["objective"])
    bounded = output.front.dropna(subset=["limit"]) if bounds_figure(output, scenario, cfa) else output.front[:0]
    limit = Points(bounded["sensitivity_min"].to_numpy(), bounded["limit"].to_numpy()) if len(bounded) else None
    return Points(traced["sensitivity"].to_numpy(), traced["objective"].to_numpy()), limit


def trades_off(output: Output, cfa: str) -> bool:
    """Whether designs of a CFA give sensitivity for separation: swept ones, or what a search traced."""
    rows = output.kind(SWEPT)
    own = rows[(rows["cfa"] == cfa) & (rows["status"] == "ok")]["sensitivity"].to_numpy(dtype=float)
    traced = _trade_offs(output, output.scenarios[0], cfa)[0]
    both = np.concatenate([own, np.empty(0) if traced is None else traced.x])
    both = both[np.isfinite(both)]
    return bool(both.size and np.ptp(both) > _LEAST_RANGE)


def _points(output: Output, rows: pd.DataFrame, labels: Sequence[str] = ()) -> Points:
    separation, sensitivity = output.trade_off
    x = rows[sensitivity.name].to_numpy(dtype=float)
    return Points(x, rows[separation.name].to_numpy(dtype=float), tuple(map(str, labels)))


def over_series(rows: pd.DataFrame, scenarios: Mapping[str, float], column: str) -> dict[str, np.ndarray]:
    """Values of a column over a series' numbers for every design that has them all, ndarray[n_scenarios] each."""
    found: dict[str, dict[str, float]] = {}
    for name, scenario, value in zip(rows["name"], rows["scenario"], rows[column].to_numpy(dtype=float), strict=True):
        if scenario in scenarios and isinstance(name, str):
            found.setdefault(name, {})[scenario] = value
    return {
        name: np.array([own[scenario] for scenario in scenarios])
        for name, own in found.items()
        if len(own) == len(scenarios)
    }


def series_figures(output: Output) -> list[SeriesFigure]:
    """A figure for each set of scenarios that differ in one number: the separation of every named design over it."""
    return output.once("separations over series", partial(_series_figures, output))


def _series_figures(output: Output) -> list[SeriesFigure]:
    rows, separation = output.few, output.trade_off[0]
    best_place = next(
        (c.name for c in output.columns.values() if (c.extreme, c.of) == ("best place", separation.name)), ""
    )
    figures, series = [], series_of(output.scenarios)
    for (base, key), scenarios in series.items():
        upper = over_series(rows, scenarios, best_place) if best_place in rows else {}
        worst = over_series(rows, scenarios, separation.name)
        upper = {n: y for n, y in upper.items() if np.isfinite(y).all() and not np.array_equal(y, worst[n])}
        lines = {name: Line(y, upper.get(name)) for name, y in worst.items()}
        if lines:
            band = "over the places on the mosaic" if upper else ""
            title = f"{output.study.study}, {base}: {separation.words}"
            x = np.array(list(scenarios.values()))
            among = base if [other for _, other in series].count(key) > 1 else ""
            figures.append(SeriesFigure(title, key, separation.axis, x, lines, band, among=among))
    return figures


def sensor_figure(output: Output) -> CurvesFigure:
    """The sensor's QE curves."""
    title = f"Quantum efficiency, {_name(output.provenance.sensor)}"
    return CurvesFigure(title, "QE", output.curves.wavelength_nm, output.curves.sensor, shades=light_shades(output))


def lights_figure(output: Output) -> CurvesFigure:
    """The photon spectra of all signals."""
    bundles = {f"{kind} ({len(photons)})": photons for kind, photons in output.curves.bundles.items()}
    colors = {name: TYPE_COLORS[kind] for kind in TYPE_COLORS for name in bundles if name.startswith(f"{kind} (")}
    title = f"Signals, {_name(output.provenance.lights)}"
    return CurvesFigure(
        title, "photons per nm, each signal 1 photon", output.curves.wavelength_nm, bundles, colors=colors
    )


def light_shades(output: Output) -> dict[str, np.ndarray]:
    """Signal type -> the largest of its spectra at each wavelength, each with a peak of 1, ndarray[n_wavelengths]."""
    return {
        kind: np.max(photons / photons.max(axis=1, keepdims=True), axis=0)
        for kind, photons in output.curves.bundles.items()
    }


def chart_figure(output: Output) -> ChartFigure:
    """The color checker chart that the signals make."""
    grid = output.study.wavelengths
    patches = {kind: display_colors(grid, photons) for kind, photons in output.curves.bundles.items()}
    return ChartFigure("Color checker chart: a patch per signal, as near as sRGB comes", patches)


def clouds(output: Output, *kinds: str) -> list[list[Cloud]]:
    """Point clouds of the designs of some kinds: a row per design, the first channel against each other one.

    A CFA of one channel has none.
    """
    rows = output.kind(*kinds)
    rows = rows[(rows["scenario"] == output.scenarios[0]) & (rows["status"] == "ok")]
    found = []
    for row in rows.to_dict("records"):
        points = output.points[output.points["design_id"] == row["design_id"]]
        first, *others = dict.fromkeys(points["channel"])
        if others:
            near = nearest_lights(output, row)
            found.append([_cloud(points, f"{label(row)}: {first}, {other}", first, other, near) for other in others])
    return found


def nearest_lights(output: Output, row: Mapping[Any, Any]) -> Nearest | None:
    """(type, name) of the two lights that limit a row's separation, and their distance in words."""
    separation = output.trade_off[0]
    if separation.pair is None:
        return None
    one, other = separation.pair
    text = row.get(limited_by_name(separation.pair))
    ones, others = ([name for kind, name in output.curves.lights if kind == each] for each in separation.pair)
    named = {f"{a}{BETWEEN}{b}": (a, b) for a in ones for b in others}
    if text not in named:
        return None
    a, b = named[str(text)]
    return (one, a), (other, b), separation.told(row[separation.of or separation.name])


def _cloud(points: pd.DataFrame, title: str, first: str, other: str, near: Nearest | None) -> Cloud:
    both = [points[points["channel"] == channel] for channel in (first, other)]
    x, y = (own["dn"].to_numpy() for own in both)
    kinds, names = (both[0][column].to_numpy() for column in ("signal_type", "signal"))
    types = {str(kind): (x[kinds == kind], y[kinds == kind]) for kind in dict.fromkeys(kinds)}
    nearest = None
    if near is not None:
        at = [int(np.flatnonzero((kinds == kind) & (names == name))[0]) for kind, name in near[:2]]
        nearest = (x[at], y[at], near[2])
    return Cloud(title, f"{first} / DN", f"{other} / DN", types, nearest)


def channel_curves(output: Output, cfa: str) -> list[str]:
    """Names of the sensor's curves that a CFA's channels have; a modified channel has none."""
    renamed = output.study.cfas[cfa].curves
    names = (renamed.get(channel, channel) for channel in output.mosaic(cfa).channels)
    return [name for name in dict.fromkeys(names) if name in output.curves.sensor]


def traded_cfas(output: Output) -> list[str]:
    """CFAs with designs that trade sensitivity for separation."""
    return [cfa for cfa in dict.fromkeys(m.cfa for m in modifications(output)) if trades_off(output, cfa)]


def modifications(output: Output) -> list[Modification]:
    """The study's named designs, sweeps and boxes."""
    study = output.study
    return [*study.designs.values(), *study.sweeps.values(), *study.boxes.values()]


def drawn_rows(output: Output) -> pd.DataFrame:
    """Rows that figures show as points: all CFAs, named and found designs, an even share of the swept ones, and those
    whose signals were kept.
    """
    table = output.table[output.table["status"] == "ok"]
    shown = np.union1d(output.swept_points, output.points["design_id"])
    return table[(table["kind"] != SWEPT) | table["design_id"].isin(shown)].reset_index(drop=True)


def drawn(output: Output) -> pd.DataFrame:
    """Rows whose filter's curve was kept: named designs, the search's answer, the best of each sweep."""
    return output.table[output.table["design_id"].isin(output.curves.drawn)]


def _name(origin: Origin) -> str:
    return f"{origin.name}{' (surrogate: modeled, not measured)' if origin.surrogate else ''}"
