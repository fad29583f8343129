"""Tables that are computed from a run's rows: calls for the designs that a report names, one table of all answers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import pyarrow as pa

from ..base.types import Array, Call, DesignCurves, Float, IndexArray, Int, Parallel, PerParameter, Progress
from ..camera.setup import Setup
from ..designs.space import Space
from ..results.designs import computed_rows, named_rows, row_curves, rows_of_series
from ..results.tables import SEARCHED
from ..search.upper_bound import UpperBound
from ..spectra.lights import Pair
from ..study import Study
from .between import Between, between
from .workers import run_with_progress

if TYPE_CHECKING:
    import pandas as pd

_Made = TypeVar("_Made")
Calls = Iterable[tuple[dict[str, Any], Call]]
"""What all rows of a call's answer have, and the call; it returns a list of rows."""


@dataclass(frozen=True)
class Details:
    """Details of one design."""

    limited_by: Mapping[Pair, str | None] | None = None
    dn: Float[Array, "signals channels"] | None = None


@dataclass(frozen=True)
class Shown:
    """What the tables beside the rows are made from; `kept` makes calls whose answers are kept under a name."""

    study: Study
    rows: pd.DataFrame
    on_front: pd.DataFrame
    details: Mapping[int, Details]
    points: Int[IndexArray, " points"]
    limit: Callable[[], UpperBound | None]
    parallel: Parallel
    kept: Callable[[str], Parallel]
    progress: Progress
    _made: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def cached(self, key: str, make: Callable[[], _Made]) -> _Made:
        """Return what several tables share, made at its first use."""
        if key not in self._made:
            self._made[key] = make()
        made: _Made = self._made[key]
        return made

    @property
    def answer(self) -> PerParameter:
        """Parameters of the search's answer."""
        assert self.study.search is not None
        row = self.rows[self.rows["kind"] == SEARCHED].iloc[0]
        return np.asarray([row[name] for name in self.study.search.space.parameters], dtype=float)

    @property
    def drawn(self) -> list[dict[Any, Any]]:
        """Rows of the first scenario and the search's answer, without those that failed."""
        first = self.rows["scenario"] == next(iter(self.study.scenarios))
        return computed_rows(self.rows[first | (self.rows["kind"] == SEARCHED)])

    @property
    def other_front(self) -> list[dict[Any, Any]]:
        """Rows on the front that are not drawn."""
        ids = [row["design_id"] for row in self.drawn]
        return computed_rows(self.on_front[~self.on_front["design_id"].isin(ids)])


@dataclass(frozen=True)
class RunTable:
    """File of a run beside its rows: when a study asks for it, and how it is made of what a page shows."""

    name: str
    asked: Callable[[Study], bool]
    make: Callable[[Shown], pa.Table]


def table_of_calls(
    name: str,
    phase: str,
    asked: Callable[[Study], bool],
    schema: Callable[[Study], pa.Schema],
    calls: Callable[[Study, pd.DataFrame], Calls],
    *,
    is_kept: bool = False,
) -> RunTable:
    """Return a file of the answers of calls; `phase`: its name beside the progress, `is_kept`: a kill loses none."""

    def make(shown: Shown) -> pa.Table:
        keyed = [*calls(shown.study, shown.rows)]
        parallel = shown.kept(phase) if is_kept else shown.parallel
        answers = run_with_progress(parallel, [call for _, call in keyed], phase, shown.progress)
        table_rows = [key | row for (key, _), answer in zip(keyed, answers, strict=True) for row in answer]
        return pa.Table.from_pylist(table_rows, schema=schema(shown.study))

    return RunTable(name, asked, make)


@dataclass(frozen=True)
class NamedDesign:
    """Plain CFA, named design or answer of a search, in one scene."""

    row: Mapping[Any, Any]
    space: Space
    setup: Setup
    curves: DesignCurves

    @property
    def key(self) -> dict[str, Any]:
        """What rows of the design begin with."""
        return {"design_id": self.row["design_id"]}


def named_designs(study: Study, rows: pd.DataFrame) -> Iterator[NamedDesign]:
    """Yield the designs that a report names, in each scene."""
    for row in named_rows(rows):
        space, curves = row_curves(study, row)
        yield NamedDesign(row, space, study.setup(space, row["scenario"]), curves)


@dataclass(frozen=True)
class DesignBetween:
    """Design in all scenarios of a series, which differ in one number, and in the scenes between them."""

    key: dict[str, Any]
    rows: pd.DataFrame
    numbers: Mapping[str, float]
    curves: DesignCurves
    setup: Setup
    scenes: Between


def designs_between(study: Study, rows: pd.DataFrame) -> Iterator[DesignBetween]:
    """Yield the designs that a report names, in each series of scenarios."""
    for series, key, numbers, row, curves, space in rows_of_series(study, rows):
        setup = study.setup(space, next(iter(numbers)))
        scenes = between(study, setup, numbers)
        if scenes is not None:
            named = {"design_id": row["design_id"], "name": row["name"], "series": series, "key": key}
            of_design = rows[(rows["name"] == row["name"]) & rows["scenario"].isin(list(numbers))]
            yield DesignBetween(named, of_design, numbers, curves, setup, scenes)
