"""Tables that are computed from a run's rows: calls for the designs that a report names, one table of all answers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from ..base.types import Call, DesignCurves, Parallel, Progress
from ..camera.setup import Setup
from ..designs.space import Space
from ..results.designs import named_rows, row_curves, rows_of_series
from ..study import Study
from .between import Between, between
from .workers import run_with_progress

if TYPE_CHECKING:
    import pandas as pd

Calls = Iterable[tuple[dict[str, Any], Call]]
"""What all rows of a call's answer have, and the call; it returns a list of rows."""


@dataclass(frozen=True)
class Analysis:
    """Table of a run: when a study asks for it, and the calls that make it; `phase`: its name beside the progress."""

    phase: str
    asked: Callable[[Study], bool]
    schema: Callable[[Study], pa.Schema]
    calls: Callable[[Study, pd.DataFrame], Calls]
    is_kept: bool = False

    def table(self, study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
        """Compute the table of the rows that a report names."""
        keyed = [*self.calls(study, rows)]
        answers = run_with_progress(parallel, [call for _, call in keyed], self.phase, progress)
        table_rows = [key | row for (key, _), answer in zip(keyed, answers, strict=True) for row in answer]
        return pa.Table.from_pylist(table_rows, schema=self.schema(study))


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
