"""Page of the scores of readers of a benchmark."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ...base.answer import Answer
from ...base.errors import DataError, ValidationIssue
from ...report.numbers import NARROW, SHARE
from ...report.page import Report
from ...report.panels import INK, Lines, Section, axis_over
from ...report.run import Run
from ...report.sections import conditions
from ...report.tables import Axis, Column, Marks, Table
from ...results.atomic import atomic, write_text
from ...results.folder import run_folder
from ...results.output import Output, read_output
from .boxes import categories_of
from .read_detections import is_of_streets, read_detections, reader_name
from .scenes import ALL, SHUFFLED, states_of
from .score import (
    LEARNED,
    check_unique,
    in_any_order,
    network_of,
    read_predictions,
    score_lines,
    scores_of,
    unseen_images,
    vision_of,
    whole_scores,
)
from .score_streets import (
    labels_of_test,
    of_all_targets,
    require_pycocotools,
    shape_of,
    street_lines,
    street_scores,
    vision_with_streets,
)

PAGE, TABLE, STREETS = "scores.html", "scores.parquet", "street_scores.parquet"


def score(folder: Path | str, predictions: Sequence[Path | str], *, output: Path | str | None = None) -> Answer:
    """Score readers of a benchmark's test images: errors of each CFA, differences, distance from the ideal observer.

    Parameters
    ----------
    folder : path-like
        Folder of a finished run of a study with `vision`.
    predictions : sequence of path-like
        For each reader a CSV or Parquet file: image_id, and state or a probability of each. Detections in streets are
        results of COCO (.json), or a folder of these.
    output : path-like, optional
        Folder of ``scores.parquet`` (heads), ``street_scores.parquet`` and ``scores.html``; left out, FOLDER/scores.

    Returns
    -------
    Answer
        The scores; ``facts`` has them as records.

    Raises
    ------
    SweepError
        If the run has no images, or the predictions are not of them.
    """
    folder = run_folder(folder)
    run, to = read_output(folder), folder / "scores" if output is None else Path(output)
    lines, tables = _score_readers(run, [Path(path) for path in predictions], to)
    return Answer(lines, {"folder": str(to)} | {name: table.to_dict("records") for name, table in tables.items()})


def _score_readers(output: Output, predictions: Sequence[Path], to: Path) -> tuple[list[str], dict[str, pd.DataFrame]]:
    """Score files of predictions and the run's readers, and write tables and page; return lines and tables."""
    vision, tables, run = vision_of(output), dict[str, pd.DataFrame](), Run(output)
    unseen = unseen_images(output)
    own = [network_of(unseen, name) for name in LEARNED if unseen[name].notna().any()]
    check_unique([*map(reader_name, predictions), *(reader.name for reader in own)])
    of_streets = [path for path in predictions if is_of_streets(path)]
    lines, sections = list[str](), list[Section]()
    if of_streets:
        require_pycocotools()
        vision_with_streets(output)
        tables["streets"] = _score_streets(output, of_streets)
        lines += street_lines(tables["streets"])
        sections += _of_streets(run, tables["streets"])
    if len(of_streets) < len(predictions):
        readers = [read_predictions(path, unseen, states_of(vision)) for path in predictions if path not in of_streets]
        parts = [scores_of(reader, unseen, vision.unknown_cost) for reader in [*readers, *own]]
        tables["images"] = pd.concat(parts, ignore_index=True)
        lines += score_lines(tables["images"])
        sections += _of_images(tables["images"])
    files = {"streets": STREETS, "images": TABLE}
    for name, scores in tables.items():
        with atomic(to / files[name]) as hidden:
            scores.to_parquet(hidden, index=False)
    written = [files[name] for name in tables]
    told = [("note", words) for name in tables for words in _LIMITS[name]]
    title = "Which CFA does a detector read best?" if of_streets else "How often do readers err?"
    lead, *further = sections
    report = Report(output.study.study, title, lines[0], lead, further, conditions(run), told, written)
    write_text(report.html(), to / PAGE)
    return [*lines, f"Files: {to}/: {', '.join([*written, PAGE])}."], tables


_LIMITS = {
    "streets": (
        "Lenses stand in the street's order; images of the test, of lamps that training does not show. Means over the seeds, each scored apart.",
        "95 % intervals are from draws of the scenes of each light level, the same for all designs: for these lamps and this detector as it was trained.",
        "Average precision is that of pycocotools. A distance is a range of areas: boxes count where their size is nearest.",
    ),
    "images": ("Lamps that training does not show. 95 % intervals are Student's t over the seeds.",),
}


def _score_streets(output: Output, predictions: Sequence[Path]) -> pd.DataFrame:
    vision, labels = vision_with_streets(output), labels_of_test(output)
    parts = []
    for path in predictions:
        found = read_detections(path, labels, categories_of(vision), lambda cfa: shape_of(output, cfa))
        if found.empty:
            raise DataError(ValidationIssue("no detections", str(path)))
        parts.append(street_scores(output, reader_name(path), found, labels))
    return pd.concat(parts, ignore_index=True)


def _of_streets(run: Run, scores: pd.DataFrame) -> Iterator[Section]:
    """Yield a section for each detector and kind of box: average precision, and what is found over distance."""
    lenses = vision_with_streets(run.output).lenses
    lens = "red" if "red" in lenses else lenses[0]
    for (reader, kind), rows in scores.groupby(["reader", "kind"], sort=False):
        totals = of_all_targets(rows).set_index("name")
        names = [str(name) for name in totals.index]
        hero = run.hero if run.hero in names[1:] else str(totals["ap50"].idxmax())
        at = rows[(rows["state"] == lens) & (rows["distance_m"] != ALL)]
        title = f"{reader!s}: average precision of {lens} {kind!s}s"
        panel = _over_distance(title, at.assign(share=at["ap50"]), hero)
        columns = _columns(
            totals,
            {"ap50": "AP50", "ap50_apart": f"AP50 less that of {names[0]}"},
            "more",
        )
        for key, label in (("ap", "AP"), ("recall", "AR")):
            columns[key] = Column(label, "", "more"), dict(zip(names, totals[key].tolist(), strict=True))
        columns["targets"] = (
            Column("targets"),
            {name: f"{int(count):,}" for name, count in zip(names, totals["targets"], strict=True)},
        )
        note = f"AP50: overlaps of 0.5; AP, AR: mean over 0.5 to 0.95. {STREETS} has all parts."
        yield Section(f"{reader!s}: {kind!s}s", Table.of(columns, reference=names[0], hero=hero), (panel,), note)


def _of_images(scores: pd.DataFrame) -> Iterator[Section]:
    """Yield how often each reader errs, over all distances and light levels and over distance."""
    shown = in_any_order(scores)
    by_distance = shown[(shown["level"] == ALL) & (shown["distance_m"] != ALL)]
    for reader, of in whole_scores(scores).groupby("reader", sort=False):
        totals = of.set_index("name")
        names = [str(name) for name in totals.index]
        hero = str(totals["error"].idxmin())
        parts = {"error": "wrong", "apart": f"less that of {names[0]}", "above_observer": "less the ideal observer's"}
        own = by_distance[by_distance["reader"] == reader]
        panel = _over_distance(f"{reader!s}: wrong", own.assign(share=own["error"], floor=own["observer_error"]), hero)
        table = Table.of(_columns(totals, parts, "less"), reference=names[0], hero=hero)
        order = "in any order" if totals["order"].iloc[0] == SHUFFLED else "in the street's order"
        yield Section(
            f"{reader!s}: heads",
            table,
            (panel,),
            f"Lenses {order}. Bands go down to the ideal observer. {TABLE} has all parts.",
        )


def _columns(totals: pd.DataFrame, parts: Mapping[str, str], better: str) -> dict[str, tuple[Column, dict[str, Any]]]:
    """Return shares with their intervals as tracks with words, for each design."""
    found: dict[str, tuple[Column, dict[str, Any]]] = {}
    for key, label in parts.items():
        if key not in totals or totals[key].isna().all():
            continue
        ends = totals[[f"{key}_low", f"{key}_high"]].to_numpy(dtype=float)
        axis = Axis(
            "",
            SHARE,
            min(0.0, float(np.nanmin(ends))),
            max(1e-3, float(np.nanmax(ends))),
            level=0.0 if "less" in label else None,
        )
        cells = {}
        for (name, row), (low, high) in zip(totals.iterrows(), ends, strict=True):
            text = (
                f"{100 * row[key]:.1f}"
                + (f" ({100 * low:.1f} to {100 * high:.1f})" if high > low else "")
                + f"{NARROW}%"
            )
            is_first = "less that" in label and name == totals.index[0]
            cells[str(name)] = None if is_first else Marks([(low, high)], [(float(row[key]), INK)], text)
        found[key] = Column(label, "", better, axis=axis), cells
    return found


def _over_distance(title: str, rows: pd.DataFrame, hero: str) -> Lines:
    """Return a share over distance for each design, with bands down to a floor."""
    lines, floors = {}, {}
    for name, own in rows.assign(x=rows["distance_m"].astype(float)).sort_values("x").groupby("name", sort=False):
        lines[str(name)] = own["x"].to_numpy(dtype=float), own["share"].to_numpy(dtype=float)
        if "floor" in own:
            floors[str(name)] = own["floor"].to_numpy(dtype=float)
    across = axis_over("distance", "m", rows["distance_m"].astype(float), zero=False, log=False)
    up = axis_over("", SHARE, rows["share"].astype(float), log=False)
    return Lines(f"{title} / %", across, up, hero, lines=lines, floors=floors)
