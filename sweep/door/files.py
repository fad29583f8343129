"""Which columns of a user's file are the channels of a sensor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..base.errors import DataError, Fault
from ..curves.facts import qe_scale
from ..curves.light_files import MOST_LETTERS, clean_curves
from .channels import Channels, channels_of

_NEEDED_NM = (450.0, 680.0)
"""What a sensor's curves must cover, so that every signal color is seen."""


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
