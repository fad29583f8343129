"""Further sections of a page: a function for each table that a run may have beside its rows; conditions and method."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ..base.types import Array, Float
from ..camera.noise.errors import few_pixels
from ..camera.scene import Scene
from ..features import gathered, modules
from ..results.facts import Origin
from ..results.manifest import Manifest
from ..results.tables import POINTS, REFERENCE, SWEPT, word_mask
from .answers import filters
from .numbers import SHARE, amount, digits, inward, joined, span
from .panels import Curves, Map, Panel, Points, Section, axis_over
from .run import Run, unit_of, words_of
from .tables import Axis, Column, Table

_PARAMETERS = {
    "left_nm": "left edge", "right_nm": "right edge", "peak_nm": "peak of the band", "fwhm_nm": "width of the band (FWHM)"
}  # fmt: skip
_FEWEST = 3
_MOST_ROWS = 12
_LEAST_DN = 1e-3
"""Smaller differences are said to be within it."""
_FASTER = 1.05
"""Less is noise of the measurement."""
Values = Float[Array, " _numbers"]
Sections = Iterator[Section]


def exactness(run: Run) -> Sections:
    """Yield the most over a swept grid of two edges."""
    yield from exactness_of(run, _map_of_grid(run))


def exactness_of(run: Run, table: pd.DataFrame | None) -> Sections:
    """Yield the most that any filter has at each pair of two parameters, from a table of these."""
    if table is None or run.hero not in run.here:
        return
    known = np.isfinite(table.to_numpy(dtype=float))
    table = table.loc[known.any(axis=1), known.any(axis=0)]
    if min(table.shape) < _FEWEST:
        return
    heights, x, y = (np.asarray(part, dtype=float) for part in (table.to_numpy(), table.columns, table.index))
    names = str(table.columns.name), str(table.index.name)
    words = [_PARAMETERS.get(name, name.replace("_", " ")) for name in names]
    best = [float(run.here[run.hero].get(name, np.nan)) for name in names]
    level, goal = run.value(run.reference, run.goal.name), run.goal
    title = f"Most {words_of(goal)} / {goal.unit}".rstrip(" /")
    mark = (best[0], best[1]) if np.isfinite(best).all() else None
    panel = Map(
        f"{title}: {words[1]} over {words[0]}", around(words[0], x), around(words[1], y), "", x, y, heights,
        None if level is None else (level, f"{run.reference} {level:.0f}"), mark,
    )  # fmt: skip
    rows = {}
    for at, (name, numbers) in enumerate(zip(words, (x, y), strict=True)):
        above = numbers[(heights > level).any(axis=at)].tolist() if level is not None else []
        rows[name] = {"best": best[at], "range": span(above, "nm") if above else "none"}
    columns = {"best": Column("best", "nm"), "range": Column(f"more than {run.reference}, of those computed")}
    yield Section(
        "How exact it must be",
        Table.of(by_column(columns, rows), head="parameter"),
        (panel,),
        "Gray: no filter meets the constraints there.",
    )


def by_column(
    columns: Mapping[str, Column], rows: Mapping[str, Mapping[str, Any]]
) -> dict[str, tuple[Column, dict[str, Any]]]:
    return {key: (column, {name: row.get(key) for name, row in rows.items()}) for key, column in columns.items()}


def _map_of_grid(run: Run) -> pd.DataFrame | None:
    """Return the most over a grid of two edges, read a part at a time."""
    grids = ((name, sweep) for name, sweep in run.study.sweeps.items() if sweep.grid)
    space = next((name for name, sweep in grids if {"left_nm", "right_nm"} <= (sweep.grid or {}).keys()), None)
    if space is None:
        return None
    parts, goal = [], run.goal.name
    for part in Manifest(run.output.folder).batches(
        ("kind", "space", "scenario", "feasible", "left_nm", "right_nm", goal)
    ):
        own = word_mask(part, "kind", SWEPT) & word_mask(part, "space", space) & word_mask(part, "scenario", run.scene)
        rows = part.filter(own).to_pandas()
        parts.append(rows[goal].where(rows["feasible"]).groupby([rows["right_nm"], rows["left_nm"]]).max())
    table: pd.DataFrame = pd.concat(parts).groupby(level=[0, 1]).max().unstack()
    return table


def around(words: str, numbers: Values) -> Axis:
    """Return an axis over cells around numbers."""
    half = (numbers[-1] - numbers[0]) / max(1, len(numbers) - 1) / 2
    return Axis(words, "nm", float(numbers[0] - half), float(numbers[-1] + half))


def clouds(run: Run) -> Sections:
    """Yield digital numbers of all lamps in two channels of the CFAs that the study names."""
    panels = list[Panel]()
    for cfa, (x, y) in run.study.clouds.items():
        plain = [name for name, row in run.here.items() if row["kind"] == REFERENCE and name == cfa]
        name = run.hero if run.hero in run.here and run.here[run.hero]["cfa"] == cfa else next(iter(plain), "")
        points = run.output.tables[POINTS]
        own = points[points["design_id"] == run.here[name]["design_id"]] if name else points[:0]
        if not len(own):
            continue
        read = own.pivot_table(
            index=["signal_type", "signal"], columns="channel", values="dn", sort=False, observed=True
        )
        groups = {
            str(kind): (of[x].to_numpy(dtype=float), of[y].to_numpy(dtype=float))
            for kind, of in read.groupby(level="signal_type", sort=False, observed=True)
        }
        axes = [axis_over(channel, "DN", read[channel], log=False) for channel in (x, y)]
        panels.append(Points(f"{name}: {y} over {x} / DN", axes[0], axes[1], groups=groups))
    if panels:
        yield Section("What the pixels read", None, tuple(panels))


def sensor(run: Run) -> Sections:
    """Yield the sensor's curves over the lamps."""
    nm, curves = run.output.curves.wavelength_nm, run.output.curves.sensor
    top = Axis(high=1.1 * max(float(curve.max()) for curve in curves.values()))
    panel = Curves(
        f"Quantum efficiency of {run.facts.sensor.name}", Axis("wavelength", "nm", float(nm[0]), float(nm[-1])), top, "", nm,
        curves, run.lamps,
    )  # fmt: skip
    yield Section("Sensor and lamps", None, (panel, *(filters(run) if run.series else ())))


SECTIONS: dict[Callable[[Run], Sections], int] = {
    exactness: 10,
    clouds: 50,
    sensor: 130,
}
"""Sections of the core with their ranks: lower ones come first."""


def sections_of(run: Run) -> Sections:
    """Yield the sections of a run, those of features among them, in the order of their ranks."""
    every: dict[Callable[[Run], Sections], int] = {**SECTIONS}
    for module in modules("page"):
        every |= getattr(module, "SECTIONS", {})
    for of in sorted(every, key=lambda section: every[section]):
        yield from of(run)


Pairs = list[tuple[str, str]]
_SCENE: tuple[tuple[str, Callable[[Scene], Any], str], ...] = (
    ("f/", lambda scene: scene.optics.f_number, ""),
    ("distance", lambda scene: scene.target and scene.target.distance_m, "m"),
    ("lamp", lambda scene: scene.intensity_cd, "cd"),
    ("exposure", lambda scene: getattr(scene.exposure, "exposure_s", None), "s"),
    ("white at", lambda scene: getattr(scene.exposure, "level", None), SHARE),
    ("visibility", lambda scene: scene.visibility_m, "m"),
    ("background", lambda scene: scene.background_cd_m2 or None, "cd/m²"),
    ("pulses", lambda scene: scene.drive and scene.drive.frequency_hz, "Hz"),
    ("on for", lambda scene: scene.drive and scene.drive.duty, SHARE),
)


def named(origin: Origin) -> str:
    """Return the name of curves with whether they are modeled, or who measured those of the package."""
    _, _, source = origin.source.partition(": ")
    whose = "modeled, not measured" if origin.surrogate else source.split(",")[0] if "built-in" in origin.source else ""
    return f"{origin.name} ({whose})" if whose else origin.name


def conditions(run: Run) -> Pairs:
    """Return curves, camera, scene and constraints as pairs of words."""
    facts, scenes = run.facts, [*run.study.scenarios.values()]
    pixels = [scene.pixel_of(run.study.pixel) for scene in scenes]
    found = [
        ("sensor", named(facts.sensor)),
        ("lamps", f"{sum(map(len, run.output.curves.bundles.values()))} of {named(facts.lights)}"),
    ]
    wells = [max(one.well_e for one in pixel.read_as or (pixel,)) for pixel in pixels]
    camera = [
        span([pixel.pitch_um for pixel in pixels], "µm"),
        span(wells, "e"),
        span([pixel.bits for pixel in pixels], "bits"),
    ]
    camera += [f"{len(run.study.pixel.captures)} captures"] if run.study.pixel.captures else []
    found.append(("pixel", ", ".join(camera)))
    parts = []
    for name, of, unit in _SCENE:
        known = [value for scene in scenes if (value := of(scene)) is not None]
        parts += [f"{name} {span(known, unit)}".replace("f/ ", "f/")] if known else []
    read = {scene.target.readout for scene in scenes if scene.target is not None}
    parts += (
        [f"lamps read {joined(sorted(read))}".replace("mean", "as a mean").replace("center", "at their center")]
        if read
        else []
    )
    parts.append("with noise" if any(scene.noise for scene in scenes) else "no noise")
    found.append(("scene", ", ".join(parts)))
    read_under_noise = [(scene, pixel) for scene, pixel in zip(scenes, pixels, strict=True) if scene.noise]
    if run.study.recognition is not None and read_under_noise:
        mosaics = [run.output.mosaic(cfa) for cfa in run.study.cfas]
        summed = {few_pixels(*reading, mosaic) for reading in read_under_noise for mosaic in mosaics}
        of_some = "exact sums of few pixels, else Q(d'/2)" if False in summed else "exact sums"
        found.append(("errors", f"{of_some}; of any brightness Q(d'/2)" if True in summed else "Q(d'/2)"))
    limits = []
    for name, bound in run.output.constraints.items():
        column = run.output.columns.get(name)
        words, unit = (name, "") if column is None else (words_of(column), unit_of(column))
        limits += [f"{words} ≥ {amount(bound.min, unit, trim=True)}"] if bound.min is not None else []
        limits += [f"{words} ≤ {amount(bound.max, unit, trim=True)}"] if bound.max is not None else []
    found += [("constraints", ", ".join(limits))] if limits else []
    if facts.search is not None and run.bound is None:
        goal, proven = run.output.goal, facts.search.upper_bound_proven
        found.append(
            ("bound", "none" if proven is None else f"{words_of(goal)} {goal.format_bound(proven)} at most (proven)")
        )
    if facts.check is not None:
        most, allowed = inward(max(facts.check.largest_dn, _LEAST_DN), 2, up=True), digits(facts.check.allowed_dn)
        found.append(
            ("checked", f"finer settings differ by at most {digits(most, trim=True)} DN, of {allowed} DN allowed")
        )
    return found


def method(run: Run) -> Pairs:
    """Return what was computed, left out, checked and searched, and notes."""
    facts, search = run.facts, run.facts.search
    effects = [effect for plan in facts.plans.values() for effect in plan.effects]
    computed = list(dict.fromkeys(effect.effect for effect in effects if effect.computed))
    risk_dn = max((plan.error_bound_dn for plan in facts.plans.values()), default=0.0)
    allowed_dn = max((plan.tolerance_dn for plan in facts.plans.values()), default=0.0)
    found = [
        ("goal", f"{run.goal.name}: {run.goal.meaning}"),
        (
            "computed",
            f"{facts.filters:,} filters in {len(run.output.scenarios):,} scenes, with {joined(computed) or 'no effect but the curves'}",
        ),
        (
            "left out",
            left_out_words(
                len({one.effect for one in effects} - {*computed}), risk_dn, allowed_dn, facts.seconds_of_effects
            ),
        ),
    ]
    if facts.check is not None:
        found.append(
            (
                "reference",
                f"{facts.check.rows:,} rows once more, which took {facts.check.slower:.2g} times as long a row",
            )
        )
    found += [line for line_of in gathered("METHOD", "page").values() for line in line_of(run)]
    if search is not None:
        how = " and ".join(filter(None, (search.algorithm, search.refinement)))
        ended = "" if search.converged else ", none converged"
        found.append(
            (
                "search",
                f"{how}, {search.starts:,} starts, {search.evaluations:,} evaluations{ended}; seed {run.study.seed}",
            )
        )
        found.append(("bound", bound_words(run)))
    if run.output.counts.failed:
        found.append(("failed", f"{run.output.counts.failed:,} rows, with their status in results.parquet"))
    return [*found, *(("note", warning) for warning in facts.warnings[:4])]


def left_out_words(count: int, risk_dn: float, allowed_dn: float, seconds: tuple[float, float] | None) -> str:
    """Return how many effects no scene computes, the DN at risk, and the time that this saves.

    `seconds`: of all rows as planned and with every effect; None where no bound leaves an effect out.
    """
    if not risk_dn:
        return f"{count} effects that no scene has; 0 of {allowed_dn:g} DN at risk"
    text = f"{count} effects, at most {inward(risk_dn, 2, up=True):.2g} of {allowed_dn:g} DN"
    if seconds is None:
        return text
    own_s, all_s = seconds
    faster = (
        f"{all_s / own_s:.2g} times faster, {all_s - own_s:.2g} s saved" if all_s > _FASTER * own_s else "no faster"
    )
    return f"{text}, {faster}"


def bound_words(run: Run) -> str:
    """Return what the proven bound is for."""
    search = run.facts.search
    assert search is not None
    if search.no_upper_bound is not None or search.upper_bound_proven is None:
        return f"none computed ({search.no_upper_bound})"
    goal = run.output.goal
    words = f"{goal.format_bound(search.upper_bound_proven)}, proven for any filter in {search.channel} of {search.cfa}"
    words += f" in {search.scenario}" if len(run.output.scenarios) > 1 else ""
    box = " (or what the box reaches)" if search.upper_bound_of_box else ""
    words += f", between the least transmission and the curve that it replaces{box}, under the same constraints"
    words += f" but {joined(list(search.upper_bound_left_out))}" if search.upper_bound_left_out else ""
    words += ", before clipping and rounding"
    if search.gap is not None:
        words += f"; the answer is {100 * search.gap:.1f} % below it"
    return words


def table_of(frame: pd.DataFrame, head: Sequence[str], most: int = _MOST_ROWS) -> Table:
    """Return the first rows of a data frame as a table, named by some of its columns."""
    keys = [key for key in frame.columns if key not in head]
    rows = {
        " ".join(str(row[name]) for name in head): {key: row[key] for key in keys}
        for row in frame.head(most).to_dict("records")
    }
    columns = {str(key): Column(str(key).replace("_", " ")) for key in keys}
    return Table.of(by_column(columns, rows), head=", ".join(head))
