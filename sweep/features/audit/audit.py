"""Compute a sample of a finished run again at the reference settings, and compare."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Hashable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from ...base.answer import Answer
from ...base.errors import ErrorBoundExceededError, ValidationIssue
from ...base.types import Progress, silent
from ...results.designs import study_of
from ...results.folder import run_folder
from ...results.lock import locked
from ...results.manifest import Manifest
from ...results.output import read_output
from ...runs.check import compared_rows
from ...study import Study
from . import AUDIT

_SHARE = 0.01
"""Share of the rows that are audited beside the front, plain CFAs and named designs."""
_KEYS = ("design_id", "filter_id", "scenario", "simulation_key")
_COLUMNS = (*_KEYS, "allowed_dn", "realized_dn", "quantity", "allowed_share", "realized_share", "other")


@dataclass(frozen=True)
class Audit:
    """Result of an audit.

    `rows`: a row per audited design with its id, scenario and plan, the largest error of a separation, the error that
    is allowed, DN, and the column that has it; the same of other columns, relative. `n_designs`: of the whole run.
    """

    rows: pd.DataFrame
    n_designs: int

    @property
    def broken(self) -> pd.DataFrame:
        """Rows whose error is larger than allowed, or not a number; rounding of the arithmetic is not counted."""
        in_dn = self.rows["realized_dn"] <= self.rows["allowed_dn"] * (1 + 1e-9) + 1e-9
        return self.rows[~(in_dn & (self.rows["realized_share"] <= self.rows["allowed_share"]))]

    @property
    def lines(self) -> list[str]:
        """Result of the audit, a line for each scenario."""
        broken = len(self.broken)
        lines = [
            f"{len(self.rows):,} of {self.n_designs:,} designs computed again at the reference settings: "
            f"{'no error is' if not broken else f'{broken:,} errors are'} larger than allowed."
        ]
        worst = self.rows.groupby("scenario", observed=True, sort=False)[["allowed_dn", "realized_dn"]].max()
        return lines + [f"{name}: error {r:.3g} DN, allowed {a:.3g} DN." for name, a, r in worst.itertuples()]

    @property
    def issues(self) -> list[ValidationIssue]:
        """The largest error of each scenario with errors that are too large."""
        excess = self.broken["realized_dn"].fillna(np.inf) - self.broken["allowed_dn"]
        worst = self.broken.assign(excess=excess).sort_values("excess", ascending=False).drop_duplicates("scenario")
        return [_issue(row) for row in worst.to_dict("records")]

    def answer(self, folder: Path) -> Answer:
        """Return the result of the audit of a run in a folder."""
        facts = {"folder": str(folder), "designs": self.n_designs, "rows": self.rows.to_dict("records")}
        problem = ErrorBoundExceededError(self.issues) if self.issues else None
        return Answer([*self.lines, f"Files: {folder}/: {AUDIT}."], facts, problem)


def _issue(row: Mapping[Hashable, Any]) -> ValidationIssue:
    column, realized, allowed = row["other"], f"{row['realized_share']:.3%}", f"{row['allowed_share']:.3%}"
    if not row["realized_dn"] <= row["allowed_dn"] * (1 + 1e-9) + 1e-9:
        column, realized, allowed = row["quantity"], f"{row['realized_dn']:.6g} DN", f"{row['allowed_dn']:.6g} DN"
    problem = f"design {row['design_id']}: {column} is off by more than allowed"
    return ValidationIssue(problem, key=str(row["scenario"]), value=realized, allowed=f"at most {allowed}")


def sampled(table: pd.DataFrame, on_front: Collection[int]) -> pd.DataFrame:
    """Select the rows to audit.

    `on_front`: ids of the front. Returns that, all rows that are not of a sweep, and 1 % of the others by the hash of
    their id.
    """
    digests = [hashlib.sha256(str(i).encode()).digest()[:4] for i in table["design_id"]]
    hashed = np.array([int.from_bytes(digest, "big") / 2**32 for digest in digests], dtype=float)
    is_sampled = table["design_id"].isin(on_front) | (table["kind"] != "sweep") | (hashed < _SHARE)
    return table[is_sampled & (table["status"] == "ok")]


def audit_rows(
    study: Study, tables: Iterable[pd.DataFrame], on_front: Collection[int], progress: Progress = silent
) -> Audit:
    """Compute the selected rows again at the reference settings."""
    samples, n_designs = [], 0
    for table in tables:
        samples.append(sampled(table, on_front))
        n_designs += len(table)
    rows: list[dict[str, object]] = []
    total = sum(map(len, samples))
    for sample in samples:
        records = [{str(key): value for key, value in row.items()} for row in sample.to_dict("records")]
        for compared in compared_rows(study, records):
            rows += compared
            progress("designs computed again", len(rows), total)
    return Audit(pd.DataFrame(rows, columns=list(_COLUMNS)), n_designs)


def audit(
    folder: Path | str, data: Path | str | None = None, *, allow_code: bool = False, progress: Progress = silent
) -> Answer:
    """Compute the front and 1 % of a run's rows again at the reference settings, and compare.

    Parameters
    ----------
    folder : path-like
        Folder of a finished run, which keeps the audited rows.
    data : path-like, optional
        Folder of the study's files.
    allow_code : bool
        Permit the code that the run was made with to run.
    progress : callable, optional
        Called with a phase, how much of it is done, and how much there is.

    Returns
    -------
    Answer
        Errors of each scenario; a problem if one is larger than the study's tolerance allows.

    Raises
    ------
    SweepError
        If the run is not finished or damaged, or its study cannot be loaded.
    """
    folder = run_folder(folder)
    output = read_output(folder, with_added=False)
    study = study_of(output, None if data is None else Path(data), allow_code=allow_code)
    front = set(output.front_ids)
    result = audit_rows(study, (table.to_pandas() for table in Manifest(folder).batches()), front, progress)
    with locked(folder):
        Manifest(folder).write_table(AUDIT, pa.Table.from_pandas(result.rows, preserve_index=False))
    return result.answer(folder)
