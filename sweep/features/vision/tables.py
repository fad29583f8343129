"""Benchmark of vision: every plain CFA, named design and answer before the same images."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ...base.types import ChannelCurves, DesignParameters, delayed
from ...camera.model import SceneModel
from ...camera.setup import Setup
from ...metrics.columns.confusion import D_PRIME, STATE_ERROR
from ...metrics.evaluate import evaluate
from ...metrics.separation import csd_name
from ...results.designs import named_rows, row_curves
from ...results.tables import SEARCHED
from ...runs.analysis import RunTable, Shown
from ...runs.workers import run_with_progress
from ...spectra.lights import class_pairs, pair_name
from ...study import Study
from . import VISION, VISION_CONDITIONS, VISION_LEARNING
from .images import setup_at
from .keys import Vision
from .readers import OBSERVER, Answers, SeedReading, read_images
from .scenes import ORDERS, PROTOTYPES, SEEN, SHUFFLED, UNSEEN, states_of

if TYPE_CHECKING:
    import pandas as pd

_TEXT, _NUMBER, _COUNT = pa.string(), pa.float64(), pa.int64()
_DESIGN = [("design_id", _COUNT), ("name", _TEXT), ("cfa", _TEXT)]
_READERS = (OBSERVER, PROTOTYPES)
_IMAGES = pa.schema(
    [
        *_DESIGN,
        *(("seed", _COUNT), ("order", _TEXT), ("lamps", _TEXT), ("image", _COUNT), ("state", _TEXT), ("lamp", _TEXT)),
        *(("intensity_cd", _NUMBER), ("background", _TEXT), ("phantom", pa.bool_())),
        *(("distance_m", _NUMBER), ("level", _TEXT)),
        *(
            (f"{reader}{end}", kind)
            for reader in _READERS
            for end, kind in (("", _TEXT), ("_p", _NUMBER), ("_risk", _NUMBER))
        ),
    ]
)
_CONDITIONS = pa.schema(
    [*_DESIGN, ("distance_m", _NUMBER), ("level", _TEXT)]
    + [(name, _NUMBER) for name in ("csd", "dprime", "pair_error")]
)
_LEARNING = pa.schema(
    [
        *_DESIGN,
        *(("seed", _COUNT), ("reader", _TEXT), ("images", _COUNT), ("distance_m", _NUMBER), ("level", _TEXT)),
        *(("test_images", _COUNT), ("error", _NUMBER), ("risk", _NUMBER), ("observer_risk", _NUMBER)),
    ]
)


def _tables(shown: Shown) -> dict[str, pa.Table]:
    """Compute all tables; a design in several scenarios counts once.

    Random numbers follow from the study's seed: all designs see the same scenes and photons.
    """
    study = shown.study
    vision = study.section.key("vision")
    designs, setups = [], []
    for row, setup, curves in vision_designs(study, shown.rows):
        designs.append(row)
        setups.append((setup, curves))
    pairs = [(at, seed) for seed in range(vision.seeds) for at in range(len(designs))]
    calls = [delayed(read_images, *setups[at], vision, (study.section.seed, seed)) for at, seed in pairs]
    images: list[dict[str, Any]] = []
    learning: list[dict[str, Any]] = []
    readings = run_with_progress(shown.kept("vision"), calls, "images read (designs x seeds)", shown.progress)
    for (at, seed), reading in zip(pairs, readings, strict=True):
        design = {name: designs[at][name] for name, _ in _DESIGN}
        images += _image_rows(study, vision, design | {"seed": seed}, reading)
        learning += _learning_rows(design | {"seed": seed}, vision, reading)
    conditions: list[dict[str, Any]] = []
    known = shown.parallel([delayed(predictors, *setup, vision) for setup in setups])
    for row, figures in zip(designs, known, strict=True):
        for condition, values in zip(product(vision.distances_m, vision.levels), figures, strict=True):
            conditions.append(
                dict(zip(_CONDITIONS.names, (*(row[n] for n, _ in _DESIGN), *condition, *values), strict=True))
            )
    return {
        VISION: pa.Table.from_pylist(images, schema=_IMAGES),
        VISION_CONDITIONS: pa.Table.from_pylist(conditions, schema=_CONDITIONS),
        VISION_LEARNING: pa.Table.from_pylist(learning, schema=_LEARNING),
    }


def vision_designs(study: Study, rows: pd.DataFrame) -> list[tuple[dict[Any, Any], Setup, DesignParameters]]:
    """Return the designs of a benchmark: plain CFAs, named designs and the answer, each once."""
    first, by_name = next(iter(study.scenarios)), dict[str, dict[Any, Any]]()
    for row in named_rows(rows):
        if row["scenario"] == first or row["kind"] == SEARCHED:
            by_name[row["name"]] = row
    designs = []
    for row in by_name.values():
        space, curves = row_curves(study, row)
        designs.append((row, study.setup(space, row["scenario"]), np.asarray(curves[0], dtype=float)))
    return designs


def _image_rows(study: Study, vision: Vision, key: dict[str, Any], reading: SeedReading) -> Iterator[dict[str, Any]]:
    """Yield one row per image of a design and seed."""
    for lamps, by_order in ((UNSEEN, reading.unseen), (SEEN, reading.seen)):
        for order in ORDERS:
            yield from _rows_of(study, vision, key | {"order": order, "lamps": lamps}, by_order[order])


def _rows_of(study: Study, vision: Vision, key: dict[str, Any], answers: Answers) -> Iterator[dict[str, Any]]:
    scenes, states, levels = answers.scenes, states_of(vision), list(vision.levels)
    for at in range(len(scenes)):
        row = key | {
            "image": at,
            "state": states[scenes.state[at]],
            "lamp": study.lights.names[scenes.lamp[at]] if scenes.lamp[at] >= 0 else None,
            "intensity_cd": vision.intensities_cd[scenes.intensity[at]] if scenes.lamp[at] >= 0 else None,
            "background": vision.backgrounds[scenes.background[at]],
            "phantom": bool(scenes.phantom[at]),
            "distance_m": vision.distances_m[scenes.distance[at]],
            "level": levels[scenes.level[at]],
        }
        least = answers.probabilities.get(OBSERVER)
        for name, probabilities in answers.probabilities.items():
            best = int(probabilities[at].argmax())
            row |= {name: states[best], f"{name}_p": float(probabilities[at, best])}
            row |= {} if least is None else {f"{name}_risk": float(1 - least[at, best])}
        yield row


def _learning_rows(key: dict[str, Any], vision: Vision, reading: SeedReading) -> Iterator[dict[str, Any]]:
    """Yield errors of readers of some numbers of images, at each distance and level, lenses in any order."""
    shown = reading.unseen[SHUFFLED]
    scenes, least, levels = shown.scenes, shown.probabilities[OBSERVER], list(vision.levels)
    for reader, images, said in reading.learning:
        wrong, risk = said != scenes.state, 1 - np.take_along_axis(least, said[:, None], axis=1)[:, 0]
        for distance, level in product(range(len(vision.distances_m)), range(len(levels))):
            here = (scenes.distance == distance) & (scenes.level == level)
            row = {
                "reader": reader,
                "images": images,
                "distance_m": vision.distances_m[distance],
                "level": levels[level],
            }
            row |= {
                "test_images": int(here.sum()),
                "error": float(wrong[here].mean()),
                "risk": float(risk[here].mean()),
            }
            yield key | row | {"observer_risk": float((1 - least.max(axis=1))[here].mean())}


def predictors(setup: Setup, curves: ChannelCurves, vision: Vision) -> list[tuple[float, float, float]]:
    """Return figures of a design that need no images, at each distance and, there, each level of light.

    They are the smallest CSD (DN) and d' over the pairs of lenses, and the largest pairwise error, for the study's
    middle intensity, no background, and the mean over the disc.
    """
    middle_cd = sorted(vision.intensities_cd)[len(vision.intensities_cd) // 2]
    pairs = class_pairs(tuple(kind for kind in setup.lights.classes if kind in vision.lenses))
    figures = []
    for distance_m, level in product(vision.distances_m, vision.levels.values()):
        there = setup_at(setup, vision, distance_m, level)
        there = replace(there, scene=there.scene.model_copy(update={"intensity_cd": middle_cd}))
        columns = evaluate(SceneModel(there), curves[None], vision.lenses)
        csd = min(float(columns[csd_name(pair)][0]) for pair in pairs)
        names = [pair_name(D_PRIME, order) for pair in pairs for order in (pair, pair[::-1])]
        dprime = min(float(columns[name][0]) for name in names if name in columns)
        figures.append((csd, dprime, float(columns[STATE_ERROR][0])))
    return figures


def _table(name: str) -> RunTable:
    def make(shown: Shown) -> pa.Table:
        return shown.cached("vision", lambda: _tables(shown))[name]

    return RunTable(name, lambda study: "vision" in study.features, make)


TABLES = (_table(VISION), _table(VISION_CONDITIONS), _table(VISION_LEARNING))
