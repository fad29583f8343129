"""Page and summary lines of the cost of accuracy."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from ..base.errors import OutputError, ValidationIssue
from ..report.accuracy_figure import PRESET
from ..report.pages import inlined, page, rows
from ..results.atomic import write_text
from ..study import Study

_HARD_COLUMNS = ("case", "oracle", "error", "allowed", "why")


def read_hard_cases(folder: Path) -> pd.DataFrame | None:
    """Read the table of hard cases that the tests wrote.

    Parameters
    ----------
    folder : Path
        Folder of the table.

    Returns
    -------
    DataFrame or None
        None if there is no table.

    Raises
    ------
    OutputError
        If the table is damaged.
    """
    path = folder / "hard_cases.json"
    if not path.is_file():
        return None
    try:
        table = pd.DataFrame(json.loads(path.read_text(encoding="utf-8")))[list(_HARD_COLUMNS)]
        return table.astype({"error": float, "allowed": float})
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise OutputError(
            ValidationIssue(f"cannot be read: {error}", str(path), allowed="a file that `make accuracy` writes")
        ) from None


def summary(table: pd.DataFrame, hard: pd.DataFrame | None) -> list[str]:
    """Summarize error and time of the presets, for one design and for all of the study.

    Parameters
    ----------
    table : DataFrame
        Columns scenario, setting, value, designs, error_dn, total_s, extrapolated.
    hard : DataFrame or None
        Table of hard cases.

    Returns
    -------
    list of str
        One line per scene.
    """
    lines = []
    for scenario, presets in table[table["setting"] == PRESET].groupby("scenario", sort=False):
        parts = []
        for value, totals in presets.groupby("value", sort=False):
            few = totals.sort_values("designs").iloc[:2]
            times = " / ".join(map(_seconds, few["total_s"], few["extrapolated"]))
            parts.append(f"{value} {few['error_dn'].iloc[0]:.2g} DN, {times}")
        counts = " / ".join(f"{n:,}" for n in sorted(presets["designs"].unique())[:2])
        lines.append(f"{scenario} ({counts} designs): {'; '.join(parts)}.")
    if hard is not None:
        passed = int((hard["error"] <= hard["allowed"]).sum())
        lines.append(f"{passed} of {len(hard)} hard cases are within their allowed error.")
    return lines


def _seconds(seconds: float, extrapolated: bool) -> str:
    """Format a time with two digits."""
    text = f"{1e3 * seconds:.2g} ms" if seconds < 0.0995 else f"{float(f'{seconds:.2g}'):g} s"
    return f"about {text}" if extrapolated else text


def make_accuracy_report(
    folder: Path,
    study: Study,
    lines: Sequence[str],
    png: bytes,
    table: pd.DataFrame,
    hard: pd.DataFrame | None,
) -> None:
    """Write `accuracy.html`.

    Parameters
    ----------
    folder : Path
        Folder of the report.
    study : Study
        The measured study.
    lines : sequence of str
        Summary.
    png : bytes
        Plot of error over time.
    table : DataFrame
        Measurements, as in `summary`.
    hard : DataFrame or None
        Table of hard cases.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    content = page(
        "accuracy.html.j2",
        title=study.name,
        question=study.section.question,
        lines=lines,
        image=inlined(png),
        table=rows(_wide(table)),
        hard_cases=[] if hard is None else rows(_rounded(hard)),
    )
    write_text(content, folder / "accuracy.html")


def _wide(table: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each setting: error, time of the first and of each following design, and of each number."""
    wide = []
    for (scenario, setting, value), counts in table.groupby(["scenario", "setting", "value"], sort=False):
        of_study = counts.iloc[min(1, len(counts) - 1)]
        row = {"scenario": scenario, "setting": setting, "value": value, "error / DN": f"{of_study['error_dn']:.3g}"}
        row["first design"] = _seconds(of_study["first_s"], False)
        if len(counts) > 1:
            row["each following"] = _seconds(of_study["following_s"], False)
        for count in counts.iloc[1:].to_dict("records"):
            row[f"{count['designs']:,} designs"] = _seconds(count["total_s"], count["extrapolated"])
        wide.append(row)
    return pd.DataFrame(wide)


def _rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with numbers of three digits."""
    numbers = table.select_dtypes(float).columns
    return table.assign(**{name: table[name].map("{:.3g}".format) for name in numbers})
