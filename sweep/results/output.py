"""A finished output folder, read back."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from ..camera.scene import Geometry
from ..errors import Fault, OutputError
from ..metrics.bound import Bound
from ..metrics.objective import Objective
from ..metrics.separation import CSD
from ..study import Study, load_study
from ..types import FloatArray
from .inventory import Inventory, no_run
from .profiles import Profile, Profiles
from .tables import (
    AUDIT,
    CURVES,
    FRONT,
    POINTS,
    PROVENANCE,
    PROVENANCE_KEYS,
    RECOGNITION,
    RESOLVED,
    RESULTS,
    SEARCH_LOG,
    read_table,
)
from .thinning import Counts, thinned

_SAME = 1e-12
"""Curves that were computed twice, on other machines, differ by no more."""
_MOST_SHOWN = 10
_RESULT_COLUMNS = (
    *("design_id", "kind", "name", "cfa", "family", "scenario", "sensitivity", "cfa_sensitivity", "violation"),
    *("feasible", "pareto", "plan", "promised_dn", "status"),
)
_STUDY_KEYS = ("study", "seed", "wavelengths", "scenarios", "objective")


@dataclass(frozen=True)
class Output:
    """What a run left in its folder; of a long result table, `table` holds what a report shows.

    `profiles`: over the whole table, per CFA. `searched`: the search's evaluations. `audited`: rows of `sweep audit`.
    """

    folder: Path
    study: Mapping[str, Any]
    provenance: Mapping[str, Any]
    table: pd.DataFrame
    counts: Counts
    curves: pd.DataFrame
    points: pd.DataFrame
    front: pd.DataFrame | None
    recognition: pd.DataFrame | None
    searched: pd.DataFrame | None
    audited: pd.DataFrame | None
    profiles: Mapping[str, Sequence[Profile]]

    @property
    def objective(self) -> str:
        """Column of what the study maximizes."""
        return Objective.model_validate(self.study["objective"]).column

    @property
    def trade_off(self) -> tuple[str, str]:
        """Axes of the Pareto front: separation, sensitivity.

        `pareto` marks it among the designs that meet every constraint but those on these two.
        """
        separation, sensitivity = self.provenance["trade_off"]
        return separation, sensitivity

    @property
    def distances(self) -> list[str]:
        """Columns of all CSDs."""
        return [name for name in self.table.columns if name.startswith(CSD)]

    @property
    def further(self) -> list[str]:
        """Columns that the study's objective and constraints name beside the CSDs and the sensitivities."""
        named = (*self.constraints, *Objective.model_validate(self.study["objective"]).weights, self.objective)
        return [n for n in dict.fromkeys(named) if n not in self.distances and not n.startswith(("sens", "cfa_sens"))]

    @property
    def parameters(self) -> list[str]:
        """Columns of the families' parameters."""
        columns = list(self.table.columns)
        return columns[columns.index("scenario") + 1 : columns.index(self.distances[0])]

    @property
    def constraints(self) -> dict[str, Bound]:
        """The study's constraints."""
        return {name: Bound(**bound) for name, bound in self.study.get("constraints", {}).items()}

    @property
    def geometry(self) -> dict[str, Geometry]:
        """The study's distance scenarios."""
        return {name: Geometry(**entry) for name, entry in self.study.get("geometry", {}).items()}

    @cached_property
    def best(self) -> pd.DataFrame:
        """Feasible swept and searched designs, best first."""
        candidates = self.table[self.table["feasible"] & self.table["kind"].isin(["sweep", "search"])]
        return candidates.sort_values([self.objective, *self.trade_off, "design_id"], ascending=[False] * 3 + [True])

    def kind(self, *kinds: str) -> pd.DataFrame:
        """Rows of some kinds."""
        return self.table[self.table["kind"].isin(kinds)]


def read_output(folder: Path, *, audited: bool = True) -> Output:
    """Read a finished run; raises OutputError, naming each, where files are missing or not as the run wrote them.

    `audited`: with the rows of `sweep audit`, where there are some.
    """
    inventory = Inventory(folder)
    if not inventory.fingerprint:
        raise no_run(folder)
    if PROVENANCE not in inventory.files:
        raise OutputError(Fault("no finished run here", str(folder), allowed="a folder that `sweep run` finished"))
    optional = [name for name in (FRONT, RECOGNITION, SEARCH_LOG, AUDIT) if name in inventory.files]
    if not audited and AUDIT in optional:
        optional.remove(AUDIT)
    inventory.require([RESULTS, CURVES, POINTS, RESOLVED, PROVENANCE, *optional])
    study = _mapping(folder / RESOLVED, lambda text: YAML(typ="safe").load(text), _STUDY_KEYS)
    provenance = _mapping(folder / PROVENANCE, json.loads, PROVENANCE_KEYS)
    objective = Objective.model_validate(study["objective"]).column
    if len(provenance["trade_off"]) != 2 or any("name" not in provenance[what] for what in ("sensor", "lights")):
        raise _lacking(folder / PROVENANCE, ["trade_off, or the names of sensor and lights"])
    _check_columns(folder / RESULTS, [*_RESULT_COLUMNS, objective, *provenance["trade_off"]])
    for name, columns in ((CURVES, ["wavelength_nm"]), (POINTS, ["design_id", "signal_type", "channel", "dn"])):
        _check_columns(folder / name, columns)
    if FRONT in optional:
        _check_columns(folder / FRONT, ["sensitivity_min", "objective", "sensitivity", "limit"])
    profiles = Profiles(objective, next(iter(study["scenarios"])))
    table, counts = thinned(folder / RESULTS, [objective, *provenance["trade_off"]], profiles.add)
    curves, points = (read_table(folder / name).to_pandas() for name in (CURVES, POINTS))
    front, recognition, searched, audit = (
        read_table(folder / name).to_pandas() if name in optional else None
        for name in (FRONT, RECOGNITION, SEARCH_LOG, AUDIT)
    )
    return Output(
        folder, study, provenance, table, counts, curves, points, front, recognition, searched, audit, profiles.found
    )


def study_of(output: Output, data: Path | None) -> Study:
    """The study of a finished run again: with its files, looked for in `data`, or with the curves that the run kept.

    Raises OutputError when the curves are not those that the run kept.
    """
    path = output.folder / RESOLVED
    if data is None and output.provenance.get("data_sha256"):
        return load_study(path, kept={str(name): values.to_numpy() for name, values in output.curves.items()})
    study = load_study(path, data)
    lights = zip(study.lights.types, study.lights.names, study.lights.photons, strict=True)
    made = {f"qe:{name}": values for name, values in study.sensor.qe.items()}
    made |= {f"light:{kind}:{name}": values for kind, name, values in lights}
    check_kept(output, made)
    return study


def check_kept(output: Output, made: Mapping[str, FloatArray]) -> None:
    """Compare curves with those that the run kept under these names; raises OutputError where they differ."""
    kept = output.curves
    other = [name for name, values in made.items() if name in kept and not _same(kept[name].to_numpy(), values)]
    if other:
        shown = ", ".join(other[:_MOST_SHOWN]) + (" and more" if len(other) > _MOST_SHOWN else "")
        problem = f"computed again, these are not what the run has: {shown}"
        raise OutputError(Fault(problem, str(output.folder), allowed="the curve files and the version of that run"))


def _same(one: FloatArray, other: FloatArray) -> bool:
    return one.shape == other.shape and bool(np.abs(one - other).max(initial=0.0) <= _SAME)


def _mapping(path: Path, parse: Any, keys: Sequence[str]) -> dict[str, Any]:
    try:
        found = parse(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError, YAMLError) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None
    if not isinstance(found, dict):
        raise OutputError(Fault("not a mapping", str(path)))
    lacking = [key for key in keys if key not in found]
    if lacking:
        raise _lacking(path, lacking)
    return found


def _lacking(path: Path, what: Sequence[str]) -> OutputError:
    again = "delete it, and `sweep run` of the study makes it again"
    return OutputError(Fault(f"lacks {', '.join(what)}; {again}", str(path)))


def _check_columns(path: Path, wanted: Sequence[str]) -> None:
    try:
        names = pq.read_schema(path).names
    except (OSError, pa.ArrowException) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None
    lacking = [name for name in dict.fromkeys(wanted) if name not in names]
    if lacking:
        raise _lacking(path, lacking)
