"""What the figures of an answer are of: camera, scene and curves, and signals that saturate."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from ..camera.scene import Scene, WhitePatchExposure
from ..results.output import Output
from ..study.axes import series_of
from .series import over_series, quantity_of, scene_in_words

_FULL = "full_signals"
_MOST_NAMED = 3


def stated_lines(output: Output) -> list[str]:
    """Return camera, scene and curves that an answer is of in one line, and a warning where signals fill pixels."""
    return [f"{camera_and_scene(output)}; {_curves(output)}.", *saturation_lines(output)]


def camera_and_scene(output: Output) -> str:
    """Return camera and scene of a run in words."""
    return f"Camera: {_camera(output)}; scene: {_scene(list(output.study.scenarios.values()))}"


def _camera(output: Output) -> str:
    pixel, scenes = output.study.pixel, list(output.study.scenarios.values())
    lens = _span((scene.optics.f_number for scene in scenes), "f/{}".format)
    readings = f"{len(pixel.captures)} captures of {pixel.bits} bits" if pixel.captures else f"{pixel.bits} bits"
    if pixel.captures and len({capture.bits for capture in pixel.read_as}) > 1:
        readings = f"{len(pixel.captures)} captures"
    full = f"full scale {pixel.full_scale_dn:,} DN"
    if pixel.captures:
        top_dn = pixel.saturation_e * pixel.dn_per_e + pixel.offset_dn
        full = f"{pixel.full_scale_dn:,} DN the first, {top_dn:,.0f} DN merged"
    wells = max(capture.well_e for capture in pixel.read_as or (pixel,))
    return f"{lens}, pixel of {pixel.pitch_um:g} um and {wells:,.0f} e, {readings} ({full})"


def _scene(scenes: list[Scene]) -> str:
    """Return distance, brightness, exposure and the like, over all scenes."""
    far = [scene.target.distance_m for scene in scenes if scene.target is not None]
    parts = [_span(far, "{} m away".format) if far else "lights that fill the field"]
    parts += ["lights that fill the field"] if 0 < len(far) < len(scenes) else []
    lamps = [scene.intensity_cd for scene in scenes if scene.intensity_cd is not None]
    parts.append(_span(lamps, "{} cd".format) if lamps else "equal photons of all lights")
    fixed = [s.exposure.exposure_s for s in scenes if not isinstance(s.exposure, WhitePatchExposure)]
    parts += [_span((1e3 * time_s for time_s in fixed), "exposure {} ms".format)] if fixed else []
    levels = [s.exposure.level for s in scenes if isinstance(s.exposure, WhitePatchExposure)]
    parts += (
        [_span((100 * level for level in levels), "exposed for {} % of full scale on white".format)] if levels else []
    )
    seen = [scene.visibility_m for scene in scenes if scene.visibility_m is not None]
    parts += [_span(seen, "visibility {} m".format)] if seen else []
    bright = [scene.background_cd_m2 for scene in scenes if scene.background_cd_m2]
    parts += [_span(bright, "background {} cd/m2".format)] if bright else []
    pulsed = [scene.drive for scene in scenes if scene.drive is not None]
    if pulsed:
        rates, shares = (
            _span(values, str) for values in ((d.frequency_hz for d in pulsed), (100 * d.duty for d in pulsed))
        )
        steady = "" if len(pulsed) == len(scenes) else "steady, and "
        parts.append(f"{steady}pulsed at {rates} Hz, on {shares} % of the time")
    parts.append("no noise" if all(scene.noise is None for scene in scenes) else "noise")
    return ", ".join(parts)


def _span(values: Iterable[float], text: Callable[[str], str]) -> str:
    """Return one value, a few, or the least and the most in words."""
    known = sorted({float(f"{value:.3g}") for value in values})
    shown = [f"{value:,.0f}" if value >= 1000 else f"{value:g}" for value in known]
    return text(shown[0] if len(shown) == 1 else f"{shown[0]} to {shown[-1]}")


def _curves(output: Output) -> str:
    origins = (output.provenance.sensor, output.provenance.lights)
    modeled = [origin.name for origin in origins if origin.surrogate]
    names = " and ".join(origin.name for origin in origins)
    if len(modeled) == len(origins):
        return f"surrogate curves {names} (modeled, not measured)"
    return f"curves {names}" + (f", of which {modeled[0]} is a surrogate (modeled, not measured)" if modeled else "")


def saturation_lines(output: Output) -> Iterator[str]:
    """Yield in which scenarios signals fill pixels, by design."""
    rows = output.named_rows.merge(output.saturated, on="design_id", how="left")
    if not (rows[_FULL] > 0).any():
        return
    total, told = int(rows["signals"].max()), set[str]()
    for (base, key), scenarios in series_of(output.scenarios).items():
        told |= scenarios.keys()
        x, (_, unit), ranges = np.array(list(scenarios.values())), quantity_of(key), dict[str, list[str]]()
        for name, full in over_series(rows, scenarios, _FULL).items():
            if (full > 0).any():
                where = f"from {x[np.flatnonzero(full > 0)[0]]:.3g}{f' {unit}' if unit else ''} on"
                if full[0] > 0 and not full[-1] > 0:
                    where = f"up to {x[np.flatnonzero(full > 0)[-1]]:.3g}{f' {unit}' if unit else ''}"
                ranges.setdefault("everywhere" if (full > 0).all() else where, []).append(name)
        if ranges:
            every = len(over_series(rows, scenarios, _FULL))
            of_designs = "; ".join(
                f"{'every design' if len(names) == every else ', '.join(names)} {where}"
                for where, names in ranges.items()
            )
            yield f"Warning: in {base}, signals fill pixels: {of_designs}."
    others = rows[~rows["scenario"].isin(told) & (rows[_FULL] > 0)]
    for scenario, of_scenario in others.groupby("scenario", sort=False):
        counts = ", ".join(
            f"{row['name']} {int(row[_FULL])} of {total}" for row in of_scenario.to_dict("records")[:_MOST_NAMED]
        )
        more = f" and {len(of_scenario) - _MOST_NAMED} more" if len(of_scenario) > _MOST_NAMED else ""
        yield f"Warning: in {scene_in_words(str(scenario))}, signals fill pixels: {counts}{more}."
