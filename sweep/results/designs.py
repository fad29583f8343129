"""Studies and designs of a finished run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from ..base.errors import OutputError, SweepError, ValidationIssue, nearest
from ..base.types import Array, Float, PerWavelength
from ..base.user_code import CODE_OF, is_code
from ..designs.space import Space
from ..study import Study, load_study
from ..study.axes import series_of
from .manifest import Manifest
from .tables import NAMED_KINDS, RESOLVED, RESULTS

if TYPE_CHECKING:
    import pandas as pd

    from .output import Output

BEST = "best"
_MOST_SHOWN = 10


def row_space(study: Study, row: Mapping[Any, Any]) -> Space:
    """Return the design space of a row."""
    if row["kind"] == "search":
        assert study.search is not None
        return next(space for space in study.search.searched if space.name == row["space"])
    ends = np.cumsum([space.size for space in study.spaces])  # ids run through the spaces of each scenario
    return study.spaces[int(np.searchsorted(ends, row["design_id"] % ends[-1], side="right"))]


def row_curves(study: Study, row: Mapping[Any, Any]) -> tuple[Space, Any]:
    """Return the design space and the curves of a row."""
    space = row_space(study, row)
    point = np.array([[row[name] for name in space.parameters]], dtype=float)
    return space, space.curves(point, study.grid.size)


def channel_curves(study: Study, row: Mapping[Any, Any]) -> dict[str, PerWavelength]:
    """Return the QE of each channel of a row's CFA with its filter."""
    space, modified = row_curves(study, row)
    camera = study.setup(space, row["scenario"]).camera
    qe = camera.qe.copy()
    qe[list(camera.modified)] = modified[0]
    return dict(zip(camera.mosaic.channels, qe, strict=True))


def computed_rows(*tables: pd.DataFrame) -> list[dict[Any, Any]]:
    """Return the rows of tables, each design once, without those that failed."""
    rows: dict[Any, dict[Any, Any]] = {}
    for table in tables:
        for row in table[table["status"] == "ok"].to_dict("records"):
            rows.setdefault(row["design_id"], row)
    return [*rows.values()]


def named_rows(table: pd.DataFrame) -> list[dict[Any, Any]]:
    """Return the rows of plain CFAs, named designs and the search's answer, without those that failed."""
    return computed_rows(table[table["kind"].isin(NAMED_KINDS)])


def rows_of_series(
    study: Study, table: pd.DataFrame
) -> Iterator[tuple[str, str, dict[str, float], Mapping[Any, Any], Float[Array, "1 modified wavelengths"], Space]]:
    """Yield each design that was computed in all scenarios of a series."""
    shown = named_rows(table)
    for (series, key), scenarios in series_of(study.scenarios).items():
        by_name: dict[str, dict[str, Mapping[Any, Any]]] = {}
        for row in shown:
            if row["scenario"] in scenarios:
                by_name.setdefault(row["name"], {})[row["scenario"]] = row
        for of_scene in by_name.values():
            if of_scene.keys() == scenarios.keys():
                first = of_scene[next(iter(scenarios))]
                space, curves = row_curves(study, first)
                yield series, key, scenarios, first, curves, space


def find_design_row(output: Output, design: str | int) -> Mapping[Any, Any]:
    """Return the row of a run's design by name, design_id or `best`.

    Raises SweepError if there is no such design, with the nearest name, or if it failed.
    """
    key, table = str(design), output.table
    named = table[table["name"] == key]
    if key == BEST:
        if output.best.empty:
            raise SweepError(
                ValidationIssue("the run has no feasible design that was swept or searched", str(output.folder))
            )
        row: dict[Any, Any] = output.best.iloc[0].to_dict()
    elif len(named):
        row = named.iloc[0].to_dict()
    elif key.isascii() and key.isdecimal() and int(key) < output.provenance.filters:
        filters = (part.filter(pc.equal(part["filter_id"], int(key))) for part in Manifest(output.folder).batches())
        rows = next((part for part in filters if part.num_rows), pa.table({})).to_pylist()
        if not rows:
            raise OutputError(
                ValidationIssue("has too few rows", str(output.folder / RESULTS), None, "filter_id", int(key))
            )
        row = rows[0]
    else:
        names = list(dict.fromkeys(map(str, table["name"].dropna())))
        shown = [*names[:_MOST_SHOWN], *(["..."] if len(names) > _MOST_SHOWN else [])]
        allowed = f"{BEST}, a name ({', '.join(shown)}), or a filter_id from 0 to {output.provenance.filters - 1:,}"
        near = nearest(key, [*names, BEST])
        raise SweepError(ValidationIssue("no such design", str(output.folder), None, "design", key, allowed, near))
    if row["status"] != "ok":
        raise SweepError(ValidationIssue("the design failed", str(output.folder), None, "design", row["status"]))
    return row


def study_of(output: Output, data: Path | None, *, allow_code: bool = False) -> Study:
    """Make the study of a finished run again.

    `data`: folder of the study's files; without it those that the run kept are taken. Raises OutputError: code is not
    allowed, or the files are not those of the run. Raises StudyError: the code is another one.
    """
    path, digests = output.folder / RESOLVED, output.provenance.data_sha256
    code = {name: digest for name, digest in digests.items() if is_code(name)}
    in_files = [name for name in code if not name.startswith(CODE_OF)]
    if code and (not allow_code or (in_files and data is None)):
        where = "--data FOLDER, which holds it, and " if in_files else ""
        whose = ", ".join(in_files or [name.removeprefix(CODE_OF) for name in code])
        problem = f"it was made with the code of {whose}"
        raise OutputError(ValidationIssue(problem, str(output.folder), allowed=f"{where}--allow-code, if you trust it"))
    study = load_study(path, data, allow_code=code)
    if other := [name for name, digest in study.digests.items() if digests.get(name) != digest]:
        problem = f"not the files of the run: {', '.join(other)}"
        raise OutputError(ValidationIssue(problem, str(output.folder), allowed="those that it was made from"))
    return study
