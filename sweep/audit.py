"""Recompute a sample of a finished run with every effect on: promised beside realized."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa

from .evaluate import BEST_PLACE, evaluate
from .imaging import imager_of
from .metrics import CSD
from .report import read_output, study_of
from .runner.drawn import row_space
from .setup import REFERENCE
from .store import AUDIT, RESULTS, batches, write_table
from .study import Study

SHARE = 0.01
_COLUMNS = ("design_id", "scenario", "plan", "promised_dn", "realized_dn")


@dataclass(frozen=True)
class Audit:
    """A row per audited design: its id, scenario, promised and realized error, DN (the largest of its CSDs, at
    the worst and at the best place)."""

    rows: pd.DataFrame
    n_designs: int

    @property
    def broken(self) -> pd.DataFrame:
        """Rows whose error is larger than promised; rounding of the arithmetic itself is not counted."""
        return self.rows[self.rows["realized_dn"] > self.rows["promised_dn"] * (1 + 1e-9) + 1e-9]


def _hashed(design_id: np.ndarray) -> np.ndarray:
    """A number from 0 to 1 for each id, the same for ever."""
    digests = [hashlib.sha256(str(i).encode()).digest()[:4] for i in design_id]
    return np.array([int.from_bytes(digest, "big") / 2**32 for digest in digests], dtype=float)


def sampled(table: pd.DataFrame, share: float = SHARE) -> pd.DataFrame:
    """The Pareto front, everything that is no sweep, and a share of the rest, chosen by the hash of the row's id."""
    wanted = table["pareto"] | (table["kind"] != "sweep") | (_hashed(table["design_id"].to_numpy()) < share)
    return table[wanted & (table["status"] == "ok")]


def audit(study: Study, tables: Iterable[pd.DataFrame]) -> Audit:
    """Recompute the sample with the reference; `study` is the one that made the tables."""
    rows: list[dict[str, object]] = []
    n_designs = 0
    for table in tables:
        rows += _rows(study, sampled(table))
        n_designs += len(table)
    return Audit(pd.DataFrame(rows, columns=list(_COLUMNS)), n_designs)


def audit_output(folder: Path, data: Path | None) -> list[str]:
    """Audit a finished run, write its rows beside it, and say what was found."""
    output = read_output(folder)
    study = study_of(output, data)
    found = audit(study, (table.to_pandas() for table in batches(folder / RESULTS)))
    write_table(pa.Table.from_pandas(found.rows, preserve_index=False), folder / AUDIT)
    broken = len(found.broken)
    lines = [
        f"{len(found.rows):,} of {found.n_designs:,} designs recomputed with every effect on: "
        f"{'no error is' if not broken else f'{broken:,} errors are'} larger than promised."
    ]
    worst = found.rows.groupby("scenario", observed=True, sort=False)[["promised_dn", "realized_dn"]].max()
    lines += [f"{name}: promised {p:.3g} DN, realized {r:.3g} DN." for name, p, r in worst.itertuples()]
    return lines


def _rows(study: Study, sample: pd.DataFrame) -> Iterator[dict[str, object]]:
    distances = [name for name in sample.columns if name.startswith((CSD, BEST_PLACE + CSD))]
    for row in sample.to_dict("records"):
        space = row_space(study, row)
        setup = replace(study.setup(space, row["scenario"]), methods=REFERENCE)
        point = np.array([[row[name] for name in space.parameters]], dtype=float)
        exact = evaluate(imager_of(setup), space.curves(point, study.grid.size))
        off = [abs(float(exact[name][0]) - row[name]) for name in distances]
        yield {
            "design_id": row["design_id"],
            "scenario": row["scenario"],
            "plan": row["plan"],
            "promised_dn": row["promised_dn"],
            "realized_dn": max(off),
        }
