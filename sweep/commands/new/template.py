"""The text of a new study."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ruamel.yaml import YAML

from ...api.channels import NEW, Channels, Layout
from ...curves.signal_color import LightColor

TYPICAL_NM = {"green": 505, "yellow": 590, "orange": 605, "red": 635}
"""Signal types in the order of a study, and about where their lights peak."""
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*")
_OLD_BOOLEANS = ("yes", "no", "on", "off")
"""Words that readers of YAML 1.1 take for booleans."""
_MOST_OF_FOUR_DIGITS = 0xFFFF


@dataclass(frozen=True)
class SensorText:
    """What a study says of its sensor: `file` is None for the built-in one; `range_nm` where the curves end early."""

    layout: Layout
    file: str | None = None
    name: str = ""
    channels: Channels = field(default_factory=lambda: Channels({}, {}, guessed=False))
    scale: float = 1.0
    range_nm: tuple[int, int] = (400, 700)


@dataclass(frozen=True)
class LightsText:
    """What a study says of its lights: `file` is None for the built-in ones.

    `types`: signal type -> column -> color; `left_out`: column -> reason.
    """

    types: Mapping[str, Mapping[str, LightColor | None]]
    file: str | None = None
    name: str = ""
    quantity: str = "energy"
    left_out: Mapping[str, str] = field(default_factory=dict)
    ends_early: bool = False
    fine: bool = False
    photon_ratio: float | None = None


@dataclass(frozen=True)
class PixelText:
    """What a study says of its pixel, out of a `file`; nothing without one. `missing`: what the file does not say."""

    file: str = ""
    given: Mapping[str, float] = field(default_factory=dict)
    missing: Sequence[str] = ()


def study_text(name: str, sensor: SensorText, lights: LightsText, pixel: PixelText) -> str:
    """A commented study that runs as it is."""
    pair = nearest_pair(list(lights.types))
    layout = sensor.layout
    others = "".join(f"  # csd_{a}_{b}: {{min: 20}}\n" for a, b in _pairs(list(lights.types)) if (a, b) != pair)
    low, high = TYPICAL_NM[pair[0]], TYPICAL_NM[pair[1]]
    to = "the curve that it follows inside the band" if layout.to == "G" else "a floor: that share of the base is left"
    stop = sensor.range_nm[1]
    return f"""\
# yaml-language-server: $schema=study.schema.json
# Check it with `sweep check`, see what is to do with `sweep run ... --dry-run`.
study: {scalar(name)}
question: >-
  One {layout.base} pixel of {layout.plain[-1]} gets a stopband. Where should its edges lie, so that {pair[0]} and
  {pair[1]} lights separate best while the pixel keeps 90 % of its sensitivity?
seed: 1

{_sensor(sensor)}
{_lights(lights)}{_pixel(pixel)}
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


def nearest_pair(types: Sequence[str]) -> tuple[str, str]:
    """The pair to separate: yellow and red where there are both, else the two types whose lights are most alike."""
    pairs = _pairs(types)
    return (
        ("yellow", "red")
        if ("yellow", "red") in pairs
        else min(pairs, key=lambda p: TYPICAL_NM[p[1]] - TYPICAL_NM[p[0]])
    )


def _pairs(types: Sequence[str]) -> list[tuple[str, str]]:
    ordered = [kind for kind in TYPICAL_NM if kind in types]
    return [(a, b) for at, a in enumerate(ordered) for b in ordered[at + 1 :]]


def _sensor(sensor: SensorText) -> str:
    if sensor.file is None:
        return "sensor: ar0820          # built-in surrogate curves; `sweep new NAME --qe FILE` takes your own\n"
    lines = ["sensor:", f"  name: {scalar(sensor.name)}", "  files:"]
    lines += [f"    - file: {scalar(sensor.file)}", "      columns:          # channel: column of the file"]
    guess = "        # guessed by its shape: check" if sensor.channels.guessed else ""
    lines += [f"        {channel}: {scalar(column)}{guess}" for channel, column in sensor.channels.columns.items()]
    lines += _left_out("        ", sensor.channels.left_out)
    if sensor.scale != 1:
        reason = "the file is in percent" if sensor.scale == 0.01 else "the file's largest value becomes 1"
        lines.append(f"      scale: {sensor.scale:.6g}       # {reason}")
    if sensor.layout.clear:
        lines.append(f"  clear: {sensor.layout.clear}              # the unfiltered pixel")
    if sensor.range_nm != (400, 700):
        start, stop = sensor.range_nm
        lines += [
            "",
            f"wavelengths: {{start_nm: {start}, stop_nm: {stop}}}    # where the sensor's curves begin and end",
        ]
    return "\n".join(lines) + "\n"


def _lights(lights: LightsText) -> str:
    if lights.file is None:
        return "lights: tl16            # built-in surrogate; `sweep new NAME --lights FILE` takes your own\n"
    lines = ["lights:", f"  name: {scalar(lights.name)}"]
    if lights.photon_ratio is not None:
        lines.append(
            f"  photon_ratio: {lights.photon_ratio:.6g}   # photons of a light over a white patch's, from these spectra"
        )
    lines += ["  files:", f"    - file: {scalar(lights.file)}"]
    other = "photons" if lights.quantity == "energy" else "energy"
    lines.append(f"      quantity: {lights.quantity}  # what the numbers are; or {other}")
    if lights.ends_early:
        lines.append("      outside: zero     # the file ends inside the wavelength range")
    if lights.fine:
        lines.append("      resampling: mean  # the file is finer than 1 nm")
    lines.append("      signals:          # signal type: columns of the file, by CIE 1931 x, y")
    for kind, columns in lights.types.items():
        lines.append(f"        {kind}:")
        wide = min(max(len(scalar(column)) for column in columns), 40)
        lines += [f"          - {scalar(name):<{wide}}  # {_why(color)}" for name, color in columns.items() if color]
    lines += _left_out("        ", lights.left_out)
    return "\n".join(lines) + "\n"


def _pixel(pixel: PixelText) -> str:
    if not pixel.given:
        return ""
    lines = ["", f"pixel:                  # EMVA 1288 results: {one_line(pixel.file)}"]
    lines += [f"  {key}: {value:.12g}" for key, value in pixel.given.items()]
    return "\n".join([*lines, f"  # not in the file, so the defaults hold: {', '.join(pixel.missing)}"]) + "\n"


def _why(color: LightColor) -> str:
    xy = f"xy {color.xy[0]:.3f} {color.xy[1]:.3f}"
    if color.region == "orange":
        return f"{xy}, between EN 12368's red and yellow"
    if color.region is not None:
        return f"{xy}, inside EN 12368's {color.region}"
    return f"{xy}, outside EN 12368's regions, nearest by dominant wavelength, {color.dominant_nm:g} nm"


def _left_out(indent: str, columns: Mapping[str, str]) -> list[str]:
    return [f"{indent}# left out: {one_line(column)}: {reason}" for column, reason in columns.items()]


def one_line(text: str) -> str:
    """A name for a comment."""
    return text if text.isprintable() else repr(text)


def scalar(text: str) -> str:
    """A text as YAML writes it, quoted where it must be; it can stand anywhere, also between brackets."""
    if (
        _PLAIN.fullmatch(text)
        and YAML(typ="safe", pure=True).load(text) == text
        and text.casefold() not in _OLD_BOOLEANS
    ):
        return text
    quoted = json.dumps(text, ensure_ascii=False)
    return "".join(c if c.isprintable() else _escaped(c) for c in quoted)


def _escaped(char: str) -> str:
    """A line break, a control character or another that does not print, as double quotes of YAML have it."""
    code = ord(char)
    return f"\\u{code:04x}" if code <= _MOST_OF_FOUR_DIGITS else f"\\U{code:08x}"
