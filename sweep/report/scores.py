"""Page of the scores of readers of a benchmark."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from ..base.answer import Answer
from ..base.errors import DataError, ValidationIssue
from ..results.atomic import atomic, write_text
from ..results.folder import run_folder
from ..results.output import Output, read_output
from ..runs.read_detections import is_of_streets, read_detections, reader_name
from ..runs.score import (
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
from ..runs.score_streets import (
    found_sentence,
    labels_of_test,
    of_all_targets,
    shape_of,
    street_lines,
    street_scores,
    vision_with_streets,
)
from ..vision.boxes import categories_of
from ..vision.detections import ALL, FALSE_PER_IMAGE
from ..vision.scenes import SHUFFLED, states_of
from .hold import holds_for
from .leaders import answering, label
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
        For each reader a CSV or Parquet file: image_id, and state or a probability of each. Detections in streets are
        results of COCO (.json), a folder of these or of YOLO's text files, or a table with x_px, y_px, state and score.
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
    vision, tables = vision_of(output), dict[str, pd.DataFrame]()
    own = [
        network_of(images, name) for images in [unseen_images(output)] for name in LEARNED if images[name].notna().any()
    ]
    check_unique([*map(reader_name, predictions), *(reader.name for reader in own)])
    of_streets = [path for path in predictions if is_of_streets(path)]
    if of_streets:
        vision_with_streets(output)
    lines, sections = list[str](), list[Told]()
    if of_streets:
        tables["streets"] = _score_streets(output, of_streets)
        lines += street_lines(tables["streets"])
        sections += _of_streets(output, tables["streets"])
    if len(of_streets) < len(predictions):
        images = unseen_images(output)
        readers = [read_predictions(path, images, states_of(vision)) for path in predictions if path not in of_streets]
        parts = [scores_of(reader, images, vision.unknown_cost) for reader in [*readers, *own]]
        tables["images"] = pd.concat(parts, ignore_index=True)
        lines += score_lines(tables["images"])
        sections += _of_images(tables["images"])
    files = {"streets": STREETS, "images": TABLE}
    for name, scores in tables.items():
        with atomic(to / files[name]) as hidden:
            scores.to_parquet(hidden, index=False)
    lead, *further = sections
    text = page_of(
        output.study.study,
        "Which CFA does a detector read best?" if of_streets else "How often do readers err?",
        lead.answer,
        holds_for(output),
        replace(lead, sentences=()),
        further,
        kind="scores of readers",
        limits=[*(line for name in tables for line in _LIMITS[name]), _CHOSEN],
        files=[files[name] for name in tables],
    )
    write_text(text, to / PAGE)
    return [*lines, f"Files: {to}/: {', '.join([*(files[name] for name in tables), PAGE])}."], tables


_LIMITS = {
    "streets": (
        "Streets: lenses stand in the street's order; images of the test, of lamps that training does not show. Each "
        "seed is scored apart; figures are means over the seeds. Intervals of 95 % are from draws of the scenes of "
        "each light level, the same for all designs: for these lamps and this detector as it was trained.",
        "A box is found that overlaps one of its state by 0.5 (AP50) or by 0.5 to 0.95 (AP); a point within a lens's "
        "diameter. A false box counts at the distance whose boxes are nearest in size, a false point at all, and both "
        "at all intensities.",
    ),
    "images": ("Heads: lamps that training does not show. Intervals are Student's t over the seeds.",),
}
_CHOSEN = (
    "The design named beside the first is the run's answer, or without an answer the best one of these images, which "
    "chance favors; of heads it is always the latter."
)


def _score_streets(output: Output, predictions: Sequence[Path]) -> pd.DataFrame:
    vision, labels = vision_with_streets(output), labels_of_test(output)
    parts = []
    for path in predictions:
        found = read_detections(path, labels, categories_of(vision), lambda cfa: shape_of(output, cfa))
        if found.empty:
            raise DataError(ValidationIssue("no detections", str(path)))
        parts.append(street_scores(output, reader_name(path), found, labels))
    return pd.concat(parts, ignore_index=True)


def _of_streets(output: Output, scores: pd.DataFrame) -> Iterator[Told]:
    """Yield a section for each detector and kind of box: what is found, over distance."""
    lenses, best = vision_with_streets(output).lenses, answering(output)
    lens = "red" if "red" in lenses else lenses[0]
    for (reader, kind), rows in scores.groupby(["reader", "kind"], sort=False):
        totals = of_all_targets(rows)
        names = list(totals["name"])
        hero = "" if best is None else label(best)
        if hero not in names[1:]:
            hero = str(totals["name"].iloc[int(totals["ap50"].to_numpy().argmax())])
        at = rows[(rows["state"] == lens) & (rows["distance_m"] != ALL)]
        lines = {
            str(name): Line(own["distance_m"].to_numpy(dtype=float), 100 * own["found"].to_numpy(dtype=float))
            for name, own in at.groupby("name", sort=False)
        }
        title = f"{reader}: {lens} {kind}s found / %"
        picture = Picture(
            (Lines(title, "distance / m", lines, hero, height=260),),
            f"Share of {lens} {kind}s that {reader} finds over distance.",
            f"Mean over {FALSE_PER_IMAGE[0]:g} to {FALSE_PER_IMAGE[1]:g} false boxes an image; all light levels.",
        )
        told = totals[["name", "targets"]].copy()
        columns = {
            "found": "found / %",
            "ap50": "AP50 / %",
            "ap": "AP / %",
            "ap50_apart": f"AP50 less that of {names[0]}",
        }
        for column, head in columns.items():
            if column in totals and totals[column].notna().any():
                told[head] = _percents(totals, column)
        told.loc[told["name"] == names[0], f"AP50 less that of {names[0]}"] = "-"
        words = f"{reader}: {kind}s"
        yield Told(
            words,
            (found_sentence(rows, lens, hero),),
            picture,
            table_of(told, f"{STREETS} has states, distances, levels and intensities."),
        )


def _of_images(scores: pd.DataFrame) -> Iterator[Told]:
    """Yield how often readers err, and that by distance and light."""
    totals = whole_scores(scores)
    order = "in any order" if totals["order"].iloc[0] == SHUFFLED else "in the street's order"
    first, *others = (row for row in totals.to_dict("records") if row["reader"] == totals["reader"].iloc[0])
    text = f"{first['reader']} errs on {100 * first['error']:.1f} % of {first['images']:,} images with {first['name']}"
    if others:
        least = min(others, key=lambda row: float(row["error"]))
        ends = [f"{100 * least[f'apart{end}']:+.1f}" for end in ("", "_low", "_high")]
        text += f", and least of the others on {100 * least['error']:.1f} % with {least['name']}"
        text += f": {ends[0]} ({ends[1]} to {ends[2]})"
    text += f"; heads with lenses {order}, all distances and light levels."
    yield Told("Errors", (text,), picture_of(scores), table_of(summary_table(scores)))
    shown = scores.drop(columns=["design_id"]).round(4)
    yield Told("By distance and light", (), None, table_of(shown, f"{TABLE} has all."))


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
        table[title] = _percents(totals, column)
    table.loc[table["design"] == first, columns["apart"]] = "-"
    return table


def _percents(scores: pd.DataFrame, column: str) -> pd.Series[str]:
    """Return a share with its interval, in percent, without the sign."""
    value, low, high = (scores[f"{column}{end}"].mul(100).map("{:.1f}".format) for end in ("", "_low", "_high"))
    return value + " (" + low + " to " + high + ")"


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
