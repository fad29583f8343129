"""Compute a sample of a finished run again at the reference settings, and compare."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa

from ..base.errors import Fault
from ..base.types import Progress
from ..report import read_output, study_of
from ..results.inventory import Inventory
from ..results.lock import locked
from ..results.tables import AUDIT, RESULTS, batches
from ..run.check import compared_rows
from ..study import Study

SHARE = 0.01
_COLUMNS = ("design_id", "filter_id", "scenario", "plan", "allowed_dn", "realized_dn", "quantity")


@dataclass(frozen=True)
class Audit:
    """A row per audited design: its id, scenario and plan, the largest error of any CSD, the one that is allowed, DN,
    and the column that has it.
    """

    rows: pd.DataFrame
    n_designs: int

    @property
    def broken(self) -> pd.DataFrame:
        """Rows whose error is larger than allowed, or not a number; rounding of the arithmetic is not counted."""
        return self.rows[~(self.rows["realized_dn"] <= self.rows["allowed_dn"] * (1 + 1e-9) + 1e-9)]

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
    def faults(self) -> list[Fault]:
        """For each scenario with too large errors, the largest one."""
        by = self.broken.assign(excess=self.broken["realized_dn"].fillna(np.inf) - self.broken["allowed_dn"])
        worst = by.sort_values("excess", ascending=False).drop_duplicates("scenario")
        return [
            Fault(
                f"design {row['design_id']}: {row['quantity']} is off by more than allowed",
                key=str(row["scenario"]),
                value=f"{row['realized_dn']:.6g} DN",
                allowed=f"at most {row['allowed_dn']:.6g} DN",
            )
            for row in worst.to_dict("records")
        ]


def _hashed(design_id: np.ndarray) -> np.ndarray:
    """A number from 0 to 1 for each id, the same for ever."""
    digests = [hashlib.sha256(str(i).encode()).digest()[:4] for i in design_id]
    return np.array([int.from_bytes(digest, "big") / 2**32 for digest in digests], dtype=float)


def sampled(table: pd.DataFrame, share: float = SHARE) -> pd.DataFrame:
    """The Pareto front, everything that is no sweep, and a share of the rest, chosen by the hash of the row's id."""
    wanted = table["pareto"] | (table["kind"] != "sweep") | (_hashed(table["design_id"].to_numpy()) < share)
    return table[wanted & (table["status"] == "ok")]


def audit_rows(study: Study, tables: Iterable[pd.DataFrame], progress: Progress = lambda *_: None) -> Audit:
    """Compute the sample at the reference settings; `study` is the one that made the tables."""
    samples, n_designs = [], 0
    for table in tables:
        samples.append(sampled(table))
        n_designs += len(table)
    rows: list[dict[str, object]] = []
    total = sum(map(len, samples))
    for sample in samples:
        records = [{str(key): value for key, value in row.items()} for row in sample.to_dict("records")]
        for compared in compared_rows(study, records):
            rows += compared
            progress("designs computed again", len(rows), total)
    return Audit(pd.DataFrame(rows, columns=list(_COLUMNS)), n_designs)


def audit_output(
    folder: Path, data: Path | None, progress: Progress = lambda *_: None, *, allow_code: bool = False
) -> Audit:
    """Audit a finished run and write its rows beside it; errors as for `study_of` and `Inventory.write`."""
    output = read_output(folder, audited=False)
    study = study_of(output, data, allow_code=allow_code)
    found = audit_rows(study, (table.to_pandas() for table in batches(folder / RESULTS)), progress)
    with locked(folder):
        Inventory(folder).write_table(AUDIT, pa.Table.from_pandas(found.rows, preserve_index=False))
    return found


def mend_audit(folder: Path, data: Path | None) -> None:
    """Audit a run again whose audited rows are missing or damaged."""
    inventory = Inventory(folder)
    if AUDIT in inventory.files and inventory.wrong([AUDIT]):
        audit_output(folder, data)
