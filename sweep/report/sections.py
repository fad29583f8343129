"""Further sections of a page: a function for each table that a run may have beside its rows; conditions and method."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ..base.types import Array, Float
from ..camera.noise.errors import few_pixels
from ..camera.scene import Scene
from ..results.facts import Origin
from ..results.manifest import Manifest
from ..results.tables import COUNTED as OF_TILES
from ..results.tables import REFERENCE, SWEPT, word_mask
from ..runs.uncertainty import UNCLIPPED
from .answers import LIGHTS, filters, measures
from .bands import widest_bands
from .numbers import SHARE, amount, digits, inward, joined, span
from .panels import Curves, Lines, Map, Panel, Points, Section, axis_over
from .published import comparison_with_published
from .run import COUNTED, Run, unit_of, words_of
from .tables import Axis, Column, Marks, Table

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
    """Yield the most that any filter has at each pair of two parameters."""
    table = _map_of_search(run) if run.output.map is not None else _map_of_grid(run)
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
        f"{title}: {words[1]} over {words[0]}", _around(words[0], x), _around(words[1], y), "", x, y, heights,
        None if level is None else (level, f"{run.reference} {level:.0f}"), mark,
    )  # fmt: skip
    rows = {}
    for at, (name, numbers) in enumerate(zip(words, (x, y), strict=True)):
        above = numbers[(heights > level).any(axis=at)].tolist() if level is not None else []
        rows[name] = {"best": best[at], "range": span(above, "nm") if above else "none"}
    columns = {"best": Column("best", "nm"), "range": Column(f"more than {run.reference}, of those computed")}
    yield Section(
        "How exact it must be",
        Table.of(_by_column(columns, rows), head="parameter"),
        (panel,),
        "Gray: no filter meets the constraints there.",
    )


def _by_column(
    columns: Mapping[str, Column], rows: Mapping[str, Mapping[str, Any]]
) -> dict[str, tuple[Column, dict[str, Any]]]:
    return {key: (column, {name: row.get(key) for name, row in rows.items()}) for key, column in columns.items()}


def _map_of_search(run: Run) -> pd.DataFrame | None:
    search, cells = run.study.search, run.output.map
    if cells is None or search is None or not search.map:
        return None
    x, y = (list(search.map) * 2)[:2]
    most = cells.assign(most=cells["objective"].where(cells["feasible"]))
    return most.pivot_table(index=y, columns=x, values="most", dropna=False)


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


def _around(words: str, numbers: Values) -> Axis:
    """Return an axis over cells around numbers."""
    half = (numbers[-1] - numbers[0]) / max(1, len(numbers) - 1) / 2
    return Axis(words, "nm", float(numbers[0] - half), float(numbers[-1] + half))


def bands(run: Run) -> Sections:
    """Yield the widest absorption band of a map that has as much as each other design."""
    rows = widest_bands(run.output, run.values(run.goal.name))
    columns = {
        "wanted": Column(words_of(run.goal), unit_of(run.goal)),
        "fwhm_nm": Column("widest band, FWHM", "nm", promise=True), "peak_nm": Column("peak", "nm"),
        "absorbance": Column("absorbance"), "mol_per_l": Column("concentration", "mol/l"),
        "percent_by_weight": Column("by weight", "%"),
    }  # fmt: skip
    if rows:
        table = Table.of(_by_column(columns, rows), reference="", hero=run.hero, head="as much as")
        yield Section(
            "The weakest band that is enough", table, note="Between cells of the map; decadic, in a film of 0.8 µm."
        )


def norms(run: Run) -> Sections:
    """Yield every pair of a yellow and a red LED that a norm allows."""
    regions, population = run.output.regions, run.study.population
    if regions is None or population is None:
        return
    wanted = population.wanted_dn
    for norm, of in regions.groupby("norm", sort=False):
        rows = {
            run.names[number]: {
                "share": float(cells["separated"].sum() / cells["pairs"].sum()),
                "below": float(cells["below_rggb"].sum() / cells["pairs"].sum()),
                "any": float(cells["chromatic_below_rggb"].sum() / cells["pairs"].sum()),
                "least": float(cells["least_dn"].min()),
            }
            for number, cells in ((int(key), cells) for key, cells in of.groupby("design_id", sort=False))  # type: ignore[arg-type]
            if number in run.names
        }
        columns = {
            "share": Column(f"pairs with {wanted:g} DN" if wanted else "pairs", SHARE, "more"),
            "least": Column("least", "DN", "more"),
            "below": Column(f"below {run.reference}", SHARE),
            "any": Column(f"below {run.reference}, any brightness", SHARE),
        }
        panels = []
        for name in dict.fromkeys((run.hero, run.reference)):
            part = of[of["design_id"] == run.here[name]["design_id"]] if name in run.here else of[:0]
            if len(part):
                table = part.pivot_table(index="yellow_nm", columns="red_nm", values="least_dn", aggfunc="min")
                x, y = table.columns.to_numpy(dtype=float), table.index.to_numpy(dtype=float)
                level = (float(wanted), f"{wanted:g} DN") if wanted else None
                panels.append(Map(
                    f"{name}: least separation / DN", _around("peak of the red LED", x), _around("peak of the yellow LED", y),
                    "", x, y, table.to_numpy(dtype=float), level, most=float(of["least_dn"].max()),
                ))  # fmt: skip
        table = Table.of(_by_column(columns, rows), reference=run.reference, hero=run.hero)
        title = f"Lamps that {str(norm).replace('_', ' ').upper()} allows"
        yield Section(title, table, tuple(panels), "Single LEDs, modeled; all pairs counted equally.")


def deep_reds(run: Run) -> Sections:
    """Yield from which red on designs fall below the reference."""
    limits = run.output.lamp_limits
    if limits is None:
        return
    rows: dict[str, dict[str, Any]] = {}
    known = limits[limits["design_id"].isin([*run.names]) & np.isfinite(limits["red_limit_nm"])]
    for number, of in known.groupby("design_id", sort=False):
        row = rows.setdefault(run.names[int(number)], {})
        for quantity, part in of.groupby("quantity", sort=False):
            key = "any" if str(quantity).startswith("chromatic") else "equal"
            peaks = float(part["red_limit_nm"].min()), float(part["red_limit_nm"].max())
            row[key] = Marks([peaks], (), span(peaks, "nm"))
        deepest = of[~of["quantity"].str.startswith("chromatic")].dropna(subset=["deepest_ratio"])
        if len(deepest):
            row["deepest"] = span(deepest["deepest_ratio"].tolist())
            row["at"] = float(deepest["deepest_nm"].iloc[0])
    ends = [end for row in rows.values() for key in ("any", "equal") if key in row for end in row[key].spans[0]]
    if rows:
        axis = Axis("", "nm", min(ends) - 2, max(ends) + 2)
        group = f"peak of the red LED from which it is below {run.reference}, by the LED's shape"
        columns = {
            "equal": Column("equal brightness", axis=axis, group=group), "any": Column("any brightness", axis=axis, group=group),
            "deepest": Column(f"times {run.reference} at the deepest red"), "at": Column("deepest red", "nm"),
        }  # fmt: skip
        yield Section("Deeper reds", Table.of(_by_column(columns, rows), hero=run.hero))


def clouds(run: Run) -> Sections:
    """Yield digital numbers of all lamps in two channels of the CFAs that the study names."""
    panels = list[Panel]()
    for cfa, (x, y) in run.study.clouds.items():
        plain = [name for name, row in run.here.items() if row["kind"] == REFERENCE and name == cfa]
        name = run.hero if run.hero in run.here and run.here[run.hero]["cfa"] == cfa else next(iter(plain), "")
        points = run.output.points
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


def tasks(run: Run) -> Sections:
    """Yield the measures of other tasks."""
    if run.study.tasks is not None and (table := measures(run)).rows:
        yield Section(f"Other tasks, times as good as {run.reference}", table)


def colors(run: Run) -> Sections:
    """Yield color error against noise under two lights."""
    traded, panels = run.output.error_against_noise, []
    if traded is None:
        return
    for light, of in list(traded[traded["scenario"] == run.output.scenarios[0]].groupby("light", sort=False))[:2]:
        lines = {
            str(name): (curve["snr"].to_numpy(dtype=float), curve["delta_e_mean"].to_numpy(dtype=float))
            for name, curve in ((name, part.sort_values("snr")) for name, part in of.groupby("name", sort=False))
        }
        x, y = (np.concatenate([line[at] for line in lines.values()]) for at in (0, 1))
        across, up = axis_over("SNR of 18 % gray", "", x, log=True), axis_over("", "", y, log=True)
        title = f"Mean color error ΔE00, {LIGHTS.get(str(light).upper(), light)}"
        panels.append(Lines(title, across, up, run.hero, lines=lines))
    yield Section(
        "Color against noise",
        None,
        tuple(panels),
        "Better is down and to the right: a stronger color matrix multiplies noise.",
    )


def uncertain(run: Run) -> Sections:
    """Yield quantiles over random sensors."""
    known = run.output.uncertainty
    if known is None or UNCLIPPED in run.facts.warnings:
        return
    of = known[(known["quantity"] == run.goal.name) & (known["scenario"] == run.scene)]
    axis = axis_over("", unit_of(run.goal), [*of["dn_5"], *of["dn_95"]], log=False)
    rows = {}
    for row in of.to_dict("records"):
        ends = float(row["dn_5"]), float(row["dn_95"])
        ratio = span([row["ratio_5"], row["ratio_95"]]) if row["name"] != run.reference else ""
        rows[str(row["name"])] = {
            "track": Marks([ends], (), span(ends, unit_of(run.goal))),
            "ratio": ratio,
            "least": ends[0],
        }
    columns = {
        "track": Column(f"{words_of(run.goal)}, 5 to 95 % of random sensors", axis=axis),
        "ratio": Column(f"times {run.reference} of the same sensor"),
        "least": Column("95 % have", unit_of(run.goal), "more", promise=True),
    }
    if rows:
        table = Table.of(_by_column(columns, rows), reference=run.reference, hero=run.hero)
        yield Section("If the sensor's curves are uncertain", table, note="Before clipping and rounding.")


def yields(run: Run) -> Sections:
    """Yield what a share of other random lamps and cameras has."""
    known = run.output.yields
    if known is None:
        return
    of = known[known["scenario"] == run.scene]
    for name, part in of.groupby("quantity", sort=False):
        column, share = run.output.columns[str(name)], float(part["share"].iloc[0])
        axis = axis_over("", unit_of(column), [*part["dn_low"], *part["dn_high"]], log=False)
        rows = {
            str(row["name"]): {
                "track": Marks(
                    [(row["dn_low"], row["dn_high"])], (), span((row["dn_low"], row["dn_high"]), unit_of(column))
                ),
                "dn": float(row["dn"]),
            }
            for row in part.to_dict("records")
        }
        what = f"{100 * share:.10g} % of {int(part['draws'].iloc[0]):,} other draws have"
        columns = {
            "dn": Column(what, unit_of(column), "more", promise=True),
            "track": Column("95 % interval of that", axis=axis),
        }
        table = Table.of(_by_column(columns, rows), reference=run.reference, hero=run.hero)
        yield Section(f"On other random draws: {words_of(column)}", table, note="Before clipping and rounding.")


def left_out(run: Run) -> Sections:
    """Yield the largest falls of the objective where a lamp was left out of the search."""
    of = run.output.left_out
    if of is None:
        return
    worst = of.sort_values("fall", ascending=False).head(6)
    rows = {
        str(row["signal"]): {"kept": row["objective"] - row["fall"], "fall": row["fall"]}
        for row in worst.to_dict("records")
    }
    unit = unit_of(run.output.goal)
    columns = {"kept": Column("with that lamp again", unit), "fall": Column("less than with it in the search", unit)}
    yield Section(
        "Searched without one lamp",
        Table.of(_by_column(columns, rows), head="lamp"),
        note=f"Mean of all {len(of)}: {amount(float(of['fall'].mean()), unit)} less; leave_one_out.parquet has each.",
    )


def tiles(run: Run) -> Sections:
    """Yield the best tile of each level of light, and what none exceeds."""
    of, search = run.output.tiles, run.facts.search
    if of is None or search is None or not search.tiles:
        return
    unit, rows = unit_of(run.output.goal), {}
    for level, part in of.groupby(of["cfa_sensitivity_min"].fillna(-1.0), sort=True):
        best = part[part["best"]]
        if len(best):
            row = best.iloc[0]
            edges = [float(row.get(name, np.nan)) for name in ("left_nm", "right_nm")]
            rows["the study's" if level < 0 else f"{amount(float(level), SHARE, trim=True)} of the light"] = {
                "tile": f"{row['cfa']}, N of {row['base']}", "light": row["cfa_sensitivity"], "found": row["objective"],
                "proven": part["upper_bound"].max(), "edges": " and ".join(f"{e:.0f}" for e in edges if np.isfinite(e)),
                **{name: row[name] for name in OF_TILES if name in row},
            }  # fmt: skip
    columns = {
        "tile": Column("tile"), "light": Column("light", SHARE), "edges": Column("edges / nm"), "found": Column("best found", unit),
        "proven": Column("no tile exceeds (proven)", unit),
        **{name: Column(words, "DN", group="as it is read out") for name, words in zip(OF_TILES, COUNTED.values(), strict=True)},
    }  # fmt: skip
    counts = joined([f"{count} {status}" for status, count in search.tiles.items() if count])
    yield Section("Over all tiles", Table.of(_by_column(columns, rows), head="at least"), note=f"Tiles: {counts}.")


def published(run: Run) -> Sections:
    """Yield printed figures beside those of the run."""
    of = comparison_with_published(run.output)
    for table, part in of.groupby("table", sort=False):
        rows = {
            f"{row['cfa']} {row['quantity']}": {"paper": row["paper"], "ours": row["ours"], "error": row["error"]}
            for row in part.to_dict("records")
        }
        columns = {"paper": Column("published"), "ours": Column("this run"), "error": Column("difference")}
        shown = dict(list(rows.items())[:_MOST_ROWS])
        more = len(rows) - len(shown)
        note = f"{more} more in paper_comparison.csv." if more else ""
        yield Section(f"Published: {table}", Table.of(_by_column(columns, shown), head="figure"), note=note)


def sensor(run: Run) -> Sections:
    """Yield the sensor's curves over the lamps."""
    nm, curves = run.output.curves.wavelength_nm, run.output.curves.sensor
    top = Axis(high=1.1 * max(float(curve.max()) for curve in curves.values()))
    panel = Curves(
        f"Quantum efficiency of {run.facts.sensor.name}", Axis("wavelength", "nm", float(nm[0]), float(nm[-1])), top, "", nm,
        curves, run.lamps,
    )  # fmt: skip
    yield Section("Sensor and lamps", None, (panel, *(filters(run) if run.series else ())))


SECTIONS: tuple[Callable[[Run], Sections], ...] = (
    *(exactness, bands, norms, deep_reds, clouds, tasks, colors, uncertain, yields, tiles, left_out, published, sensor),
)
"""In the order of a page."""
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
    if run.output.audited is not None:
        found.append(("audited", f"all scenes: at most {digits(float(run.output.audited['realized_dn'].max()))} DN"))
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
    return Table.of(_by_column(columns, rows), head=", ".join(head))
