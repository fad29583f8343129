"""The best design of each run, and the plain CFAs that runs share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from ...metrics.objective import COMBINED
from ...metrics.quantity import DN, Column
from ...results.tables import FOUND, SWEPT
from .. import Output
from ..names import label
from .fronts import dn_of

_SAME = 1e-9
"""Relative; CSDs of one study that were computed on two machines differ by less."""


def best_of_runs(runs: Mapping[str, Output]) -> pd.DataFrame:
    """A row per run: its best feasible design with parameters, CSDs and sensitivities; without one, the run alone."""
    rows = []
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
            shown = (*output.distances, *output.light, *output.further, *output.parameters)
            row |= {key: best[key] for key in ("design_id", "kind", "cfa", "family", "scenario", *shown)}
        rows.append(row)
    return pd.DataFrame(rows)


def parameters_of(runs: Mapping[str, Output]) -> list[str]:
    """Parameters of all runs, each once."""
    return list(dict.fromkeys(name for output in runs.values() for name in output.parameters))


def quantities_in(runs: Mapping[str, Output]) -> dict[str, Column]:
    """Quantities of all runs by their names."""
    return {name: column for output in runs.values() for name, column in output.columns.items()}


def side_by_side(
    rows: pd.DataFrame, most_parameters: int, parameters: list[str], columns: Mapping[str, Column]
) -> tuple[pd.DataFrame, int]:
    """The best designs as a column each, in words; and how many of the `parameters` that any has were left out."""
    left_out = [n for n in parameters if n in rows and rows[n].notna().any()][most_parameters:]
    skipped = {"run", "study", "folder", "quantity", *left_out}
    table = {}
    for name in rows.columns:
        if name not in skipped and rows[name].notna().any():
            words = columns[name].words if name in columns else name
            table[words] = [_cell(name, row, columns) for row in rows.to_dict("records")]
    return pd.DataFrame.from_dict(table, orient="index", columns=list(rows["run"])).reset_index(names=""), len(left_out)


def _cell(name: str, row: Mapping[Any, Any], columns: Mapping[str, Column]) -> str:
    value = row[name]
    if isinstance(value, str):
        return " ".join(value.split())
    if value is None or not np.isfinite(value):
        return "-"
    if name == "design_id":
        return f"{value:.0f}"
    own = columns.get(row["quantity"] if name == "value" else name)
    return f"{value:.2f}" if own is None else own.amount(value)


def plain_differences(runs: Mapping[str, Output]) -> tuple[pd.DataFrame, str]:
    """CSDs of plain CFAs and named designs that differ between runs that have them; and the rest in a sentence."""
    values: dict[tuple[str, str, str], dict[str, float]] = {}
    for run, output in runs.items():
        for row in output.named.to_dict("records"):
            for quantity in output.distances:
                values.setdefault((row["name"], row["scenario"], quantity), {})[run] = row[quantity]
    columns = quantities_in(runs)
    shared = {key: own for key, own in values.items() if len(own) > 1}
    differing = {key: own for key, own in shared.items() if not _alike(list(own.values()))}
    rows = [
        [name, scenario, columns[quantity].words, *(f"{own[run]:.1f} DN" if run in own else "-" for run in runs)]
        for (name, scenario, quantity), own in differing.items()
    ]
    same = dict.fromkeys(name for name, _, _ in shared)
    for name, _, _ in differing:
        same.pop(name, None)
    single = dict.fromkeys(name for name, _, _ in values if all(key[0] != name for key in shared))
    words = [f"Equal in every CSD: {', '.join(same)}."] if same else []
    words += [f"In one run only: {', '.join(single)}."] if single else []
    return pd.DataFrame(rows, columns=["name", "scenario", "CSD", *runs]), " ".join(words)


def _alike(values: list[float]) -> bool:
    return bool(np.allclose(values, values[0], rtol=_SAME, atol=0.0, equal_nan=True))


def ranking(runs: Mapping[str, Output]) -> list[str]:
    """Who is best and by how much, among runs that maximize the same in the same DN; and who has nothing to compare."""
    lines, groups = [], dict[tuple[str, str], dict[str, float]]()
    for run, output in runs.items():
        if output.best.empty:
            asked = len(output.kind(SWEPT, FOUND)) > 0
            lines.append(f"{run} has no {'feasible design' if asked else 'design that was swept or searched'}.")
        else:
            groups.setdefault(_maximized(output), {})[run] = float(output.best.iloc[0][output.goal.name])
    found = []
    several = len({dn for _, dn in groups}) > 1
    for (objective, dn), values in groups.items():
        column = next(iter(runs[run].goal for run in values))
        ordered = sorted(values.items(), key=lambda item: -item[1])
        (first, most), *others = ordered
        scenes = {run: " ".join(str(runs[run].best.iloc[0]["scenario"]).split()) for run in values}
        place = {run: f" in {scene}" if len(set(scenes.values())) > 1 else "" for run, scene in scenes.items()}
        under = " under the constraints" if any(runs[run].constraints for run in values) else ""
        text = f"Best {objective}{f' in {dn}' if several and dn else ''}{under}: {first}"
        text += f" with {column.amount(most)}{place[first]}"
        for run, value in others:
            if most - value <= _SAME * abs(most):
                text += f"; {run} is equal{place[run]}"
            else:
                text += f"; {run} has {column.amount(value)}{place[run]}, {column.amount(most - value)}"
                text += f" ({(most - value) / most:.1%}) less" if most > 0 else " less"
        found.append(f"{text}.")
    if len(groups) > 1:
        what = "different objectives" if len({objective for objective, _ in groups}) > 1 else "DN of different meaning"
        found.append(f"These are {what}, which are not ranked against each other.")
    return found + lines


def _maximized(output: Output) -> tuple[str, str]:
    """The objective in words, and what its DN are, where it has any."""
    text = str(output.objective) if output.goal.name == COMBINED else output.goal.words
    return text, dn_of(output) if any(output.columns[name].unit == DN for name in output.objective.weights) else ""
