"""What a page's figures hold for: curves, camera, scene and constraints, in one line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ..camera.scene import Scene, WhitePatchExposure
from ..metrics.quantity import OF_A_SHARE
from ..results.output import Output
from ..study.axes import series_of
from .leaders import Row, answering, modifications
from .series import Numbers, over_series, scene_in_words
from .terms import QE, format_constraints, response_of, technology_of
from .words import joined, number, quoted

_FULL = "full_signals"
_MOST_NAMED = 3
_PIXELS = {"R": "red", "G": "green", "B": "blue", "Y": "yellow", "Cy": "cyan", "C": "clear", "W": "clear"}
_READ = {"mean": "as the mean over the lamp's image", "center": "at the center of the lamp's image"}


def holds_for(output: Output, curves: str = "") -> str:
    """Return curves, camera, scene and constraints of a run in one sentence; `curves`: in place of the run's own."""
    under = format_constraints(output)
    parts = [
        curves or curves_in_words(output),
        _camera(output),
        scene_conditions(list(output.study.scenarios.values())),
        _varied(output),
        _filters(output),
    ]
    what = f"{'; '.join(part for part in parts if part)}{f'; with {under}' if under else ''}"
    return f"Holds for {what}.{_images(output)}{_letters(output)}"


def _images(output: Output) -> str:
    """Return camera and scene of the images of a benchmark, which are not those of the scenarios."""
    vision = output.study.vision
    if vision is None:
        return ""
    levels = ", ".join(
        f"{name} {level.illuminance_lx:g} lx and {1e6 * level.exposure_s:g} us" for name, level in vision.levels.items()
    )
    lamps = ", ".join(f"{candelas:g}" for candelas in vision.intensities_cd)
    return (
        f" Separations are of this scene; images are taken at f/{vision.optics.f_number:g} and {vision.fov_deg:g} "
        "degrees, with noise, of lenses of "
        f"{vision.diameter_m:g} m and {lamps} cd: {levels}."
    )


def _letters(output: Output) -> str:
    """Return what the letters in names of CFAs are."""
    shown = {channel for cfa in output.table["cfa"].unique() for channel in output.mosaic(str(cfa)).channels}
    bases = dict[str, dict[str, None]]()
    for entry in modifications(output):
        for channel in entry.channel if entry.cfa in output.study.cfas else ():
            bases.setdefault(channel, {})[_PIXELS.get(entry.base or "", entry.base or "one")] = None
    parts = [f"{letter} {color}" for letter, color in _PIXELS.items() if letter in shown]
    parts += [
        f"{letter} {' or '.join(colors)} with a filter"
        for letter, colors in bases.items()
        if letter in shown and letter not in _PIXELS
    ]
    return f" Pixels in names of CFAs: {', '.join(parts)}." if parts else ""


def curves_in_words(output: Output) -> str:
    facts, count = output.provenance, sum(map(len, output.curves.bundles.values()))
    relative = "" if response_of(output.curves.sensor) == QE else " (relative, taken as quantum efficiencies)"
    sensor = (
        f"surrogate curves of {facts.sensor.name} (**modeled, not measured**; further fits: study surrogates)"
        if facts.sensor.surrogate
        else f"curves of {facts.sensor.name}{relative}"
    )
    lights = (
        f"{count} surrogate lamps {facts.lights.name} (modeled; photons beside white assumed)"
        if facts.lights.surrogate
        else f"{count} lamps of {facts.lights.name}"
    )
    return f"{sensor} and {lights}"


def _camera(output: Output) -> str:
    pixel, scenes = output.study.pixel, list(output.study.scenarios.values())
    lens = _span((scene.optics.f_number for scene in scenes), "")
    read = [scene.pixel_of(pixel) for scene in scenes]
    wells = _span((max(capture.well_e for capture in of.read_as or (of,)) for of in read), "e", ",.0f")
    readings = f"{_span((of.bits for of in read), '')} bits"
    if pixel.captures:
        top_dn = pixel.saturation_e * pixel.dn_per_e + pixel.offset_dn
        several = len({capture.bits for capture in pixel.read_as}) > 1
        readings = (
            f"{len(pixel.captures)} captures{'' if several else f' of {pixel.bits} bits'} merged to {top_dn:,.0f} DN"
        )
    else:
        readings += f" (full scale {_span((of.full_scale_dn for of in read), 'DN', ',.0f')})"
    return f"f/{lens}, a pixel of {_span((of.pitch_um for of in read), 'µm')} and {wells}, {readings}"


def scene_conditions(scenes: list[Scene]) -> str:
    """Return distance, brightness, exposure and the like, over all scenes."""
    targets = [scene.target for scene in scenes if scene.target is not None]
    far = [target.distance_m for target in targets]
    parts = [f"lamps {_span(far, 'm')} away"] if far else ["lamps that fill the field"]
    parts += ["or that fill the field"] if 0 < len(far) < len(scenes) else []
    if far:
        parts.append(f"read {' or '.join(dict.fromkeys(_READ[target.readout] for target in targets))}")
    lamps = [scene.intensity_cd for scene in scenes if scene.intensity_cd is not None]
    parts.append(f"of {_span(lamps, 'cd')}" if lamps else "of equal photons")
    fixed = [s.exposure.exposure_s for s in scenes if not isinstance(s.exposure, WhitePatchExposure)]
    parts += [f"exposure {_span((1e3 * time_s for time_s in fixed), 'ms')}"] if fixed else []
    levels = [s.exposure.level for s in scenes if isinstance(s.exposure, WhitePatchExposure)]
    parts += [f"white exposed to {_span((100 * level for level in levels), '%')} of full scale"] if levels else []
    seen = [scene.visibility_m for scene in scenes if scene.visibility_m is not None]
    parts += [f"visibility {_span(seen, 'm')}"] if seen else []
    bright = [scene.background_cd_m2 for scene in scenes if scene.background_cd_m2]
    parts += [f"background {_span(bright, 'cd/m²')}"] if bright else []
    pulsed = [scene.drive for scene in scenes if scene.drive is not None]
    if pulsed:
        steady = "" if len(pulsed) == len(scenes) else "steady, and "
        parts.append(
            f"{steady}pulsed at {_span((d.frequency_hz for d in pulsed), 'Hz')}, on for "
            f"{_span((100 * d.duty for d in pulsed), '%')} of the time"
        )
    parts.append("without noise" if all(scene.noise is None for scene in scenes) else "with noise")
    return ", ".join(parts)


def _varied(output: Output) -> str:
    """Return over which lamps, production errors and curves a worst case or a share is."""
    lamps, made, curves = output.study.population, output.study.production, output.study.uncertainty
    if not output.trade_off[0].extreme:
        return ""
    parts = []
    if lamps is not None:
        bins = [value for value in lamps.binning_nm.values() if value]
        within = f", peaks within ±{_span(bins, 'nm')}" if bins else ""
        parts += [f"lamps at {_span(lamps.temperature_c, '°C')}{within}"]
    parts += [f"edges within ±{made.edge_shift_nm:g} nm"] if made.edge_shift_nm else []
    parts += [f"thickness within ±{100 * made.thickness:g} %"] if made.thickness else []
    parts += [f"bands up to {100 * made.broadening:g} % wider"] if made.broadening else []
    drawn = output.trade_off[0].extreme == OF_A_SHARE
    if drawn and curves is not None and curves.wanted_yield is not None:
        errors = {"height": f"{100 * curves.gain:g} %", "wavelength": f"{curves.shift_nm:g} nm"}
        errors |= {"shape": f"{100 * curves.noise:g} %", "IR cut": f"{curves.ir_cut_nm:g} nm"}
        known = [f"±{size} in {of}" for of, size in errors.items() if not size.startswith("0 ")]
        parts += [f"curves off by {', '.join(known)}"] if known else []
    return f"{'random draws' if drawn else 'worst cases'} over {', '.join(parts)}" if parts else ""


def _filters(output: Output) -> str:
    """Return by what the answering design works, where that is stated."""
    best: Row | None = answering(output)
    technology = None if best is None else technology_of(output, best)
    if technology is None:
        return ""
    return (
        "its filter of pigments, which does not move with the angle"
        if technology.interference is None
        else f"its filter by {technology.description}, which moves with the angle"
    )


def _span(values: Iterable[float], unit: str, form: str = "") -> str:
    """Return one value, or the least and the most."""
    known = sorted({value if form else float(f"{value:.3g}") for value in values})
    ends = [format(value, form) if form else number(value) for value in (known[0], known[-1])]
    text = ends[0] if len(known) == 1 else f"{ends[0]} to {ends[1]}"
    return f"{text}\u00a0{unit}" if unit else text


def saturation_lines(output: Output) -> Iterator[str]:
    """Yield in which scenes lamps saturate pixels, by design."""
    rows = output.named_rows.merge(output.saturated, on="design_id", how="left")
    if not (rows[_FULL] > 0).any():
        return
    total, told = int(rows["signals"].max()), set[str]()
    for (base, key), scenarios in series_of(output.study.scenarios).items():
        told |= scenarios.keys()
        numbers, ranges = Numbers(base, key, tuple(scenarios.values())), dict[str, list[str]]()
        filled = over_series(rows, scenarios, _FULL)
        for name, full in filled.items():
            if (full > 0).any():
                ranges.setdefault(numbers.where(full > 0), []).append(name)
        if ranges:
            parts = [
                f"{'every design' if len(names) == len(filled) else joined([quoted(name) for name in names])} {where}"
                for where, names in ranges.items()
            ]
            among = f" ({base})" if len(series_of(output.study.scenarios)) > 1 else ""
            yield f"Lamps saturate pixels{among}: {'; '.join(parts)}."
    others = rows[~rows["scenario"].isin(told) & (rows[_FULL] > 0)]
    for scenario, of_scene in others.groupby("scenario", sort=False):
        records = of_scene.to_dict("records")
        counts = ", ".join(f"{row['name']} {int(row[_FULL])} of {total}" for row in records[:_MOST_NAMED])
        more = f" and {len(records) - _MOST_NAMED} more" if len(records) > _MOST_NAMED else ""
        yield f"In {scene_in_words(str(scenario))}, lamps saturate pixels: {counts}{more}."


def saturation_limits(output: Output) -> list[str]:
    """Return `saturation_lines`, few of them."""
    lines = list(saturation_lines(output))
    return (
        lines
        if len(lines) <= _MOST_NAMED
        else [
            *lines[: _MOST_NAMED - 1],
            f"In {len(lines) - _MOST_NAMED + 1} more scenes lamps saturate pixels, too (saturated.parquet).",
        ]
    )
