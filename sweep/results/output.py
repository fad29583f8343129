"""Finished output folder, read back."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import pyarrow as pa
import pyarrow.parquet as pq
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from ..base.errors import OutputError, ValidationIssue
from ..camera.mosaic import Mosaic
from ..features import gathered
from ..metrics.bound import Bound
from ..metrics.columns.exposure import EXPOSURE
from ..metrics.objective import Objective
from ..metrics.quantity import Column
from ..study import StudySection, folder_name
from ..study.inputs import INPUTS
from . import tables as files
from .curves import SCHEMA as CURVES_SCHEMA
from .curves import KeptCurves
from .facts import Provenance, checked_facts, missing_parts_error
from .identity import MODEL_VERSION
from .lock import in_use
from .manifest import Manifest
from .shown import MS, Counts, per_exposure, shown_rows
from .tables import NAMED, NAMED_KINDS, PROVENANCE, REFERENCE, RESOLVED, SEARCHED, SWEPT, made_by_run, read_table

if TYPE_CHECKING:
    import pandas as pd

_Made = TypeVar("_Made")
_ALWAYS = (
    files.DESIGNS,
    files.PARETO,
    files.CURVES,
    files.POINTS,
    files.LIMITED_BY,
    files.SATURATED,
    RESOLVED,
    PROVENANCE,
)
"""Files of every run; others are of some runs alone."""
_ALWAYS_WRITTEN = ("study", "seed", "wavelengths", "scenarios", "objective")
"""Keys of every resolved study: it has its defaults, too, so that one that lacks them was cut."""
_COLUMNS: dict[str, Sequence[str]] = {
    files.CURVES: CURVES_SCHEMA.names,
    files.LIMITED_BY: ["design_id"],
    files.SATURATED: ["design_id", "full_signals", "signals"],
    files.POINTS: ["design_id", "signal_type", "signal", "channel", "dn"],
    files.FRONT: files.front_schema(()).names,
}
"""Columns that a report needs of the tables beside the result table."""


@dataclass(frozen=True)
class Output:
    """Results of a run; `table` has the rows that a report shows.

    `study`: the study that was run, and `resolved` its file; `tables`: those beside the rows by their files' names, as
    far as the run has them.
    """

    folder: Path
    study: StudySection
    resolved: Mapping[str, Any]
    provenance: Provenance
    table: pd.DataFrame
    counts: Counts
    curves: KeptCurves
    tables: Mapping[str, pd.DataFrame]
    _made: dict[object, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def cached(self, key: object, make: Callable[[], _Made]) -> _Made:
        """Return a value that several parts of a report share, computed at its first use."""
        if key not in self._made:
            self._made[key] = make()
        stored: _Made = self._made[key]
        return stored

    @property
    def front_ids(self) -> list[int]:
        """`design_id` of the rows on the Pareto front."""
        return [int(number) for number in self.table.loc[self.table["pareto"], "design_id"]]

    @property
    def objective(self) -> Objective:
        """Objective of the study."""
        return self.study.objective

    @property
    def goal(self) -> Column:
        """Column of the objective."""
        return self.columns[self.objective.column]

    @property
    def trade_off(self) -> tuple[Column, Column]:
        """Axes of the Pareto front: separation and sensitivity.

        `pareto` marks it among the designs that meet every constraint except those on these two.
        """
        separation, sensitivity = self.provenance.trade_off
        return self.columns[separation], self.columns[sensitivity]

    @cached_property
    def columns(self) -> dict[str, Column]:
        """Quantities of the result table by name."""
        return {column.name: column for column in self.provenance.quantities}

    @property
    def distances(self) -> list[str]:
        """Columns of all CSDs."""
        return [name for name, c in self.columns.items() if c.role == "separation" and not c.extreme]

    @property
    def light(self) -> list[str]:
        """Columns of the sensitivities."""
        return [name for name, c in self.columns.items() if c.role == "light" and not c.extreme]

    @property
    def further(self) -> list[str]:
        """Columns of objective and constraints beside the CSDs and the sensitivities."""
        named = (*self.constraints, *self.objective.weights, self.objective.column)
        return [name for name in dict.fromkeys(named) if name not in (*self.distances, *self.light)]

    @property
    def parameters(self) -> list[str]:
        """Columns of the families' parameters."""
        return list(self.provenance.parameters)

    @property
    def constraints(self) -> Mapping[str, Bound]:
        """Constraints of the study."""
        return self.study.constraints

    @property
    def scenarios(self) -> list[str]:
        """Names of the scenes, in order."""
        return list(self.study.scenarios)

    def words(self, column: str) -> str:
        """Return a column's name in texts."""
        return self.columns[column].words if column in self.columns else column

    @property
    def order(self) -> tuple[str, str, str]:
        """Columns that rank designs, the first one first, all maximized."""
        return (self.objective.column, *self.provenance.trade_off)

    @property
    def scenario(self) -> str:
        """Leading scenario of answers: the search's, else the first one."""
        search = self.provenance.search
        return self.scenarios[0] if search is None else search.scenario

    @cached_property
    def best(self) -> pd.DataFrame:
        """Feasible swept and searched designs, best first; those of the leading scenario before all others."""
        candidates = self.table[self.table["feasible"] & self.table["kind"].isin([SWEPT, SEARCHED])]
        leading = (candidates["scenario"] == self.scenario).rename("leading")
        keys = ["leading", *self.order, "design_id"]
        return (
            candidates.assign(leading=leading).sort_values(keys, ascending=[False] * 4 + [True]).drop(columns="leading")
        )

    @cached_property
    def none_feasible(self) -> bool:
        """True if designs were swept or searched, and none of them meets every constraint."""
        return len(self.kind(SWEPT, SEARCHED)) > 0 and self.best.empty

    def mosaic(self, cfa: str) -> Mosaic:
        """Return the mosaic of a CFA."""
        tile = self.study.cfas[cfa].tile
        return Mosaic.from_name(cfa) if tile is None else Mosaic.from_rows(cfa, tile)

    def kind(self, *kinds: str) -> pd.DataFrame:
        """Return the rows of some kinds."""
        return self.table[self.table["kind"].isin(kinds)]

    @cached_property
    def named(self) -> pd.DataFrame:
        """Plain CFAs and named designs."""
        return self.kind(REFERENCE, NAMED)

    @cached_property
    def named_rows(self) -> pd.DataFrame:
        """Plain CFAs, named designs and the search's answer."""
        return self.kind(*NAMED_KINDS)


def read_output(folder: Path, *, with_added: bool = True) -> Output:
    """Read a finished run.

    Raises OutputError: files, which it names, are missing or not as the run wrote them.
    """
    manifest = Manifest(folder)
    manifest.require_run()
    if manifest.runs:
        names = ", ".join(folder_name(run.name) for run in manifest.runs)
        raise OutputError(ValidationIssue("holds the runs of several sensors", str(folder), allowed=f"one of {names}"))
    if PROVENANCE not in manifest.files:
        state = "a run goes on here" if in_use(folder) else "a run was interrupted here, and the same command continues"
        raise OutputError(ValidationIssue(state, str(folder), allowed="a folder that `sweep run` finished"))
    added = gathered("ADDED").keys() if with_added else set[str]()
    optional = (manifest.files.keys() & (made_by_run() | added)).difference(_ALWAYS)
    manifest.require([*_ALWAYS, *sorted(optional)])
    facts = _mapping(folder / PROVENANCE, json.loads)
    if facts.get("model_version", MODEL_VERSION) != MODEL_VERSION:
        problem, allowed = (
            "made by another version of sweep",
            f"{MODEL_VERSION}; `sweep run` of the study makes it anew",
        )
        raise OutputError(ValidationIssue(problem, str(folder), None, "model_version", facts["model_version"], allowed))
    resolved = _mapping(folder / RESOLVED, lambda text: YAML(typ="safe").load(text))
    if lacks := [key for key in _ALWAYS_WRITTEN if key not in resolved]:
        raise missing_parts_error(folder / RESOLVED, lacks)
    study = checked_facts(folder / RESOLVED, StudySection, resolved)
    provenance = checked_facts(folder / PROVENANCE, Provenance, facts)
    quantities = (column.name for column in provenance.quantities)
    rows = [*files.ROW_COLUMNS, *provenance.parameters, *quantities]
    for name in (files.DESIGNS, files.PARETO):
        _check_columns(folder / name, rows)
    for name, columns in _COLUMNS.items():
        if name in optional or name in _ALWAYS:
            _check_columns(folder / name, columns)
    pareto = read_table(folder / files.PARETO)
    table = shown_rows(read_table(folder / files.DESIGNS), pareto).to_pandas()
    separation = provenance.trade_off[0]
    table[per_exposure(separation)] = table[separation] / (table[EXPOSURE] * MS)
    more = {
        name: read_table(folder / name).to_pandas()
        for name in (files.POINTS, files.LIMITED_BY, files.SATURATED, *(optional - {INPUTS}))
    }
    of_rows = more[files.LIMITED_BY].drop(columns="filter_id", errors="ignore")
    table = table.merge(of_rows, on="design_id", how="left")
    for name, put in gathered("ROWS", "page").items():
        if name in more:
            table = put(table, more[name])
    try:
        curves = KeptCurves.of_table(read_table(folder / files.CURVES))
    except ValueError as error:
        raise OutputError(ValidationIssue(f"cannot be read: {error}", str(folder / files.CURVES))) from None
    return Output(
        folder=folder,
        study=study,
        resolved=resolved,
        provenance=provenance,
        table=table,
        counts=Counts.of(provenance.counts, pareto),
        curves=curves,
        tables=more,
    )


def _mapping(path: Path, parse: Callable[[str], Any]) -> dict[str, Any]:
    """Return the mapping in a text file; raises OutputError."""
    try:
        content = parse(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError, YAMLError) as error:
        raise OutputError(ValidationIssue(f"cannot be read: {error}", str(path))) from None
    if not isinstance(content, dict):
        raise OutputError(ValidationIssue("not a mapping", str(path)))
    return content


def _check_columns(path: Path, needed: Sequence[str]) -> None:
    """Raise OutputError for a table without the requested columns."""
    try:
        names = pq.read_schema(path).names
    except (OSError, pa.ArrowException) as error:
        raise OutputError(ValidationIssue(f"cannot be read: {error}", str(path))) from None
    if missing := [name for name in dict.fromkeys(needed) if name not in names]:
        raise missing_parts_error(path, missing)
