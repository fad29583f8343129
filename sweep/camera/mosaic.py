"""Color filter array as an integer tile over named channels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import SweepError, ValidationIssue
from ..base.types import IndexArray, Int

_TOKEN = re.compile(r"[A-Z][a-z0-9]*")
PRESETS = {
    "RGBIR": ("BGRG", "GIGI", "RGBG", "GIGI"),
    "RGBW4x4": ("WGWR", "GWRW", "WBWG", "BWGW"),
    "QuadRGGB": ("RRGG", "RRGG", "GGBB", "GGBB"),
}
"""Tiles of more than four pixels by name, a letter for each: `I` sees the infrared alone, `W` is a clear pixel."""


@dataclass(frozen=True)
class Mosaic:
    """Color filter array.

    Each channel is kept once, in the order of its first pixel, so that ``len(channels)`` is the paper's m_p (RGGB 3,
    RCCC 2, RCCB 3, RYYCy 3, RYNCy 4). `tile[row][column]` indexes `channels`; the tile repeats over the sensor.
    """

    name: str
    channels: tuple[str, ...]
    tile: tuple[tuple[int, ...], ...]

    @classmethod
    def from_rows(cls, name: str, rows: Sequence[Sequence[str]]) -> Mosaic:
        """Make a mosaic from rows of channel names.

        `rows`: channel of each pixel of the tile. Raises SweepError if the tile is empty or ragged.
        """
        if not rows or not rows[0] or any(len(row) != len(rows[0]) for row in rows):
            raise SweepError(
                ValidationIssue("a tile needs rows of equal length", key=name, value=[list(row) for row in rows])
            )
        channels = tuple(dict.fromkeys(channel for row in rows for channel in row))
        return cls(name, channels, tuple(tuple(channels.index(channel) for channel in row) for row in rows))

    @classmethod
    def from_name(cls, name: str) -> Mosaic:
        """Make a 2 x 2 mosaic from its name, row by row: ``RYYCy`` is R Y / Y Cy; or a preset.

        Raises SweepError if the name does not have exactly four channels.
        """
        if name in PRESETS:
            return cls.from_rows(name, [list(row) for row in PRESETS[name]])
        tokens = _TOKEN.findall(name)
        if "".join(tokens) != name or len(tokens) != 4:
            raise SweepError(
                ValidationIssue(
                    "not the name of a 2x2 CFA",
                    value=name,
                    allowed="four channels, each a capital and small letters (RGGB, RYYCy), "
                    f"{', '.join(PRESETS)}, or a mapping with `tile`",
                )
            )
        return cls.from_rows(name, [tokens[:2], tokens[2:]])

    @property
    def rows(self) -> list[list[str]]:
        """Tile of channel names."""
        return [[self.channels[index] for index in row] for row in self.tile]

    @property
    def indices(self) -> Int[IndexArray, "rows columns"]:
        """Tile of channel indices."""
        return np.asarray(self.tile, dtype=np.intp)

    @property
    def counts(self) -> Int[IndexArray, " channels"]:
        """Pixels of each channel per tile."""
        return np.bincount(self.indices.ravel(), minlength=len(self.channels))
