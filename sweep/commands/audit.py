"""Recompute a sample of a finished run with every effect on: promised beside realized."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa

from ..base.errors import Fault
from ..base.types import FloatArray, Progress
from ..camera.imager import imager_of
from ..camera.methods import REFERENCE
from ..designs.space import Space
from ..metrics.evaluate import evaluate
from ..metrics.quantity import WORST_CASE
from ..report import read_output, study_of
from ..results.designs import row_space
from ..results.inventory import Inventory
from ..results.lock import locked
from ..results.tables import AUDIT, RESULTS, batches
from ..run.routes import worst_cases
from ..study import Study

SHARE = 0.01
_COLUMNS = ("design_id", "filter_id", "scenario", "plan", "promised_dn", "realized_dn", "quantity")
_AT_ONCE = 64
"""Designs that are recomputed in one block, between two reports of progress."""


@dataclass(frozen=True)
class Audit:
    """A row per audited design: its id, scenario and plan, what was promised and the largest error of all promised
    columns, DN, and the column that has it.
    """

    rows: pd.DataFrame
    n_designs: int

    @property
    def broken(self) -> pd.DataFrame:
        """Rows whose error is larger than promised, or not a number; rounding of the arithmetic is not counted."""
        return self.rows[~(self.rows["realized_dn"] <= self.rows["promised_dn"] * (1 + 1e-9) + 1e-9)]

    @property
    def lines(self) -> list[str]:
        """What was found, in words."""
        broken = len(self.broken)
        lines = [
            f"{len(self.rows):,} of {self.n_designs:,} designs recomputed with every effect on: "
            f"{'no error is' if not broken else f'{broken:,} errors are'} larger than promised."
        ]
        worst = self.rows.groupby("scenario", observed=True, sort=False)[["promised_dn", "realized_dn"]].max()
        return lines + [f"{name}: promised {p:.3g} DN, realized {r:.3g} DN." for name, p, r in worst.itertuples()]

    @property
    def faults(self) -> list[Fault]:
        """For each scenario with broken promises, the one that is broken by most."""
        by = self.broken.assign(excess=self.broken["realized_dn"].fillna(np.inf) - self.broken["promised_dn"])
        worst = by.sort_values("excess", ascending=False).drop_duplicates("scenario")
        return [
            Fault(
                f"design {row['design_id']}: {row['quantity']} is off by more than promised",
                key=str(row["scenario"]),
                value=f"{row['realized_dn']:.6g} DN",
                allowed=f"at most {row['promised_dn']:.6g} DN",
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
    """Recompute the sample with the reference; `study` is the one that made the tables."""
    samples, n_designs = [], 0
    for table in tables:
        samples.append(sampled(table))
        n_designs += len(table)
    rows: list[dict[str, object]] = []
    total = sum(map(len, samples))
    for sample in samples:
        for found in _rows(study, sample):
            rows += found
            progress("designs recomputed", len(rows), total)
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


def _rows(study: Study, sample: pd.DataFrame) -> Iterator[list[dict[str, object]]]:
    """The audited rows of a sample, a block of designs of one space and scenario at a time."""
    promised = [name for name, quantity in study.quantities.items() if quantity.promised]
    groups: dict[tuple[int, str], tuple[Space, list[dict[str, object]]]] = {}
    for row in sample.to_dict("records"):
        space = row_space(study, row)
        groups.setdefault((id(space), row["scenario"]), (space, []))[1].append({str(k): v for k, v in row.items()})
    for (_, scenario), (space, rows) in groups.items():
        for start in range(0, len(rows), _AT_ONCE):
            yield _compared(study, space, scenario, rows[start : start + _AT_ONCE], promised)


def _compared(
    study: Study, space: Space, scenario: str, rows: list[dict[str, object]], promised: list[str]
) -> list[dict[str, object]]:
    points = np.array([[row[name] for name in space.parameters] for row in rows], dtype=float)
    exact = _exact(study, space, scenario, points)
    kept = {name: np.array([row[name] for row in rows], dtype=float) for name in promised}
    # A column that the scene does not have is missing in both; one that is missing in one of them is an error.
    off = {
        name: np.where(np.isnan(kept[name]) & np.isnan(exact[name]), 0.0, abs(exact[name] - kept[name]))
        for name in kept
    }
    names = list(off)
    each = np.nan_to_num(np.stack([off[name] for name in names]), nan=np.inf)
    worst = each.argmax(axis=0)
    return [
        {key: row[key] for key in ("design_id", "filter_id", "scenario", "plan", "promised_dn")}
        | {"realized_dn": float(each[at, index]), "quantity": names[at]}
        for index, (row, at) in enumerate(zip(rows, worst, strict=True))
    ]


def _exact(study: Study, space: Space, scenario: str, points: FloatArray) -> dict[str, FloatArray]:
    """The promised columns with every effect on, ndarray[n_designs] each."""
    imager = imager_of(replace(study.view(space, scenario), methods=REFERENCE))
    curves = space.curves(points, study.grid.size)
    nominal = evaluate(imager, curves, study.states, probabilities=study.asked.probabilities)
    promised = [quantity for quantity in study.quantities.values() if quantity.promised]
    worst = [quantity for quantity in promised if quantity.extreme == WORST_CASE]
    found = {quantity.name: nominal[quantity.name] for quantity in promised if quantity not in worst}
    return found | (worst_cases(space, imager, points, nominal, worst, study.tolerance) if worst else {})
