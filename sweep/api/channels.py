"""Match columns of a QE file to channels, and choose CFAs and the modified channel from them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import DataError, ValidationIssue
from ..spectra.facts import Curve, qe_scale
from ..spectra.filter_files import HINTS
from ..spectra.light_files import MOST_LETTERS, clean_curves

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
"""Equivalent width above which a curve is taken for a clear pixel."""
_RATIO = "_over_"
"""Part of the column names that `sweep export` gives to transmissions."""
_NEEDED_NM = (450.0, 680.0)
"""Range that QE curves must cover to see every signal color."""
NEW = "N"
"""Name of the modified channel."""


@dataclass(frozen=True)
class Channels:
    """Columns of each channel, other columns with the reason they are left out, and whether shapes were used."""

    columns: Mapping[str, str]
    left_out: Mapping[str, str]
    guessed: bool


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
    """Return the channel that the name of a column states.

    Parameters
    ----------
    column : str
        The name of a channel (`R`), one after ISETCam's hint letter (`wC`, `cCy`), or a name with a color word or
        letter (`red`, `QE_R`).

    Returns
    -------
    str or None
        The channel; None if the name states none, and for N, the modified channel.
    """
    whole = column[1:] if column[:1] in tuple(HINTS) and column[1:] in (*_ORDER, NEW) else column
    if whole in (*_ORDER, NEW):
        return None if whole == NEW else whole
    tokens = [token.casefold() for token in _TOKEN.findall(column)]
    for known in (_WORDS, _LETTERS):
        stated = {known[token] for token in tokens if token in known}
        if len(stated) == 1:
            return stated.pop()
    return None


def channels_of(curves: Mapping[str, Curve]) -> Channels:
    """Assign columns to channels by their names, or by the shapes of the curves if no name states a channel.

    Parameters
    ----------
    curves : mapping of str to Curve
        Curves by column name.

    Returns
    -------
    Channels
        Column of each channel, and the columns that are left out.
    """
    lit = {column: curve for column, curve in curves.items() if curve.width_nm > 0}
    left_out = {column: "0 from 400 to 700 nm" for column in curves if column not in lit}
    left_out |= {column: reason for column in lit if (reason := _no_channel(column))}
    lit = {column: curve for column, curve in lit.items() if column not in left_out}
    named = {column: channel for column in lit if (channel := channel_of(column)) is not None}
    assigned = named or {column: _by_shape(curve) for column, curve in lit.items()}
    columns: dict[str, str] = {}
    for column in sorted(lit, key=lambda column: column != assigned.get(column)):  # a whole name before a part of one
        channel = assigned.get(column)
        if channel is None:
            left_out[column] = "the name says no channel"
        elif channel in columns:
            left_out[column] = f"a second {channel}"
        else:
            columns[channel] = column
    ordered = {channel: columns[channel] for channel in _ORDER if channel in columns}
    return Channels(ordered, left_out, guessed=not named)


def _no_channel(column: str) -> str:
    """Return the reason why a column of `sweep export` is no channel; empty for other columns."""
    if _RATIO in column:
        return "a transmission, no QE"
    hinted = column[:1] in tuple(HINTS) and column[1:] == NEW
    return f"{NEW} is the channel that the study designs" if column == NEW or hinted else ""


def _by_shape(curve: Curve) -> str:
    """Return C for a broad curve, else B, G or R by the median wavelength from 400 to 700 nm."""
    if curve.width_nm >= _CLEAR_NM:
        return "C"
    inside = (curve.wavelength_nm >= 400) & (curve.wavelength_nm <= 700)
    weight = np.cumsum(np.clip(curve.values, 0, None) * inside)
    half_nm = float(curve.wavelength_nm[np.searchsorted(weight, weight[-1] / 2)])
    return "B" if half_nm < 500 else "G" if half_nm < 570 else "R"


def layout_of(channels: Mapping[str, float]) -> Layout:
    """Choose CFAs of 2 x 2 pixels and the modified channel.

    RYYCy with red, yellow and cyan; else a clear pixel beside R, G and B; else RGGB; else all channels around the most
    sensitive one. The last CFA that fits gets the channel N.

    Parameters
    ----------
    channels : mapping of str to float
        Sum of the QE of each channel.

    Returns
    -------
    Layout
        CFAs, modified CFA, base and target curve.
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
    """QE file of a sensor: channels, sum of each curve, scale of the values, and the range of a grid in whole nm."""

    name: str
    channels: Channels
    totals: Mapping[str, float]
    scale: float
    range_nm: tuple[int, int]

    def keys(self, file: str) -> dict[str, Any]:
        """Return the keys of a study for this sensor.

        Parameters
        ----------
        file : str
            Path of the file as the study names it.

        Returns
        -------
        dict
            Name and files.
        """
        entry = {"file": file, "columns": dict(self.channels.columns), "scale": self.scale}
        return {"name": self.name, "files": [entry]}


def sensor_file(path: Path) -> SensorFile:
    """Read the channels of a file of QE curves.

    Parameters
    ----------
    path : Path
        File of curves.

    Returns
    -------
    SensorFile
        Channels, scale and range.

    Raises
    ------
    DataError
        If the file has no QE curve, or too short a range.
    """
    curves = clean_curves(path)
    channels = channels_of(curves)
    if not channels.columns:
        raise DataError(
            ValidationIssue("no curve that could be QE", str(path), allowed="values above 0 between 400 and 700 nm")
        )
    wavelength_nm = next(iter(curves.values())).wavelength_nm
    if wavelength_nm[0] > _NEEDED_NM[0] or wavelength_nm[-1] < _NEEDED_NM[1]:
        allowed = f"{_NEEDED_NM[0]:g} to {_NEEDED_NM[1]:g} nm or more"
        raise DataError(
            ValidationIssue(
                "QE of too few wavelengths",
                str(path),
                None,
                None,
                f"{wavelength_nm[0]:g} to {wavelength_nm[-1]:g} nm",
                allowed,
            )
        )
    return SensorFile(
        name=path.stem[:MOST_LETTERS],
        channels=channels,
        totals={channel: float(curves[column].values.sum()) for channel, column in channels.columns.items()},
        scale=qe_scale(max(curves[column].peak for column in channels.columns.values())),
        range_nm=(max(400, math.ceil(wavelength_nm[0])), min(700, math.floor(wavelength_nm[-1]))),
    )
