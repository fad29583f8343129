"""One page over the runs of a study of several sensors and sets of lamps: ratios to the reference of the same sensor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from ...camera.curve_errors import UNCLIPPED
from ...metrics.columns.chromatic import CHROMATIC_CSD
from ...metrics.columns.color_separation import CSD
from ...metrics.columns.pixel_separation import CHROMATIC_PIXEL_CSD, PIXEL_CSD
from ...report.numbers import joined, span
from ...report.page import Report, filled, pictures_of
from ...report.panels import INK, Panel, Points, Section, axis_over
from ...report.run import COUNTED, LIGHT, Run, unit_of, words_of
from ...report.sections import Pairs, conditions, named
from ...report.tables import Axis, Column, Marks, Table
from ...results.dataset import part_paths
from ...results.facts import Origin
from ...results.manifest import Manifest
from ...results.output import read_output
from ...results.tables import REFERENCE, REPORT, RESULTS, SEARCHED, read_table
from ...spectra.lights import pair_name
from ...study import SensorAndLights, folder_name
from . import ALL_SENSORS
from .all_sensors import ALL

PICTURE = "sensors"
_KEYS = ("sensor", "lights")
_MANY, _MOST_NAMED = 12, 6
"""From more sensors on each is a dot; so many are named."""
_STRICT = (PIXEL_CSD, CHROMATIC_CSD, CHROMATIC_PIXEL_CSD)
_BOTH = "both"


@dataclass(frozen=True)
class SensorRun:
    """Finished run of one sensor under one set of lights."""

    member: SensorAndLights
    folder: Path


def runs_in(folder: Path) -> list[SensorRun]:
    """Return the runs of a study of several sensors; none of the folder of another study."""
    runs = [SensorRun(member, folder / folder_name(member.name)) for member in Manifest(folder).runs]
    return [run for run in runs if Manifest(run.folder).finished]


def rows_of_all(runs: Sequence[SensorRun]) -> Iterator[pa.Table]:
    """Yield the rows of all runs, a part at a time, with `sensor` and `lights` before them."""
    schemas = [pq.read_schema(part_paths(run.folder)[0]) for run in runs]
    keys = [pa.field(name, pa.string()) for name in _KEYS]
    joint = pa.unify_schemas([pa.schema([*keys, *(field.remove_metadata() for field in schema)]) for schema in schemas])
    for run in runs:
        for table in Manifest(run.folder).batches():
            whose = [pa.array([value] * len(table)) for value in run.member[:2]]
            rows = pa.table([*whose, *table.columns], names=[*_KEYS, *table.column_names])
            yield pa.concat_tables([joint.empty_table(), rows], promote_options="default")


def report_sensors(manifest: Manifest, runs: Sequence[SensorRun]) -> list[str]:
    """Write a picture and a page of a study of several sensors; returns the answer for the terminal.

    Raises OutputError for files that are damaged, or if the disk refuses.
    """
    folder = manifest.folder
    manifest.require({ALL_SENSORS} & manifest.files.keys())
    report = report_of_sensors(folder, runs)
    manifest.write(pictures_of(report.lead.panels, PICTURE) | {REPORT: report.html().encode("utf-8")})
    notes = [f"Note: {words}." for name, words in report.method if name == "note"]
    return [
        *report.lines,
        *notes,
        f"Files: {RESULTS}, {REPORT}, {PICTURE}.png, and a folder for each run, in the folder",
        str(folder),
    ]


def report_of_sensors(folder: Path, runs: Sequence[SensorRun] = ()) -> Report:
    """Return the report over all sensors."""
    runs = runs or runs_in(folder)
    known = [(one.member, Run(read_output(one.folder))) for one in runs]
    first, figures = known[0][1], pd.DataFrame([row for one in known for row in _ratios(*one)])
    searched = [*figures.loc[figures["searched"], "design"].unique()]
    lead = figures[figures["design"].isin(searched or [*figures["design"].unique()[:1]])]
    designs = [
        {
            "name": name,
            "ratio": _range(of["ratio"]),
            "light": _range(of["light"]),
            "on": _sensors(of),
            "edges": _edges(of),
        }
        for name, of in lead.groupby("design", sort=False)
    ]
    counts = {
        "ahead": f"{(lead['ratio'] > 1).sum()} of {len(lead)}",
        "strictly": f"{(lead[CHROMATIC_PIXEL_CSD] > 1).sum()} of {len(lead)}" if CHROMATIC_PIXEL_CSD in lead else "",
    }
    facts = counts | {
        "kind": "sensors",
        "reference": first.reference,
        "quantity": words_of(first.goal),
        "designs": designs,
    }
    sections = [_every_design(figures, first), *_together(folder, first)]
    if len(lead) > _MANY:
        sections = [_each_sensor(lead, first), *sections]
    study, links = first.study, [f"{one.folder.name}/{REPORT}" for one in runs]
    return Report(
        folder.name, study.title or study.question or folder.name, filled(facts), _lead(lead, first), sections, _holds(known),
        _method(known), [RESULTS, *links],
    )  # fmt: skip


def _ratios(member: SensorAndLights, run: Run) -> Iterator[dict[str, Any]]:
    """Yield the figures of each design, times those of the reference of the same sensor."""
    of, known = run.here[run.reference], run.output.tables.get("uncertainty.parquet")
    known = (
        None
        if known is None or UNCLIPPED in run.facts.warnings
        else known[known["quantity"] == run.goal.name].set_index("design_id")
    )
    strict = (
        {metric: pair_name(metric, run.goal.pair) for metric in _STRICT}
        if run.goal.pair and run.goal.metric == CSD
        else {}
    )
    for name, row in run.here.items():
        if name == run.reference or (row["kind"] == REFERENCE and not row[run.goal.name] > 0):
            continue
        searched = row["kind"] == SEARCHED
        ends = {f"ratio_{end}": float("nan") for end in (5, 95)}
        if known is not None and row["design_id"] in known.index:
            ends = {key: float(known.loc[row["design_id"], key]) for key in ends}
        more = {metric: row[column] / of[column] for metric, column in strict.items() if of.get(column, 0) > 0}
        yield {
            "sensor": member.sensor, "lights": member.lights, "design": f"{name} of {row['cfa']}" if searched else name,
            "searched": searched, "edges": run.edges(name), "value": row[run.goal.name], "ratio": row[run.goal.name] / of[run.goal.name],
            "light": row[LIGHT] / of[LIGHT], "reference": of[run.goal.name], **ends, **more,
        }  # fmt: skip


def _lead(figures: pd.DataFrame, first: Run) -> Section:
    """Return the table of each sensor, or of many their distribution, and a dot for each."""
    goal = first.goal
    across = axis_over(f"light, times {first.reference}", "", figures["light"], zero=False, log=False)
    up = axis_over(f"separation, times {first.reference}", "", figures["ratio"], log=False, level=1.0)
    groups = {
        str(design): (of["light"].to_numpy(dtype=float), of["ratio"].to_numpy(dtype=float))
        for design, of in figures.groupby("design", sort=False)
    }
    panels: tuple[Panel, ...] = (Points("Separation over light, a dot for each sensor", across, up, groups=groups),)
    if len(figures) <= _MANY:
        return replace(_each_sensor(figures, first), panels=panels)
    plain = figures.drop_duplicates(list(_KEYS))
    levels = plain["reference"].quantile([0.0, 0.05, 0.5, 0.95, 1.0]).tolist()
    rows = {
        f"{words_of(goal)} of {first.reference}": dict(
            zip(("least", "low", "middle", "high", "most"), levels, strict=True)
        )
    }
    for design, of in figures.groupby("design", sort=False):
        ends = of["ratio"].quantile([0.0, 0.05, 0.5, 0.95, 1.0]).tolist()
        rows[f"{design}, times that"] = dict(zip(("least", "low", "middle", "high", "most"), ends, strict=True))
    words = {"least": "least", "low": "5 %", "middle": "median", "high": "95 %", "most": "most"}
    columns = {key: (Column(label), {name: row[key] for name, row in rows.items()}) for key, label in words.items()}
    note = f"{len(plain)} sensors with lamps; {words_of(goal)} in {goal.unit}."
    return Section("Over all sensors", Table.of(columns, head="figure"), panels, note)


def _each_sensor(figures: pd.DataFrame, first: Run) -> Section:
    """Return a row for each sensor: its ratio with the range of random sensors, and the same counted strictly."""
    several, ends = figures["design"].nunique() > 1, figures[["ratio", "ratio_5", "ratio_95"]].to_numpy(dtype=float)
    axis = Axis("", "", min(0.9, float(np.nanmin(ends))), max(1.1, float(np.nanmax(ends))), True, 1.0)
    group, rows = f"times {first.reference} of the same sensor", {}
    for row in figures.to_dict("records"):
        name = f"{row['sensor']}, {row['lights']}{': ' + row['design'] if several else ''}"
        drawn = [(row["ratio_5"], row["ratio_95"])] if np.isfinite(row["ratio_5"]) else []
        rows[name] = row | {"track": Marks(drawn, [(row["ratio"], INK)], "")}
    columns = {
        "track": Column("5 to 95 % of random sensors" if np.isfinite(ends[:, 1]).any() else "", axis=axis, group=group),
        "ratio": Column("separation", "", "more", base=1.0, group=group), "light": Column("light", "", "more", base=1.0, group=group),
        **{metric: Column(COUNTED[metric], "", "more", base=1.0, group="separation, counted strictly") for metric in _STRICT},
        "value": Column(words_of(first.goal), unit_of(first.goal)),
    }  # fmt: skip
    table = Table.of(
        {key: (column, {name: row.get(key) for name, row in rows.items()}) for key, column in columns.items()},
        head="sensor, lamps",
    )
    return Section("On each sensor", table)


def _every_design(figures: pd.DataFrame, first: Run) -> Section:
    """Return a row for each design: its ranges over all sensors, and on how many it has more of both."""
    axes = {key: axis_over("", "", figures[key], log=True, level=1.0) for key in ("ratio", "light")}
    columns: dict[str, tuple[Column, dict[str, Any]]] = {
        "ratio": (Column("separation", axis=axes["ratio"], group=f"times {first.reference} of the same sensor"), {}),
        "light": (Column("light", axis=axes["light"], group=f"times {first.reference} of the same sensor"), {}),
        _BOTH: (Column("more of both"), {}),
    }
    for design, of in figures.groupby("design", sort=False):
        for key in ("ratio", "light"):
            columns[key][1][str(design)] = Marks([(of[key].min(), of[key].max())], (), _range(of[key]))
        columns[_BOTH][1][str(design)] = f"{int(((of['ratio'] > 1) & (of['light'] > 1)).sum())} of {len(of)}"
    return Section("Every design, over all sensors", Table.of(columns))


def _together(folder: Path, first: Run) -> Iterator[Section]:
    """Yield how much of the best of each sensor one filter for all keeps, and one that was designed without a sensor."""
    if ALL_SENSORS not in Manifest(folder).files:
        return
    table, rows = read_table(folder / ALL_SENSORS).to_pandas(), {}
    table["share"] = table["objective"] / table["own_best"]
    for space, of in table.groupby("space", sort=False):
        for what, part in (
            ("one for all sensors", of[of["designed_on"] == ALL]),
            ("one for all but one, on that one", of[of["judged"]]),
        ):
            if len(part):
                rows[f"{space}: {what}"] = {
                    "share": _range(100 * part["share"]),
                    "broken": float(part["violation"].max()),
                }
    columns = {
        "share": Column("of the best of each sensor / %"),
        "broken": Column("constraints broken by, of their bounds", "", "less"),
    }
    found = Table.of(
        {key: (column, {name: row[key] for name, row in rows.items()}) for key, column in columns.items()},
        head="filter",
    )
    yield Section("Filters for several sensors", found, note=f"{ALL_SENSORS} has all; {words_of(first.goal)}.")


def _holds(known: Sequence[tuple[SensorAndLights, Run]]) -> Pairs:
    """Return the conditions of all runs, with all sensors and lamps."""
    pairs = dict(conditions(known[0][1]))
    pairs["sensor"] = _origins([run.facts.sensor for _, run in known])
    pairs.pop("checked", None)
    pairs["lamps"] = _origins([run.facts.lights for _, run in known])
    return [*pairs.items()]


def _origins(origins: Sequence[Origin]) -> str:
    """Return names of curves, or of many how many, with those that are modeled."""
    known = {origin.name: origin.surrogate for origin in origins}
    modeled = [name for name, surrogate in known.items() if surrogate]
    if len(known) <= _MOST_NAMED:
        return joined(list(dict.fromkeys(map(named, origins))))
    if len(modeled) == len(known):
        return f"{len(known)} (modeled, not measured)"
    which = joined(modeled) if len(modeled) <= _MOST_NAMED else f"{len(modeled)} of them"
    sources = {named(origin).partition(" (")[2].rstrip(")") for origin in origins}
    whose = f" ({sources.pop()})" if len(sources) == 1 else ""
    return f"{len(known)}{whose}{f'; {which} modeled, not measured' if modeled else ''}"


def _method(known: Sequence[tuple[SensorAndLights, Run]]) -> Pairs:
    """Return what the figures are, and what single sensors lack."""
    goal = known[0][1].goal
    warned = [
        warning for member, run in known for warning in run.facts.warnings if warning.startswith(f"{member.sensor}: ")
    ]
    return [("goal", f"{goal.name}: {goal.meaning}"), *(("note", warning) for warning in dict.fromkeys(warned))]


def _sensors(rows: pd.DataFrame) -> str:
    names = [*rows["sensor"].unique()]
    return joined(names) if len(names) <= _MOST_NAMED else f"{len(names)} sensors"


def _edges(rows: pd.DataFrame) -> str:
    """Return the ranges of the edges of one stopband over all sensors."""
    pairs = [edges for edges in rows["edges"] if len(edges) == len(rows["edges"].iloc[0])]
    if len(pairs) < len(rows) or not pairs[0]:
        return ""
    return " and ".join(span([round(edge) for edge in ends]) for ends in zip(*pairs, strict=True)) + " nm"


def _range(values: pd.Series[float]) -> str:
    """Return the range of ratios, with two digits after the point."""
    known = values.dropna()
    if known.empty:
        return "unknown"
    low, high = f"{known.min():.2f}", f"{known.max():.2f}"
    return low if low == high else f"{low} to {high}"
