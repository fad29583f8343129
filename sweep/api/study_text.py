"""Text of a new study."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from ruamel.yaml import YAML

from ..api.channels import NEW, Layout, SensorFile, layout_of
from ..spectra.light_files import LightsFile
from ..spectra.signal_color import LightColor

_TYPICAL_NM = {"green": 505, "yellow": 590, "orange": 605, "red": 635}
"""Signal types in the order of a study, and about where their lights peak."""


@dataclass(frozen=True)
class Sources:
    """Files that a study takes its curves from; None for built-in curves.

    `path_in_study`: path of a file as the study says it.
    """

    sensor: SensorFile | None = None
    lights: LightsFile | None = None
    path_in_study: Callable[[Path], str] = str


def study_text(name: str, sources: Sources, photon_ratio: float | None) -> str:
    """Write a commented study that runs unchanged."""
    sensor, lights = sources.sensor, sources.lights
    layout = (
        Layout(("RGGB", "RCCC", "RCCB", "RYYCy"), "RYNCy", "Y", "G") if sensor is None else layout_of(sensor.totals)
    )
    pairs = list(combinations([kind for kind in _TYPICAL_NM if lights is None or kind in lights.types], 2))
    pair = ("yellow", "red")
    if pair not in pairs:  # the types whose lights are most alike
        pair = min(pairs, key=lambda p: _TYPICAL_NM[p[1]] - _TYPICAL_NM[p[0]])
    others = "".join(f"  # csd_{a}_{b}: {{min: 20}}\n" for a, b in pairs if (a, b) != pair)
    low, high = _TYPICAL_NM[pair[0]], _TYPICAL_NM[pair[1]]
    to = "the curve that it follows inside the band" if layout.to == "G" else "a floor: that share of the base is left"
    stop = 700 if sensor is None else sensor.range_nm[1]
    return f"""\
# yaml-language-server: $schema=study.schema.json
# Check it with `sweep check`, see the work with `sweep run ... --dry-run`.
study: {scalar(name)}
title: Where should the edges of a stopband lie to separate {pair[0]} from {pair[1]}?
question: >-
  One {layout.base} pixel of {layout.plain[-1]} gets a stopband. Where should its edges lie, so that {pair[0]} and
  {pair[1]} lights separate best while the pixel keeps 90 % of its sensitivity?
seed: 1

{_sensor(sources, layout.clear)}
{_lights(sources, photon_ratio)}
scenarios:
  chart:                # every signal fills the field; exposed for a white patch, per CFA
    exposure: {{kind: white_patch, level: 0.95}}
  # road:               # a light at a distance, with noise
  #   target: {{distance_m: 100, fov_deg: 60, phase_px: any}}
  #   optics: {{f_number: 2}}
  #   noise: true

# 2x2 pixels by name, row by row; or `NAME: {{tile: [[R, G], [B, W]]}}`. {NEW} is the new channel.
cfas: [{", ".join(layout.cfas)}]

sweeps:
  edges:                # every combination of the values below
    cfa: {layout.changed}
    family: stopband
    channel: {NEW}          # the modified channel ...
    base: {layout.base:<14}# ... starts from this curve ...
    to: {layout.to:<16}# ... {to}
    grid:
      left_nm: {{min: {low - 20}, max: {high - 5}, count: 31}}
      left_width_nm: [5, 10, 20, 40]    # 10-90 % width of the edge
      right_nm: {{min: {high - 5}, max: {min(high + 65, stop)}, count: 36}}
      right_width_nm: [5, 10, 20, 40]

objective: csd_{pair[0]}_{pair[1]}
constraints:
  sensitivity: {{min: 0.90}}
  # slope_per_nm: {{max: 0.06}}           # steepest QE slope that can be made
{others}
search:
  space: edges          # between the smallest and the largest values of the grid
  starts: 16
  front: {{min: 0.80, max: 1.0, count: 11}}       # the same search at each level of sensitivity
"""


def _sensor(sources: Sources, clear: str | None) -> str:
    sensor = sources.sensor
    if sensor is None:
        return "sensor: ar0820          # built-in surrogate curves; `sweep new NAME --qe FILE` takes your own\n"
    lines = ["sensor:", f"  name: {scalar(sensor.name)}", "  files:"]
    for entry in sensor.entries:
        lines += [f"    - file: {scalar(sources.path_in_study(entry['file']))}"]
        lines.append(f"      quantity: {entry['quantity']}      # unit of the file's numbers")
        if "scale" in entry:
            lines.append(f"      scale: {entry['scale']:.6g}       # brings them to plain numbers")
        lines.append("      columns:          # channel: column of the file")
        for channel, column in entry["columns"].items():
            lines.append(f"        {channel}: {scalar(column)}")
    lines += _left_out(sensor.channels.left_out)
    if clear:
        lines.append(f"  clear: {clear}              # the unfiltered pixel")
    if sensor.range_nm != (400, 700):
        start, stop = sensor.range_nm
        where = "# where the sensor's curves begin and end"
        lines += ["", f"wavelengths: {{start_nm: {start}, stop_nm: {stop}}}    {where}"]
    return "\n".join(lines) + "\n"


def _lights(sources: Sources, photon_ratio: float | None) -> str:
    lights = sources.lights
    if lights is None:
        return "lights: tl16            # built-in surrogate; `sweep new NAME --lights FILE` takes your own\n"
    lines = ["lights:", f"  name: {scalar(lights.name)}"]
    if photon_ratio is not None:
        meaning = "photons of a light over a white patch's, from these spectra"
        lines.append(f"  photon_ratio: {photon_ratio:.6g}   # {meaning}")
    lines.append("  files:")
    for entry in lights.entries:
        lines.append(f"    - file: {scalar(sources.path_in_study(entry.path))}")
        if entry.quantity is not None:
            other = "photons" if entry.quantity == "energy" else "energy"
            lines.append(f"      quantity: {entry.quantity}  # unit of the numbers; or {other}")
        if entry.ends_early:
            lines.append("      outside: zero     # the file ends inside the wavelength range")
        if entry.fine:
            lines.append("      resampling: mean  # the file is finer than 1 nm")
        lines.append("      signals:          # signal type: columns of the file, by CIE 1931 x, y")
        for kind, columns in entry.types.items():
            lines.append(f"        {kind}:")
            width = min(max(len(scalar(column)) for column in columns), 40)
            lines += [f"          - {scalar(name):<{width}}  # {_reason(color)}" for name, color in columns.items()]
    return "\n".join([*lines, *_left_out(lights.left_out)]) + "\n"


def _reason(color: LightColor) -> str:
    """Reason for which a light is of its signal type."""
    xy = f"xy {color.xy[0]:.3f} {color.xy[1]:.3f}"
    if color.region == "orange":
        return f"{xy}, between EN 12368's red and yellow"
    if color.region is not None:
        return f"{xy}, inside EN 12368's {color.region}"
    return f"{xy}, outside EN 12368's regions, nearest by dominant wavelength, {color.dominant_nm:g} nm"


def _left_out(columns: Mapping[str, str]) -> list[str]:
    return [f"        # left out: {one_line(column)}: {reason}" for column, reason in columns.items()]


def one_line(text: str) -> str:
    """Return a name for use in a comment."""
    return text if text.isprintable() else repr(text)


def scalar(text: str) -> str:
    """Return a text as a YAML scalar, quoted if needed, also for flow collections."""
    plain = re.fullmatch(r"[A-Za-z_][A-Za-z0-9_.-]*", text) and YAML(typ="safe", pure=True).load(text) == text
    if plain and text.casefold() not in ("yes", "no", "on", "off"):  # booleans of YAML 1.1
        return text
    quoted = json.dumps(text, ensure_ascii=False)
    return "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in quoted)
