"""Write the filters of a CFA: CSV, and ISETCam's `.mat` color filters."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ..base.types import IndexArray, Int, PerWavelength
from .layouts import WAVELENGTH

HINTS = "rgbcymwiuxzok"
"""First letters of filter names that ISETCam has a color for (its `sensorColorOrder`)."""
_FREE = "oxuzim"
"""Hints that are spent first where a filter's own letter is taken: they mean no usual filter."""
_CLEAR = ("c", "clear")
_HEADER = b"MATLAB 5.0 MAT-file, written by sweep"
_HEADER_BYTES = 116


def unique_names(names: Iterable[str]) -> list[str]:
    """Return stripped one-line names; a repeated one gets a number."""
    unique: list[str] = []
    for name in names:
        plain = " ".join(name.split()) or "_"
        candidate, number = plain, 1
        while candidate in (*unique, WAVELENGTH):
            number += 1
            candidate = f"{plain}_{number}"
        unique.append(candidate)
    return unique


def csv_text(wavelength_nm: PerWavelength, curves: Mapping[str, PerWavelength]) -> str:
    """Return curves as CSV that `read_curves` reads back exactly."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([WAVELENGTH, *unique_names(curves)])
    writer.writerows([repr(float(value)) for value in row] for row in zip(wavelength_nm, *curves.values(), strict=True))
    return text.getvalue()


def color_hints(channels: Sequence[str], bases: Mapping[str, str]) -> list[str]:
    """Return ISETCam's hint letter for each channel of a CFA, each used once (`k` when all are used).

    `channels`: channels; `C` is the clear pixel, ISETCam's `w`; `Cy` is its `c`; `bases`: modified channel to the
    replaced curve, whose color it takes if that is free.
    """
    hints: dict[str, str] = {}
    for channel in sorted(channels, key=lambda channel: channel in bases):  # a plain channel keeps its own letter
        hint_of_name = _column_hint(bases.get(channel, channel))
        free = [hint for hint in (*hint_of_name, *_FREE, *HINTS) if hint not in hints.values()]
        hints[channel] = free[0] if free else "k"
    return [hints[channel] for channel in channels]


def _column_hint(name: str) -> str:
    folded = name.casefold()
    if folded in _CLEAR:
        return "w"
    return folded[:1] if folded[:1] in HINTS else ""


def filter_names(hints: Sequence[str], channels: Iterable[str]) -> list[str]:
    """Return the names of ISETCam's filters: hint letter and channel."""
    return [hint + name for hint, name in zip(hints, unique_names(channels), strict=True)]


def isetcam_mat(
    wavelength_nm: PerWavelength,
    curves: Mapping[str, PerWavelength],
    hints: Sequence[str],
    tile: Int[IndexArray, "rows columns"],
    comment: str,
) -> bytes:
    """Return filters for ISETCam's `ieReadColorFilter` and `sensorCreate('custom', ...)`, MATLAB version 5.

    Variables: `wavelength` (a column, nm), `data` (n_wavelengths x n_filters), `filterNames` (a cell array: hint and
    name), `filterOrder` (the tile, from 1 on), `comment`. Equal filters give equal bytes.

    `curves`: QE of each channel, clipped to 1, since ISETCam rescales larger values.
    """
    from scipy.io import savemat  # noqa: PLC0415  (slow to import, seldom needed)

    names = filter_names(hints, curves)
    cells = np.empty((1, len(names)), dtype=object)
    cells[0] = names
    content = io.BytesIO()
    savemat(
        content,
        {
            "wavelength": wavelength_nm[:, None],
            "data": np.minimum(np.stack(list(curves.values()), axis=1), 1.0),
            "filterNames": cells,
            "filterOrder": (tile + 1).astype(float),
            "comment": comment,
        },
    )
    # SciPy's header holds the time.
    return _HEADER.ljust(_HEADER_BYTES) + content.getvalue()[_HEADER_BYTES:]
