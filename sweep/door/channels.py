"""Channels of a user's file of QE, by its columns, and the CFAs and the filter that these allow."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import DataError, Fault
from ..curves.facts import Curve, qe_scale
from ..curves.filter_files import HINTS
from ..curves.light_files import MOST_LETTERS, clean_curves

_WORDS = {
    "red": "R",
    "green": "G",
    "blue": "B",
    "white": "W",
    "clear": "C",
    "mono": "C",
    "panchromatic": "C",
    "yellow": "Y",
    "cyan": "Cy",
    "magenta": "M",
}
_LETTERS = {"r": "R", "g": "G", "gr": "G", "gb": "G", "b": "B", "w": "W", "c": "C", "y": "Y", "ye": "Y", "cy": "Cy"}
_LETTERS |= {"m": "M", "mg": "M"}
_ORDER = ("R", "G", "B", "W", "C", "Y", "Cy", "M")
_TOKEN = re.compile(r"[A-Z]?[a-z]+|[A-Z]+")
_CLEAR_NM = 180.0
"""Equivalent width from which on a curve is rather that of a clear pixel."""
_RATIO = "_over_"
"""In the name of a filter's transmission over another curve, as `sweep export` writes it."""
_NEEDED_NM = (450.0, 680.0)
"""What a sensor's curves must cover, so that every signal color is seen."""
NEW = "N"
"""The channel that a study designs."""


@dataclass(frozen=True)
class Channels:
    """`columns`: channel -> the file's column. `left_out`: other columns, each with its reason. `guessed`: by shape."""

    columns: Mapping[str, str]
    left_out: Mapping[str, str]
    guessed: bool


@dataclass(frozen=True)
class Layout:
    """CFAs to compare, and the one with the channel N in it: N starts from `base` and goes `to` a curve or a floor."""

    plain: tuple[str, ...]
    changed: str
    base: str
    to: str

    @property
    def cfas(self) -> tuple[str, ...]:
        """What the study lists; a CFA of one channel tells no colors apart, so there is nothing to compare with."""
        several = tuple(name for name in self.plain if name != self.base * 4)
        return (*several, self.changed)

    @property
    def clear(self) -> str | None:
        """The unfiltered channel, where it is the base."""
        return self.base if self.base in ("W", "C") else None


def channel_of(column: str) -> str | None:
    """The channel that a column's name says, else None.

    The whole name (`R`), or a filter's after ISETCam's hint (`wC`, `cCy`); else a word or a letter in any case (`red`,
    `QE_R`, `rRed`). N says none: it is the channel that a study designs.
    """
    whole = column[1:] if column[:1] in tuple(HINTS) and column[1:] in (*_ORDER, NEW) else column
    if whole in (*_ORDER, NEW):
        return None if whole == NEW else whole
    tokens = [token.casefold() for token in _TOKEN.findall(column)]
    for known in (_WORDS, _LETTERS):
        found = {known[token] for token in tokens if token in known}
        if len(found) == 1:
            return found.pop()
    return None


def channels_of(curves: Mapping[str, Curve]) -> Channels:
    """Channels by the columns' names, or, where no name says one, by the curves' shapes."""
    lit = {column: curve for column, curve in curves.items() if curve.width_nm > 0}
    left_out = {column: "0 from 400 to 700 nm" for column in curves if column not in lit}
    left_out |= {column: reason for column in lit if (reason := _no_channel(column))}
    lit = {column: curve for column, curve in lit.items() if column not in left_out}
    named = {column: channel for column in lit if (channel := channel_of(column)) is not None}
    meant = named or {column: _by_shape(curve) for column, curve in lit.items()}
    columns: dict[str, str] = {}
    for column in sorted(lit, key=lambda column: column != meant.get(column)):  # a whole name before a part of one
        channel = meant.get(column)
        if channel is None:
            left_out[column] = "the name says no channel"
        elif channel in columns:
            left_out[column] = f"a second {channel}"
        else:
            columns[channel] = column
    ordered = {channel: columns[channel] for channel in _ORDER if channel in columns}
    return Channels(ordered, left_out, guessed=not named)


def _no_channel(column: str) -> str:
    """Why a column that `sweep export` writes is no channel to begin with; empty for others."""
    if _RATIO in column:
        return "a transmission, no QE"
    hinted = column[:1] in tuple(HINTS) and column[1:] == NEW
    return f"{NEW} is the channel that the study designs" if column == NEW or hinted else ""


def _by_shape(curve: Curve) -> str:
    """A broad curve is a clear pixel; others go by where they have their half, 400 to 700 nm."""
    if curve.width_nm >= _CLEAR_NM:
        return "C"
    inside = (curve.wavelength_nm >= 400) & (curve.wavelength_nm <= 700)
    weight = np.cumsum(np.clip(curve.values, 0, None) * inside)
    half_nm = float(curve.wavelength_nm[np.searchsorted(weight, weight[-1] / 2)])
    return "B" if half_nm < 500 else "G" if half_nm < 570 else "R"


def layout_of(channels: Mapping[str, float]) -> Layout:
    """The CFAs of two by two pixels that channels (with their total QE) allow; the last that fits gets the channel N.

    RYYCy where there are red, yellow and cyan; else a clear pixel beside R, G and B, or beside what there is of them;
    else RGGB; else whatever there is, around its most sensitive channel.
    """
    clear = next((name for name in ("W", "C") if name in channels), "")
    known = [("G", ["R", "G", "G", "B"])]
    if clear:
        known += [
            (clear, ["R", clear, clear, clear]),
            (clear, ["R", clear, clear, "B"]),
            (clear, ["R", "G", "B", clear]),
        ]
    known.append(("Y", ["R", "Y", "Y", "Cy"]))
    fitting = [(base, tile) for base, tile in known if set(tile) <= set(channels)]
    if not fitting:
        base = clear or max(channels, key=lambda name: channels[name])
        others = [name for name in channels if name != base][:3]
        fitting = [(base, [*others, *[base] * (4 - len(others))])]
    base, tile = fitting[-1]
    at = len(tile) - 1 - tile[::-1].index(base)
    changed = [*tile[:at], NEW, *tile[at + 1 :]]
    to = "G" if "G" in channels and base != "G" else "0.1"
    return Layout(tuple("".join(tile) for _, tile in fitting), "".join(changed), base, to)


@dataclass(frozen=True)
class SensorFile:
    """`totals`: channel -> sum of its curve. `range_nm`: where a grid in whole nm can begin and end."""

    name: str
    channels: Channels
    totals: Mapping[str, float]
    scale: float
    range_nm: tuple[int, int]

    def keys(self, file: str) -> dict[str, Any]:
        """What a study says of it."""
        entry = {"file": file, "columns": dict(self.channels.columns), "scale": self.scale}
        return {"name": self.name, "files": [entry]}


def sensor_file(path: Path) -> SensorFile:
    """The channels of a file of QE curves; raises DataError for one that no study can use."""
    curves = clean_curves(path)
    channels = channels_of(curves)
    if not channels.columns:
        raise DataError(Fault("no curve that could be QE", str(path), allowed="values above 0 between 400 and 700 nm"))
    wave = next(iter(curves.values())).wavelength_nm
    if wave[0] > _NEEDED_NM[0] or wave[-1] < _NEEDED_NM[1]:
        allowed = f"{_NEEDED_NM[0]:g} to {_NEEDED_NM[1]:g} nm or more"
        raise DataError(
            Fault("QE of too few wavelengths", str(path), None, None, f"{wave[0]:g} to {wave[-1]:g} nm", allowed)
        )
    return SensorFile(
        name=path.stem[:MOST_LETTERS],
        channels=channels,
        totals={channel: float(curves[column].values.sum()) for channel, column in channels.columns.items()},
        scale=qe_scale(max(curves[column].peak for column in channels.columns.values())),
        range_nm=(max(400, math.ceil(wave[0])), min(700, math.floor(wave[-1]))),
    )
