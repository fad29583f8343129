"""Page of the scores of readers of a benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from ..base.answer import Answer
from ..results.atomic import atomic, write_text
from ..results.folder import run_folder
from ..results.output import Output, read_output
from ..runs.score import (
    Reader,
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
from ..runs.score_streets import is_of_streets, labels_of_test, read_detections, street_lines, street_scores
from ..vision.detections import ALL
from ..vision.scenes import NETWORK, states_of
from .hold import holds_for
from .page import page_of
from .panels import Line, Lines, Picture
from .section import Told, table_of

PAGE, TABLE, STREETS = "scores.html", "scores.parquet", "street_scores.parquet"


def score(folder: Path | str, predictions: Sequence[Path | str], *, output: Path | str | None = None) -> Answer:
    """Score readers of a benchmark's test images: errors of each CFA, differences, distance from the ideal observer.

    Parameters
    ----------
    folder : path-like
        Folder of a finished run of a study with `vision`.
    predictions : sequence of path-like
        A CSV or Parquet file for each reader: image_id, and state or a probability of each. Files with positions are
        detections in streets.
    output : path-like, optional
        Folder of ``scores.parquet`` and ``scores.html``; left out, FOLDER/scores.

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
    """Score files of predictions and the run's network, and write the scores; return lines and tables."""
    vision, tables = vision_of(output), dict[str, pd.DataFrame]()
    check_unique([path.stem for path in predictions] + ([NETWORK] if vision.network else []))
    of_streets = [path for path in predictions if vision.street is not None and is_of_streets(path)]
    predictions = [path for path in predictions if path not in of_streets]
    lines = list[str]()
    if of_streets:
        tables["streets"] = _score_streets(output, of_streets, to)
        lines += street_lines(tables["streets"])
    if not predictions:
        return [*lines, f"Files: {to}/: {STREETS}."], tables
    images = unseen_images(output)
    readers: list[Reader] = [read_predictions(path, images, states_of(vision)) for path in predictions]
    if vision.network:
        readers.append(network_of(images))
    scores = pd.concat([scores_of(reader, images, vision.unknown_cost) for reader in readers], ignore_index=True)
    with atomic(to / TABLE) as hidden:
        scores.to_parquet(hidden, index=False)
    lines += score_lines(scores)
    shown = scores.drop(columns=["design_id"]).round(4)
    lead = Told("Errors", (), picture_of(scores), table_of(summary_table(scores)))
    further = Told("By distance and light", (), None, table_of(shown, f"{TABLE} has all."))
    text = page_of(
        output.study.study,
        "How often do readers err?",
        lines,
        holds_for(output),
        lead,
        [further],
        kind="scores of readers",
        files=[TABLE],
    )
    write_text(text, to / PAGE)
    files = ", ".join([TABLE, PAGE, *([STREETS] if of_streets else [])])
    return [*lines, f"Files: {to}/: {files}."], {"images": scores, **tables}


def _score_streets(output: Output, predictions: Sequence[Path], to: Path) -> pd.DataFrame:
    vision = output.study.vision
    assert vision is not None
    labels = labels_of_test(output)
    detections_of = {path.stem: read_detections(path, labels, vision.lenses) for path in predictions}
    parts = [street_scores(name, detections, labels, vision.lenses) for name, detections in detections_of.items()]
    scores = pd.concat(parts, ignore_index=True)
    with atomic(to / STREETS) as hidden:
        scores.to_parquet(hidden, index=False)
    return scores


def summary_table(scores: pd.DataFrame) -> pd.DataFrame:
    """Return errors over all distances and light levels, lenses in any order where there are such images.

    Returns a row per reader and design: error, and difference from the first design and from the ideal observer,
    percent.
    """
    totals = whole_scores(scores)
    first = str(totals["name"].iloc[0])
    columns = {"error": "errs on / %", "apart": f"less that of {first}", "above_observer": "less the ideal observer's"}
    table = totals[["reader", "name"]].rename(columns={"name": "design"})
    for column, title in columns.items():
        ends = [totals[name].mul(100).map("{:.1f}".format) for name in (column, f"{column}_low", f"{column}_high")]
        table[title] = ends[0] + " (" + ends[1] + " to " + ends[2] + ")"
    table.loc[table["design"] == first, columns["apart"]] = "-"
    return table


def picture_of(scores: pd.DataFrame) -> Picture:
    """Return errors over distance, a panel for each reader, with bands down to the ideal observer."""
    shown = in_any_order(scores)
    by_distance = shown[(shown["level"] == ALL) & (shown["distance_m"] != ALL)]
    panels = []
    for reader, rows_of in by_distance.groupby("reader", sort=False):
        lines = {}
        for name, own in rows_of.groupby("name", sort=False):
            ordered = own.assign(x=own["distance_m"].astype(float)).sort_values("x")
            x, error, least = (ordered[key].to_numpy(dtype=float) for key in ("x", "error", "observer_error"))
            lines[str(name)] = Line(x, 100 * error, 100 * least)
        panels.append(Lines(f"{reader}: wrong / %", "distance / m", lines, height=260))
    return Picture(
        tuple(panels),
        "Errors of readers over distance.",
        "Bands go down to the ideal observer.",
        columns=min(2, len(panels)),
    )
