"""The report of what accuracy costs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ...base.errors import Fault, OutputError
from ...report.pages import inlined, page, rows
from ...results.atomic import write_text

HARD_CASES = "hard_cases.json"
REPORT = "accuracy.html"
_HARD_COLUMNS = ("case", "oracle", "error", "allowed", "why")


@dataclass(frozen=True)
class AccuracyReport:
    """What the report shows: pictures by name, and the tables of tolerances, plans, settings and hard cases."""

    name: str
    question: str
    lines: Sequence[str]
    images: Mapping[str, bytes]
    ladder: pd.DataFrame
    payments: pd.DataFrame
    knobs: pd.DataFrame
    hard_cases: pd.DataFrame | None


def read_hard_cases(folder: Path) -> pd.DataFrame | None:
    """The table of hard cases that the tests left in a folder, or None; raises OutputError when it is damaged."""
    path = folder / HARD_CASES
    if not path.is_file():
        return None
    try:
        table = pd.DataFrame(json.loads(path.read_text(encoding="utf-8")))[list(_HARD_COLUMNS)]
        return table.astype({"error": float, "allowed": float})
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path), allowed="what `make accuracy` writes")) from None


def make_accuracy_report(folder: Path, report: AccuracyReport) -> None:
    """Write `accuracy.html` into the folder; errors as for `atomic.atomic`."""
    ladder = report.ladder.assign(
        run_s=report.ladder["seconds"],
        faster=(report.ladder["reference_s"] / (report.ladder["plan_s"] + report.ladder["seconds"])).map(
            "{:.3g}x".format
        ),
    )
    shown = ["scenario", "designs", "tolerance_dn", "promised_dn", "realized_dn", "plan_s", "run_s", "faster"]
    content = page(
        "accuracy.html.j2",
        title=report.name,
        question=report.question,
        lines=report.lines,
        images={name: inlined(png) for name, png in report.images.items()},
        ladder=rows(_rounded(ladder[[*shown, "work", "computed"]])),
        payments=rows(_rounded(report.payments)),
        knobs=rows(_rounded(report.knobs)),
        hard_cases=[] if report.hard_cases is None else rows(_rounded(report.hard_cases)),
    )
    write_text(content, folder / REPORT)


def _rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Numbers with three digits."""
    numbers = table.select_dtypes(float).columns
    return table.assign(**{name: table[name].map("{:.3g}".format) for name in numbers})
