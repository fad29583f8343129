"""Tables of a comparison: best designs and plain CFAs; notes on curves that differ."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from ..metrics.objective import COMBINED
from ..metrics.quantity import DN, Column
from ..results.curves import KeptCurves
from ..results.output import Output
from ..results.tables import SEARCHED, SWEPT
from .compare_fronts import dn_scale_label, scene_names
from .leaders import label, of_reference

_SAME = 1e-9
"""Relative; CSDs of one study that were computed on two machines differ by less."""
_MOST_PARAMETERS = 12


def best_of_runs(runs: Mapping[str, Output]) -> pd.DataFrame:
    """Return one row per run: its best feasible design with parameters, CSDs and sensitivities, if it has one."""
    rows, scenes = [], scene_names(runs)
    for name, output in runs.items():
        row: dict[str, Any] = {
            "run": name,
            "study": output.study.study,
            "folder": str(output.folder),
            "maximizes": _maximized(output)[0],
        }
        if not output.best.empty:
            best = output.best.iloc[0].to_dict()
            row |= {"quantity": output.goal.name, "value": best[output.goal.name], "design": label(best)}
            row |= {"scene": scenes[name][str(best["scenario"])]}
            shown = (*output.distances, *output.light, *output.further, *output.parameters)
            row |= {key: best[key] for key in ("design_id", "kind", "cfa", "family", "scenario", *shown)}
        rows.append(row)
    return pd.DataFrame(rows)


def side_by_side(best: pd.DataFrame, runs: Mapping[str, Output]) -> tuple[pd.DataFrame, int]:
    """Return the best designs as one column each, in words; figures of different scenes never share a row.

    Returns `n`: parameters that were left out.
    """
    columns = {name: column for output in runs.values() for name, column in output.columns.items()}
    parameters = dict.fromkeys(name for output in runs.values() for name in output.parameters)
    left_out = [n for n in parameters if n in best and best[n].notna().any()][_MOST_PARAMETERS:]
    skipped = {"run", "study", "folder", "quantity", "scene", *left_out}
    scenes = list(dict.fromkeys(best["scene"].dropna())) if "scene" in best else []
    table = {}
    for name in (str(n) for n in best.dropna(axis="columns", how="all") if n not in skipped):
        words = columns[name].words if name in columns else name
        if len(scenes) > 1 and (name == "value" or (name in columns and name not in parameters)):
            for scene in scenes:
                there = best.where(best["scene"] == scene).to_dict("records")
                table[f"{words} in {scene}"] = [_cell(name, row, columns) for row in there]
        else:
            table[words] = [_cell(name, row, columns) for row in best.to_dict("records")]
    return pd.DataFrame.from_dict(table, orient="index", columns=list(runs)).reset_index(names=""), len(left_out)


def _cell(name: str, row: Mapping[Any, Any], columns: Mapping[str, Column]) -> str:
    value = row[name]
    if isinstance(value, str):
        return " ".join(value.split())
    if value is None or not np.isfinite(value):
        return "-"
    if name == "design_id":
        return f"{value:.0f}"
    column = columns.get(row["quantity"] if name == "value" else name)
    return f"{value:.2f}" if column is None else column.amount(value)


def plain_differences(runs: Mapping[str, Output]) -> tuple[pd.DataFrame, str]:
    """Return CSDs of plain CFAs and named designs that differ between runs, DN, and a sentence on the others."""
    parts, keys = [], ["name", "scene", "CSD"]
    for run, scenes in scene_names(runs).items():
        named = runs[run].named[["name", "scenario", *runs[run].distances]].astype({"name": str, "scenario": str})
        named.insert(1, "scene", named.pop("scenario").map(scenes))
        words = named.rename(columns=runs[run].words)
        parts.append(words.melt(keys[:2], var_name="CSD", value_name=run).set_index(keys))
    table = pd.concat(parts, axis="columns")
    shared = table[table.notna().sum(axis="columns") > 1]
    differing = shared[~np.isclose(shared.min(axis="columns"), shared.max(axis="columns"), rtol=_SAME, atol=0.0)]
    names, of_shared, of_differing = (part.index.unique("name") for part in (table, shared, differing))
    same, single = [n for n in of_shared if n not in of_differing], [n for n in names if n not in of_shared]
    sentences = [f"Equal in every CSD: {', '.join(same)}."] if same else []
    sentences += [f"Not in the same scene of two runs: {', '.join(single)}."] if single else []
    return differing.reset_index(), " ".join(sentences)


def with_units_in_cells(differing: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers of `plain_differences` as a person reads them."""
    return differing.map(lambda value: value if isinstance(value, str) else _dn(value))


def _dn(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.1f} DN"


def ranking(runs: Mapping[str, Output]) -> list[str]:
    """Return the best run and its lead among those with equal objective, DN and scene, and runs without a design."""
    lines, groups = [], dict[tuple[str, str, str], dict[str, float]]()
    scene_of = scene_names(runs)
    for run, output in runs.items():
        if output.best.empty:
            requested = len(output.kind(SWEPT, SEARCHED)) > 0
            lines.append(f"{run} has no {'feasible design' if requested else 'design that was swept or searched'}.")
        else:
            best = output.best.iloc[0]
            group = *_maximized(output), scene_of[run][str(best["scenario"])]
            groups.setdefault(group, {})[run] = float(best[output.goal.name])
    ranked = []
    parts = zip(("objectives", "meanings of DN", "scenes"), zip(*groups, strict=True), strict=False)
    differing = [part for part, values in parts if len(set(values)) > 1]
    for (objective, dn, scene), values in groups.items():
        (first, most), *others = sorted(values.items(), key=lambda item: -item[1])
        column = runs[first].goal
        under = " under the constraints" if any(runs[run].constraints for run in values) else ""
        scale = f" in {dn}" if dn and "meanings of DN" in differing else ""
        place = f" in {scene}" if "scenes" in differing else ""
        text = f"Best {objective}{scale}{place}{under}: {first} with {column.amount(most)}"
        for run, value in others:
            if most - value <= _SAME * abs(most):
                text += f"; {run} is equal"
            else:
                text += f"; {run} has {column.amount(value)}, {column.amount(most - value)}"
                text += f" ({(most - value) / most:.1%}) less" if most > 0 else " less"
        ranked.append(f"{text}.")
    if differing:
        ranked.append(f"Runs with different {' and '.join(differing)} are not ranked against each other.")
    return ranked + lines


def _maximized(output: Output) -> tuple[str, str]:
    """Return the objective in words, and the meaning of its DN, if it has any."""
    text = str(output.objective) if output.goal.name == COMBINED else output.goal.words
    return text, dn_scale_label(output) if any(
        output.columns[name].unit == DN for name in output.objective.weights
    ) else ""


def curve_notes(runs: Mapping[str, Output]) -> list[str]:
    """Return a sentence for each run with other curves than the first, whose CSDs have another scale."""
    (first, reference), *others = runs.items()
    notes = []
    for name, output in others:
        what = _other_curves(reference.curves, output.curves)
        if what:
            notes.append(f"{first} and {name} used other curves ({what}): their results do not compare one to one.")
        if of_reference(output) != of_reference(reference):
            shares = f"{of_reference(reference)} in {first}, {of_reference(output)} in {name}"
            notes.append(f"The CFA sensitivities do not compare: they are shares {shares}.")
    return notes


def _other_curves(first: KeptCurves, second: KeptCurves) -> str:
    if not np.array_equal(first.wavelength_nm, second.wavelength_nm):
        return "on another wavelength grid"
    parts = []
    common = [name for name in first.sensor if name in second.sensor]
    differing = [name for name in common if not np.array_equal(first.sensor[name], second.sensor[name])]
    if differing or not common:
        parts.append(f"sensor: {', '.join(differing)}" if differing else "sensor")
    lights = {**first.lights, **second.lights}
    pairs = [(first.lights.get(name), second.lights.get(name)) for name in lights]
    other = sum(a is None or b is None or not np.array_equal(a, b) for a, b in pairs)
    if other:
        parts.append(f"lights: {other} of {len(lights)}")
    return "; ".join(parts)
