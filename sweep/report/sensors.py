"""Comparison of a study's sensors and light sets: one table, one picture, one sentence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from ..metrics.columns.chromatic import CHROMATIC_CSD
from ..metrics.columns.color_separation import CSD
from ..metrics.columns.pixel_separation import CHROMATIC_PIXEL_CSD, PIXEL_CSD
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.quantity import Column
from ..results.dataset import part_paths
from ..results.manifest import Manifest
from ..results.output import Output, read_output
from ..results.tables import ALL_SENSORS, REFERENCE, REPORT, RESULTS, RGGB, SEARCHED, read_table
from ..runs.all_sensors import ALL
from ..runs.uncertainty import UNCLIPPED
from ..spectra.lights import pair_name
from ..study import SensorAndLights, folder_name
from .hold import holds_for
from .page import page_of, plain
from .panels import Picture
from .point_panels import Dots
from .row_panels import Ratio, Ratios
from .section import Told, table_of
from .sections.price import COUNTED
from .words import SAME, digits, joined, quantity

PICTURE = "sensors"
_KEYS = ("sensor", "lights")
_MANY = 12
"""From more sensors with lights on, each is a dot of one picture."""
_MOST_NAMED = 6
_MORE = {
    "by_pixel": "by pixel",
    "chromatic": "at any brightness",
    "chromatic_by_pixel": "both",
}
"""Other ways to count a separation, in words."""


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
    """Write a picture and a page of a study of several sensors.

    The filters for several sensors are read from `all_sensors.parquet`, see `all_sensors_table`, if the folder has it.

    Raises OutputError for files that are damaged, or if the disk refuses.
    """
    folder = manifest.folder
    manifest.require({ALL_SENSORS} & manifest.files.keys())
    outputs = [(run.member, read_output(run.folder)) for run in runs]
    figures = pd.DataFrame([row for member, output in outputs for row in _figures(member, output)])
    column = outputs[0][1].trade_off[0]
    words, summary = quantity(column), _summary(figures, column.unit)
    n_found = figures.loc[figures["kind"] == SEARCHED, "cfa"].nunique()
    lines = [*_answer(summary, n_found, str(figures["reference"].iloc[0]), words)]
    answer, stated = lines[: max(n_found, 1)], holds_for(outputs[0][1], _curves(outputs))
    known = ALL_SENSORS in manifest.files
    together = read_table(folder / ALL_SENSORS).to_pandas() if known else pd.DataFrame()
    further = lines[len(answer) :]
    if len(together):
        further += _together(together, outputs[0][1].goal)
    notes = [*_notes(outputs)]
    if figures["sensor"].nunique() > _MANY:
        further.insert(0, _distribution(figures, words, column.unit))
    picture = picture_of(figures, words)
    sections = [Told("On each sensor", (), None, table_of(_shown(figures), f"{RESULTS} has all rows."))]
    if len(together):
        sections.append(
            Told("Filters for several sensors", (), None, table_of(together.round(3), f"{ALL_SENSORS} has all."))
        )
    links = [f"{run.folder.name}/{REPORT}" for run in runs]
    study = outputs[0][1].study
    lead = Told(
        "By design", (), picture, table_of(summary.drop(columns=["more", "on", "dn", *_MORE.values()], errors="ignore"))
    )
    text = page_of(
        folder.name, study.title or study.question or folder.name, answer, stated, lead, sections,
        kind="report of a sweep over sensors", limits=[*further, *notes], files=[RESULTS, *links],
    )  # fmt: skip
    lines = [plain(line) for line in (*answer, *further, *notes)]
    images = picture.files(PICTURE)
    manifest.write(images | {REPORT: text.encode("utf-8")})
    files = f"Files: {RESULTS}, {REPORT}, {PICTURE}.png, and a folder for each run, in the folder"
    return [*lines, files, str(folder)]


def _curves(outputs: Sequence[tuple[SensorAndLights, Output]]) -> str:
    """Return all sensors and lights, and which are modeled."""
    sensors = {output.provenance.sensor.name: output.provenance.sensor.surrogate for _, output in outputs}
    if len(sensors) > _MOST_NAMED:
        modeled = [name for name, surrogate in sensors.items() if surrogate]
        told = f"; {joined(modeled)} **modeled, not measured**" if modeled else ""
        sensors = {f"{len(sensors)} sensors{told}": False}
    lights = {output.provenance.lights.name: output.provenance.lights.surrogate for _, output in outputs}
    parts = [
        joined([f"{name}{' (**modeled, not measured**)' * modeled}" for name, modeled in known.items()])
        for known in (sensors, lights)
    ]
    return f"curves of {parts[0]}; lamps of {parts[1]}"


def _figures(member: SensorAndLights, output: Output) -> Iterator[dict[str, Any]]:
    """Yield a row per plain CFA, named design and answer, in the first scenario."""
    separation = output.trade_off[0].name
    scenario_rows = output.named_rows[
        (output.named_rows["scenario"] == output.scenario) & (output.named_rows["status"] == "ok")
    ]
    plain = scenario_rows[scenario_rows["kind"] == REFERENCE]
    known = plain[plain["name"] == RGGB]
    reference = (known if len(known) else plain if len(plain) else scenario_rows).iloc[0]
    drawn, others = _uncertain(output, separation), _counted_otherwise(output)
    for row in scenario_rows.to_dict("records"):
        yield {
            "sensor": member.sensor,
            "lights": member.lights,
            "name": str(row["name"]),
            "design": f"{row['name']} of {row['cfa']}" if row["kind"] == SEARCHED else str(row["name"]),
            "cfa": str(row["cfa"]),
            "kind": str(row["kind"]),
            "reference": str(reference["name"]),
            "dn": float(row[separation]),
            "light": float(row[CFA_SENSITIVITY]),
            "ratio": _ratio(row, reference, separation),
            "light_ratio": _ratio(row, reference, CFA_SENSITIVITY),
            **{key: float(row[name]) for key, name in others.items()},
            **{f"{key}_ratio": _ratio(row, reference, name) for key, name in others.items()},
            **drawn.get(row["design_id"], {}),
        }


def _ratio(row: Mapping[Any, Any], reference: Mapping[Any, Any] | pd.Series[Any], name: str) -> float:
    """Return a quantity times that of the plain CFA; NaN where that has none."""
    of = float(reference[name])
    return float(row[name]) / of if of > 0 else float("nan")


def _counted_otherwise(output: Output) -> dict[str, str]:
    """Return the columns of the same two types that count separations in other ways, by the keys of `_MORE`."""
    column = output.trade_off[0]
    if column.metric != CSD or column.extreme or column.pair is None:
        return {}
    metrics = dict(zip(_MORE, (PIXEL_CSD, CHROMATIC_CSD, CHROMATIC_PIXEL_CSD), strict=True))
    names = {key: pair_name(metric, column.pair) for key, metric in metrics.items()}
    return {key: name for key, name in names.items() if name in output.named_rows}


def _uncertain(output: Output, separation: str) -> Mapping[Any, Mapping[str, float]]:
    """Return quantiles of both ratios and their deviations by row, where the study has uncertain curves."""
    if output.uncertainty is None or UNCLIPPED in output.provenance.warnings:
        return {}  # of other separations than those of the rows
    known = output.uncertainty[output.uncertainty["quantity"] == separation].set_index("design_id")
    names = ["ratio_5", "ratio_95", "light_ratio_5", "light_ratio_95", "ratio_sd", "light_ratio_sd", "correlation"]
    return {key: {str(n): float(v) for n, v in row.items()} for key, row in known[names].iterrows()}


def _summary(figures: pd.DataFrame, unit: str) -> pd.DataFrame:
    """Return a row per design, the searched ones first: ranges of both ratios, and where both are above 1."""
    figures, rows_of = figures.assign(last=figures["kind"] != SEARCHED).sort_values("last", kind="stable"), []
    for design, of_design in figures[figures["name"] != figures["reference"]].groupby("design", sort=False):
        more = (of_design["ratio"] > 1) & (of_design["light_ratio"] > 1)
        row = {
            "design": design,
            "on": _sensors(of_design),
            "with lights": len(of_design),
            "more": _verdict(of_design),
            "separation": _span(of_design["ratio"]),
            "dn": f"{' to '.join(dict.fromkeys(digits(end(of_design['dn'])) for end in (min, max)))} {unit}".rstrip(),
            "light": _span(of_design["light_ratio"]),
            "more of both": f"{int(more.sum())} of {len(of_design)}",
            **{words: _span(of_design[f"{key}_ratio"]) for key, words in _MORE.items() if f"{key}_ratio" in of_design},
        }
        if "ratio_5" in of_design:
            sure = int(((of_design["ratio_5"] > 1) & (of_design["light_ratio_5"] > 1)).sum())
            row["by 5 % quantiles"] = f"{sure} of {len(of_design)}"
        rows_of.append(row)
    return pd.DataFrame(rows_of)


def _answer(summary: pd.DataFrame, n_found: int, reference: str, words: str) -> Iterator[str]:
    """Yield on how many sensors the searched designs separate more at more light, and a line on all others."""
    rows_of = summary.to_dict("records")
    for row in rows_of[:n_found]:
        otherwise = "; ".join(f"{what} {row[what]}" for what in _MORE.values() if what in row)
        yield (
            f"**{row['more']}** on {row['on']}: the {row['design']} has **{row['separation']} times** the {words} of "
            f"{reference} ({row['dn']}) at {row['light']} times its light{f' ({otherwise})' if otherwise else ''}."
        )
    for row in rows_of[:n_found]:
        sure = row.get("by 5 % quantiles", "")
        of_random = f", by the 5 % quantiles of random sensors on {sure}" if sure else ""
        yield f"More of both: the {row['design']} on {row['more of both']} pairs of sensor and lamps{of_random}."
    others = [f"{r['design']} {r['separation']} at {r['light']} ({r['more of both']})" for r in rows_of[n_found:]]
    if others:
        what = "Others" if n_found else f"Times the {words} of {reference}, at times its light (more of both)"
        yield f"{what}: {', '.join(others)}."


def _together(table: pd.DataFrame, goal: Column) -> Iterator[str]:
    """Yield how much of the best of each sensor a filter for all keeps, and one that was designed without a sensor."""
    for space in dict.fromkeys(table["space"]):
        parts, of_space = [], table[table["space"] == space]
        of_all, judged = of_space[of_space["designed_on"] == ALL], of_space[of_space["judged"]]
        groups = {f"one {space} filter for {ALL}": (of_all, "")}
        if judged["sensor"].nunique() > _MOST_NAMED:
            groups["one for all but one"] = judged, " on that one"
        else:
            groups |= {
                f"one for {name}": (own, " on that one") for name, own in judged.groupby("designed_on", sort=False)
            }
        for what, (shown, where) in groups.items():
            shares, broken = shown["objective"] / shown["own_best"], float(shown["violation"].max())
            text = f"{what} keeps {shares.min():.0%} to {shares.max():.0%}{where}"
            parts.append(text + (f" and breaks a constraint by {broken:.2g} of its bound" if broken else ""))
        yield f"Of the best {goal.words} of each sensor and lights: {'; '.join(parts)}."


def _distribution(figures: pd.DataFrame, words: str, unit: str) -> str:
    """Return how the plain CFA is spread over many sensors."""
    plain = figures[figures["name"] == figures["reference"]].drop_duplicates(["sensor", "lights"])
    parts = []
    for key, what in (("dn", words), ("chromatic", "the same for lamps of any brightness")):
        if key in plain:
            ends = [digits(float(plain[key].quantile(share))) for share in (0, 0.05, 0.5, 0.95, 1)]
            most = f"{ends[4]} {unit}".strip()
            parts.append(f"{what} {ends[0]} to {most} (5 to 95 %: {ends[1]} to {ends[3]}, median {ends[2]})")
    return f"{plain['name'].iloc[0]} over {len(plain)} sensors with lamps: {'; '.join(parts)}."


def _verdict(of_design: pd.DataFrame) -> str:
    """Return whether a design separates more than the plain CFA on all sensors, some or none."""
    ratios = of_design["ratio"]
    above, below = int((ratios > 1 + SAME).sum()), int((ratios < 1 - SAME).sum())
    if len(ratios) in (above, below):
        return "More" if above else "Less"
    return "More on some" if above else "As much or less" if below else "As much"


def _sensors(rows: pd.DataFrame) -> str:
    """Return the names of a few sensors, or how many there are."""
    names = [*rows["sensor"].unique()]
    return joined(names) if len(names) <= _MOST_NAMED else f"{len(names)} sensors"


def _span(values: pd.Series[float]) -> str:
    """Return the range of ratios; of many with the median."""
    if values.isna().all():
        return "unknown"
    low, high = f"{values.min():.2f}", f"{values.max():.2f}"
    middle = f" (median {values.median():.2f})" if len(values) > _MANY else ""
    return low if low == high else f"{low} to {high}{middle}"


def _notes(outputs: Sequence[tuple[SensorAndLights, Output]]) -> Iterator[str]:
    """Yield what was left out, and which curves are modeled."""
    warnings = [(member, warning) for member, output in outputs for warning in output.provenance.warnings]
    yield from dict.fromkeys(
        f"Note: {warning}." for member, warning in warnings if warning.startswith(f"{member.sensor}: ")
    )
    origins = [origin for _, output in outputs for origin in (output.provenance.sensor, output.provenance.lights)]
    modeled = dict.fromkeys(origin.name for origin in origins if origin.surrogate)
    if modeled:
        names = " and ".join(modeled) if len(modeled) <= _MOST_NAMED else f"{len(modeled)} sensors and lamps"
        yield f"Note: the curves of {names} are surrogates, modeled from stated parameters, not measured."


def _shown(figures: pd.DataFrame) -> pd.DataFrame:
    """Return the table as it is shown."""
    shown = pd.DataFrame(
        {
            "sensor": figures["sensor"],
            "lights": figures["lights"],
            "design": figures["name"],
            "CFA": figures["cfa"],
            "separation": figures["dn"].map("{:.1f}".format),
            "light": figures["light"].map("{:.3f}".format),
            "times the reference's separation": figures["ratio"].map("{:.2f}".format),
            "times its light": figures["light_ratio"].map("{:.2f}".format),
        }
    )
    if "ratio_5" in figures:
        for of, label in (("ratio", "separation"), ("light_ratio", "light")):
            ends = zip(figures[f"{of}_5"], figures[f"{of}_95"], strict=True)
            shown[f"{label}, 5 to 95 % of random sensors"] = [f"{low:.2f} to {high:.2f}" for low, high in ends]
    return shown


def picture_of(figures: pd.DataFrame, words: str) -> Picture:
    """Return ratios of separation and of light of each design on each sensor, with bars from 5 to 95 %."""
    if figures["sensor"].nunique() > _MANY and "chromatic" in figures:
        return _of_many(figures, words)
    figures = figures[figures["name"] != figures["reference"]]
    reference = figures["reference"].iloc[0] if len(figures) else RGGB
    panels, one_set = [], figures["lights"].nunique() == 1
    for of, title in (("ratio", words), ("light_ratio", "light of the whole CFA")):
        ratios = []
        for row in figures.to_dict("records"):
            low, high = (float(row.get(f"{of}_{end}", np.nan)) for end in (5, 95))
            ends = (low, high) if np.isfinite([low, high]).all() else (None, None)
            where = row["sensor"] if one_set else f"{row['sensor']}, {row['lights']}"
            ratios.append(Ratio(where, str(row["design"]), float(row[of]), *ends))
        panels.append(Ratios(f"{title} / that of {reference}", "times", tuple(ratios)))
    caption = f"Right of the line: more than {reference}."
    caption += " Bars: 5 to 95 % of random sensors." if "ratio_5" in figures else ""
    caption += f" {COUNTED}" if "by_pixel" in figures else ""
    return Picture(tuple(panels), f"{words} and light on each sensor, against {reference}.", caption)


def _of_many(figures: pd.DataFrame, words: str) -> Picture:
    """Return the separation against that of lamps of any brightness, a dot for each sensor and design."""
    groups = {
        str(design): (rows["chromatic"].to_numpy(dtype=float), rows["dn"].to_numpy(dtype=float))
        for design, rows in figures.groupby("design", sort=False)
    }
    named = figures[~figures["sensor"].str.contains("/")]
    marks = [(f"{row['sensor']}", float(row["chromatic"]), float(row["dn"])) for row in named.to_dict("records")]
    panel = Dots(f"{words} / DN", f"{words} for lamps of any brightness / DN", groups, tuple(marks))
    caption = "A dot for each sensor and set of lamps; those that are no camera of a collection have names."
    return Picture((panel,), f"{words} on each sensor.", caption)
