"""Assign columns of a file of lights to signal types by their colors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import DataError, ValidationIssue
from . import LightUnit
from .facts import Curve, Facts, facts_of, merge_equal_issues
from .files import scan_curves
from .signal_color import LightColor
from .spectrum import WavelengthGrid

_SIGNAL_COLORS = ("green", "yellow", "orange", "red")
"""Signal types in the order of a study."""
MOST_LETTERS = 100
"""Longest name that is made of a file's."""
_USUAL = WavelengthGrid()


@dataclass(frozen=True)
class LightsFile:
    """Lights of a file: columns of each signal type with their colors, other columns with the reason.

    `ends_early`: the file ends inside the wavelengths of the study; `fine`: it is finer than 1 nm.
    """

    name: str
    quantity: LightUnit
    types: Mapping[str, Mapping[str, LightColor | None]]
    left_out: Mapping[str, str]
    ends_early: bool
    fine: bool

    def keys(self, file: str) -> dict[str, Any]:
        """Return the keys of a study for these lights.

        Parameters
        ----------
        file : str
            Path as the study names it.

        Returns
        -------
        dict
            Keys.
        """
        entry: dict[str, Any] = {"file": file, "quantity": self.quantity}
        entry["signals"] = {kind: list(columns) for kind, columns in self.types.items()}
        entry |= {"outside": "zero"} if self.ends_early else {}
        entry |= {"resampling": "mean"} if self.fine else {}
        return {"name": self.name, "files": [entry]}


def clean_curves(path: Path) -> dict[str, Curve]:
    """Return clean curves by column name.

    Parameters
    ----------
    path : Path
        File.

    Returns
    -------
    dict of str to Curve
        Curves.

    Raises
    ------
    DataError
        If curves are not clean, with all issues.
    """
    scan = scan_curves(path)
    if scan.issues:
        raise DataError(merge_equal_issues(list(chain.from_iterable(scan.issues))))
    return dict(zip(scan.names, facts_of(scan).curves, strict=True))


def lights_file(path: Path, quantity: LightUnit, start_nm: float = 400, stop_nm: float = 700) -> LightsFile:
    """Return the lights of a file by their colors.

    Parameters
    ----------
    path : Path
        File.
    quantity : {'energy', 'photons'}
        Unit of the values.
    start_nm, stop_nm : float
        Wavelengths of the study, nm.

    Returns
    -------
    LightsFile
        Lights.

    Raises
    ------
    DataError
        If there are fewer than two signal colors.
    """
    curves = clean_curves(path)
    colors = dict(zip(curves, Facts(tuple(curves.values()), "").colors(quantity).values(), strict=True))
    signals = {name: None if color is None else color.signal for name, color in colors.items()}
    types = {kind: {name: colors[name] for name in curves if signals[name] == kind} for kind in _SIGNAL_COLORS}
    used = {kind: columns for kind, columns in types.items() if columns}
    left_out = {}
    for name, color in colors.items():
        if color is None:
            left_out[name] = "no visible light"
        elif signals[name] is None:
            left_out[name] = f"xy {color.xy[0]:.3f} {color.xy[1]:.3f} is near no signal color"
    if len(used) < 2:
        listed = "; ".join(f"{kind}: {', '.join(columns)}" for kind, columns in used.items()) or "none"
        problem = f"lights of one signal color or none (`sweep describe {path}` shows where they lie)"
        raise DataError(
            ValidationIssue(problem, str(path), None, None, listed, "two of green, yellow, orange, red, or more")
        )
    wave = next(iter(curves.values())).wavelength_nm
    ends_early = bool(wave[0] > start_nm or wave[-1] < stop_nm)
    fine = bool(np.diff(wave).min() < _USUAL.step_nm)
    return LightsFile(path.stem[:MOST_LETTERS], quantity, used, left_out, ends_early, fine)
