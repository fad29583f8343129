"""Match columns of a QE file to channels, and choose CFAs and the modified channel from them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import DataError, ValidationIssue
from ..spectra.facts import Curve
from ..spectra.filter_files import HINTS
from ..spectra.light_files import MOST_LETTERS, clean_curves
from ..spectra.spectrum import Curves, Quantity
from ..spectra.units import folded, name_of, used_as

_WORDS = {
    **dict.fromkeys(("red", "rot", "rouge"), "R"),
    **dict.fromkeys(("green", "grun", "gruen", "vert", "verte"), "G"),
    **dict.fromkeys(("blue", "blau", "bleu", "bleue"), "B"),
    **dict.fromkeys(("white", "weiss", "blanc", "blanche"), "W"),
    **dict.fromkeys(("clear", "klar", "clair", "claire", "mono", "panchromatic", "panchromatisch"), "C"),
    **dict.fromkeys(("yellow", "gelb", "jaune"), "Y"),
    "cyan": "Cy",
    "magenta": "M",
}
"""Words of English, German and French, without accents."""
_LETTERS = {"r": "R", "g": "G", "gr": "G", "gb": "G", "b": "B", "w": "W", "c": "C", "y": "Y", "ye": "Y", "cy": "Cy"}
_LETTERS |= {"m": "M", "mg": "M"}
_ORDER = ("R", "G", "B", "W", "C", "Y", "Cy", "M")
_HUMP = re.compile(r"(?<=[^\W\d_A-Z])(?=[A-Z])")
_TOKEN = re.compile(r"[^\W\d_]+")
RATIO = "_over_"
"""Part of the column names that `sweep export` gives to transmissions."""
_NEEDED_NM = (450.0, 680.0)
"""Range that QE curves must cover to see every signal color."""
_UNKNOWN = "the name says no channel"
_FEWEST = 3
NEW = "N"
"""Name of the modified channel."""


@dataclass(frozen=True)
class Channels:
    """Columns of each channel, and other columns with the reason they are left out."""

    columns: Mapping[str, str]
    left_out: Mapping[str, str]


@dataclass(frozen=True)
class Layout:
    """CFAs to compare and the CFA with the modified channel N between `base` and `to`."""

    plain: tuple[str, ...]
    changed: str
    base: str
    to: str

    @property
    def cfas(self) -> tuple[str, ...]:
        """CFAs of the study: those with more than one channel, and the modified one."""
        several = tuple(name for name in self.plain if name != self.base * 4)
        return (*several, self.changed)

    @property
    def clear(self) -> str | None:
        """Clear channel, if it is the base."""
        return self.base if self.base in ("W", "C") else None


def channel_of(column: str) -> str | None:
    """Return the channel that the name of a column states; None for none, and for N, the modified channel.

    A name is a channel (`R`), one after ISETCam's hint letter (`wC`, `cCy`), or has a color word or letter (`red`,
    `QE_R`).
    """
    column = name_of(column)
    name = column[1:] if column[:1] in tuple(HINTS) and column[1:] in (*_ORDER, NEW) else column
    if name in (*_ORDER, NEW):
        return None if name == NEW else name
    tokens = _TOKEN.findall(folded(_HUMP.sub(" ", column)))
    for known in (_WORDS, _LETTERS):
        stated = {known[token] for token in tokens if token in known}
        if len(stated) == 1:
            return stated.pop()
    return None


def channels_of(curves: Mapping[str, Curve]) -> Channels:
    """Assign columns to channels by their names."""
    lit = {column: curve for column, curve in curves.items() if curve.width_nm > 0}
    left_out = {column: "0 from 400 to 700 nm" for column in curves if column not in lit}
    left_out |= {column: reason for column in lit if (reason := _no_channel(column))}
    lit = {column: curve for column, curve in lit.items() if column not in left_out}
    assigned = {column: channel for column in lit if (channel := channel_of(column)) is not None}
    columns: dict[str, str] = {}
    for column in sorted(lit, key=lambda column: column != assigned.get(column)):  # a whole name before a part of one
        channel = assigned.get(column)
        if channel is None:
            left_out[column] = _UNKNOWN
        elif channel in columns:
            left_out[column] = f"a second {channel}"
        else:
            columns[channel] = column
    ordered = {channel: columns[channel] for channel in _ORDER if channel in columns}
    return Channels(ordered, left_out)


def _no_channel(column: str) -> str:
    """Return the reason why a column of `sweep export` is no channel; empty for other columns."""
    if RATIO in column:
        return "a transmission, no QE"
    hinted = column[:1] in tuple(HINTS) and column[1:] == NEW
    return f"{NEW} is the channel that the study designs" if column == NEW or hinted else ""


def layout_of(channels: Mapping[str, float]) -> Layout:
    """Choose CFAs of 2 x 2 pixels and the modified channel.

    A yellow pixel beside red and cyan, or red and blue; else a clear pixel beside R, G and B; else RGGB; else all
    channels around the most sensitive one. The last CFA that fits gets the channel N.
    `channels`: sum of the QE of each.
    """
    clear = next((name for name in ("W", "C") if name in channels), "")
    known = [("G", ["R", "G", "G", "B"])]
    if clear:
        known += [
            (clear, ["R", clear, clear, clear]),
            (clear, ["R", clear, clear, "B"]),
            (clear, ["R", "G", "B", clear]),
        ]
    known += [("Y", ["R", "Y", "Y", "B"]), ("Y", ["R", "Y", "Y", "Cy"])]
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
    """Files of a sensor's curves: channels, sum of the QE of each, and the range of a grid in whole nm.

    `entries`: path, columns, quantity and scale of each file, as a study states them. `notes`: how they were read.
    """

    name: str
    channels: Channels
    totals: Mapping[str, float]
    range_nm: tuple[int, int]
    entries: tuple[Mapping[str, Any], ...]
    notes: tuple[str, ...]

    def keys(self, path_in_study: Callable[[Path], str]) -> dict[str, Any]:
        """Return the keys of a study for this sensor."""
        return {"name": self.name, "files": [{**entry, "file": path_in_study(entry["file"])} for entry in self.entries]}


def sensor_file(paths: Path | Sequence[Path], quantity: Quantity | None = None) -> SensorFile:
    """Read the channels of one or more files or folders of QE curves.

    Raises DataError if the files have no QE curve, too short a range, or fewer than three channels beside columns that
    were not understood.
    """
    places = [paths] if isinstance(paths, Path) else list(paths)
    curves: dict[str, Curve] = {}
    owner: dict[str, tuple[Path, str, Curves]] = {}
    notes: list[str] = []
    for path in places:
        read = clean_curves(path)
        known = [name for name in read.values if not _no_channel(name)]
        used = used_as(read, known, "sensor", quantity)
        notes += [f"{path.name}: {note}" for note in used.notes[len(read.notes) :]]
        for name in known:
            own = name if len(places) == 1 else f"{path.stem} {name}" if len(known) > 1 else path.stem
            own = own if own not in curves else f"{path.stem} {name}"
            curves[own] = Curve(own, *used.samples(name))
            owner[own] = (path, name, used)
        left = {name: _no_channel(name) for name in read.values if name not in known}
        curves |= {name: Curve(name, np.empty(0), np.empty(0)) for name in left}
    channels = channels_of(curves)
    shown = places[0]
    unknown = [name for name, reason in channels.left_out.items() if reason == _UNKNOWN]
    if not channels.columns and not unknown:
        raise DataError(
            ValidationIssue("no curve that could be QE", str(shown), allowed="values above 0 between 400 and 700 nm")
        )
    if len(channels.columns) < _FEWEST and (unknown or len(channels.columns) == 1):
        understood = " and ".join(channels.columns)
        verb = "was" if len(channels.columns) == 1 else "were"
        problem = f"only {understood} {verb} understood" if understood else "no column names a channel"
        allowed = (
            "columns named by channels (R, G, B, W, C, Y, Cy, M) or colors, three or more; `sensor.files` of a study"
        )
        raise DataError(ValidationIssue(problem, str(shown), None, None, ", ".join(unknown) or None, allowed))
    ends = {name: curves[name].wavelength_nm[[0, -1]].tolist() for name in channels.columns.values()}
    low, high = max(first for first, _ in ends.values()), min(last for _, last in ends.values())
    if short := [n for n, (first, last) in ends.items() if first > _NEEDED_NM[0] or last < _NEEDED_NM[1]]:
        problem, value = "QE of too few wavelengths", f"{ends[short[0]][0]:g} to {ends[short[0]][1]:g} nm"
        allowed = f"{_NEEDED_NM[0]:g} to {_NEEDED_NM[1]:g} nm or more; `outside: zero` of a study's file takes 0 beyond"
        raise DataError(ValidationIssue(problem, str(shown), None, short[0], value, allowed))
    return SensorFile(
        name=shown.stem[:MOST_LETTERS],
        channels=channels,
        totals={channel: float(curves[column].values.sum()) for channel, column in channels.columns.items()},
        range_nm=(max(400, math.ceil(low)), min(700, math.floor(high))),
        entries=tuple(_entries(channels, owner)),
        notes=tuple(dict.fromkeys(notes)),
    )


def _entries(channels: Channels, owner: Mapping[str, tuple[Path, str, Curves]]) -> Iterator[dict[str, Any]]:
    """Yield the keys of each file, and of each quantity in it."""
    groups: dict[tuple[Path, str, float], dict[str, str]] = {}
    for channel, own in channels.columns.items():
        path, column, curves = owner[own]
        unit = curves.units[column]
        assert unit.quantity is not None
        groups.setdefault((path, unit.quantity, unit.factor or 1.0), {})[channel] = column
    for (path, quantity, factor), columns in groups.items():
        yield {"file": path, "columns": columns, "quantity": quantity} | ({} if factor == 1 else {"scale": factor})
