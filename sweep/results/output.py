"""A finished output folder, read back."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ruamel.yaml import YAML

from ..base.errors import Fault, OutputError
from ..base.types import IndexArray
from ..camera.mosaic import Mosaic
from ..metrics.bound import Bound
from ..metrics.objective import Objective
from ..metrics.quantity import Column
from ..study import StudySection
from .checks import check_columns, checked_facts, lacking_in, read_mapping
from .curves import SCHEMA as CURVES_SCHEMA
from .curves import KeptCurves
from .facts import Provenance
from .inventory import Inventory, no_run
from .profiles import ParameterProfile, Profiles
from .tables import (
    AUDIT,
    CROSSINGS,
    CURVES,
    FEW,
    FOUND,
    FRONT,
    LEFT_OUT,
    LIMITED_BY,
    NAMED,
    PLAIN,
    POINTS,
    PROVENANCE,
    RECOGNITION,
    REGIONS_MAP,
    RENDERED,
    RESOLVED,
    RESULTS,
    ROBUSTNESS,
    ROW_COLUMNS,
    SEARCH_LOG,
    SENSOR_MAP,
    SWEPT,
    TRADED,
    VALIDATED,
    VISION_TABLES,
    front_schema,
    read_table,
)
from .thinning import Counts, swept_points, thinned

if TYPE_CHECKING:
    import pandas as pd

_Made = TypeVar("_Made")
_OPTIONAL = (
    FRONT,
    CROSSINGS,
    RECOGNITION,
    SEARCH_LOG,
    AUDIT,
    VALIDATED,
    ROBUSTNESS,
    REGIONS_MAP,
    SENSOR_MAP,
    LEFT_OUT,
    TRADED,
    RENDERED,
    *VISION_TABLES,
)
"""Files that some runs alone have."""
_ALWAYS_WRITTEN = ("study", "seed", "wavelengths", "scenarios", "objective")
"""Keys of every resolved study: it has its defaults, too, so that one that lacks them was cut."""


@dataclass(frozen=True)
class Output:
    """What a run left in its folder; of a long result table, `table` holds what a report shows.

    `study`: the study that was run, and `resolved` its file. `profiles`: over the whole table, per CFA; none where a
    sweep is no grid. `swept_points`: ids of the swept designs that figures show as points. `searched`: the search's
    evaluations. `audited`: rows of `sweep audit`; `left_out`: a row per light that was left out of a search; `regions`:
    cells of the maps of color regions. `traded`: color error against noise, `rendered`: areas of pictures; `places`:
    separations over the sensor; `vision`: tables of the benchmark of vision by their files' names.
    """

    folder: Path
    study: StudySection
    resolved: Mapping[str, Any]
    provenance: Provenance
    table: pd.DataFrame
    counts: Counts
    swept_points: IndexArray
    curves: KeptCurves
    points: pd.DataFrame
    front: pd.DataFrame | None
    recognition: pd.DataFrame | None
    crossings: pd.DataFrame | None
    searched: pd.DataFrame | None
    audited: pd.DataFrame | None
    left_out: pd.DataFrame | None
    regions: pd.DataFrame | None
    traded: pd.DataFrame | None
    rendered: pd.DataFrame | None
    places: pd.DataFrame | None
    vision: Mapping[str, pd.DataFrame]
    profiles: Mapping[str, Sequence[ParameterProfile]]
    _made: dict[object, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def once(self, key: object, make: Callable[[], _Made]) -> _Made:
        """What several parts of a report need of this run, made for the first of them."""
        if key not in self._made:
            self._made[key] = make()
        found: _Made = self._made[key]
        return found

    @property
    def objective(self) -> Objective:
        """What the study maximizes."""
        return self.study.objective

    @property
    def goal(self) -> Column:
        """Column of what the study maximizes."""
        return self.columns[self.objective.column]

    @property
    def trade_off(self) -> tuple[Column, Column]:
        """Axes of the Pareto front: separation, sensitivity.

        `pareto` marks it among the designs that meet every constraint but those on these two.
        """
        separation, sensitivity = self.provenance.trade_off
        return self.columns[separation], self.columns[sensitivity]

    @cached_property
    def columns(self) -> dict[str, Column]:
        """Quantities of the result table by their names."""
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
        """Columns that the study's objective and constraints name beside the CSDs and the sensitivities."""
        named = (*self.constraints, *self.objective.weights, self.objective.column)
        return [name for name in dict.fromkeys(named) if name not in (*self.distances, *self.light)]

    @property
    def parameters(self) -> list[str]:
        """Columns of the families' parameters."""
        return list(self.provenance.parameters)

    @property
    def constraints(self) -> Mapping[str, Bound]:
        """The study's constraints."""
        return self.study.constraints

    @property
    def scenarios(self) -> list[str]:
        """Names of the scenes, in order."""
        return list(self.study.scenarios)

    def words(self, column: str) -> str:
        """A column's name as people write it."""
        return self.columns[column].words if column in self.columns else column

    @property
    def order(self) -> tuple[str, str, str]:
        """Columns that say which design is best, the first one first, all maximized."""
        return (self.objective.column, *self.provenance.trade_off)

    @property
    def scenario(self) -> str:
        """Scenario that answers lead with: the search's, else the first one."""
        search = self.provenance.search
        return self.scenarios[0] if search is None else search.scenario

    @cached_property
    def best(self) -> pd.DataFrame:
        """Feasible swept and searched designs, best first; those of the leading scenario before all others."""
        candidates = self.table[self.table["feasible"] & self.table["kind"].isin([SWEPT, FOUND])]
        leading = (candidates["scenario"] == self.scenario).rename("leading")
        keys = ["leading", *self.order, "design_id"]
        return (
            candidates.assign(leading=leading).sort_values(keys, ascending=[False] * 4 + [True]).drop(columns="leading")
        )

    def mosaic(self, cfa: str) -> Mosaic:
        """Return the mosaic of a CFA of the study."""
        tile = self.study.cfas[cfa].tile
        return Mosaic.from_name(cfa) if tile is None else Mosaic.from_rows(cfa, tile)

    def kind(self, *kinds: str) -> pd.DataFrame:
        """Rows of some kinds: see `tables.PLAIN` and what stands beside it."""
        return self.table[self.table["kind"].isin(kinds)]

    @cached_property
    def named(self) -> pd.DataFrame:
        """Plain CFAs and named designs."""
        return self.kind(PLAIN, NAMED)

    @cached_property
    def few(self) -> pd.DataFrame:
        """The same and the search's answer."""
        return self.kind(*FEW)


def read_output(folder: Path, *, audited: bool = True) -> Output:
    """Read a finished run; raises OutputError, naming each, where files are missing or not as the run wrote them.

    `audited`: with the rows of `sweep audit`, where there are some.
    """
    inventory = Inventory(folder)
    if not inventory.fingerprint:
        raise no_run(folder)
    if PROVENANCE not in inventory.files:
        raise OutputError(Fault("no finished run here", str(folder), allowed="a folder that `sweep run` finished"))
    optional = [name for name in _OPTIONAL if name in inventory.files]
    if not audited and AUDIT in optional:
        optional.remove(AUDIT)
    inventory.require([RESULTS, CURVES, POINTS, LIMITED_BY, RESOLVED, PROVENANCE, *optional])
    resolved = read_mapping(folder / RESOLVED, lambda text: YAML(typ="safe").load(text))
    if lacks := [key for key in _ALWAYS_WRITTEN if key not in resolved]:
        raise lacking_in(folder / RESOLVED, lacks)
    study = checked_facts(folder / RESOLVED, StudySection, resolved)
    provenance = checked_facts(folder / PROVENANCE, Provenance, read_mapping(folder / PROVENANCE, json.loads))
    check_columns(folder / RESULTS, [*ROW_COLUMNS, *provenance.parameters, *(c.name for c in provenance.quantities)])
    check_columns(folder / LIMITED_BY, ["design_id"])
    check_columns(folder / POINTS, ["design_id", "signal_type", "signal", "channel", "dn"])
    if FRONT in optional:
        check_columns(folder / FRONT, front_schema(()).names)
    if LEFT_OUT in optional:
        check_columns(folder / LEFT_OUT, ["objective", "signal_type", "signal", "fall"])
    if ROBUSTNESS in optional:
        check_columns(folder / ROBUSTNESS, ["design_id", "breaks_at", "breaks_thickness"])
    objective = study.objective.column
    profiles = Profiles(objective, next(iter(study.scenarios)), provenance.parameters)
    points = swept_points(folder / RESULTS)
    order = [objective, *provenance.trade_off]
    table, counts = thinned(folder / RESULTS, order, provenance.trade_off[0], points, profiles.add)
    signals, limited = (read_table(folder / name).to_pandas() for name in (POINTS, LIMITED_BY))
    more = {name: read_table(folder / name).to_pandas() for name in optional}
    return Output(
        folder=folder,
        study=study,
        resolved=resolved,
        provenance=provenance,
        table=_joined(table, limited, more.get(VALIDATED), more.get(ROBUSTNESS)),
        counts=counts,
        swept_points=points,
        curves=_kept_curves(folder / CURVES),
        points=signals,
        front=more.get(FRONT),
        recognition=more.get(RECOGNITION),
        crossings=more.get(CROSSINGS),
        searched=more.get(SEARCH_LOG),
        audited=more.get(AUDIT),
        left_out=more.get(LEFT_OUT),
        regions=more.get(REGIONS_MAP),
        traded=more.get(TRADED),
        rendered=more.get(RENDERED),
        places=more.get(SENSOR_MAP),
        vision={name: table for name, table in more.items() if name in VISION_TABLES},
        profiles=profiles.found if all(made.grid is not None for made in study.sweeps.values()) else {},
    )


def _joined(table: pd.DataFrame, *others: pd.DataFrame | None) -> pd.DataFrame:
    """The table with what other tables say of its designs."""
    for other in others:
        if other is not None:
            table = table.merge(other.drop(columns="filter_id", errors="ignore"), on="design_id", how="left")
    return table


def _kept_curves(path: Path) -> KeptCurves:
    check_columns(path, CURVES_SCHEMA.names)
    try:
        return KeptCurves.of_table(read_table(path))
    except ValueError as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None
