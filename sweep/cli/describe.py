"""Description of a file of curves: lines for a person, and a picture."""

from __future__ import annotations

import os
import shlex
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ..base.disk import read_input
from ..base.errors import DataError, OutputError, ValidationIssue
from ..results.atomic import write_bytes, write_text
from ..spectra import LightUnit
from ..spectra.facts import Curve, Facts, facts_of, merge_equal_issues, notes, repair_curves
from ..spectra.files import scan_curves
from ..spectra.signal_color import LightColor
from .describe_picture import draw

_MOST_NAMES = 12
_MOST_PICTURE = 100_000_000
_SOFTWARE = "sweep describe"
"""Software that a picture names in its first bytes: by this it is known to be a description's."""


@dataclass(frozen=True)
class Description:
    """A described file: lines to print, issues for which studies refuse it, and the same as plain values."""

    lines: tuple[str, ...]
    issues: tuple[ValidationIssue, ...]
    facts: Mapping[str, Any]


def described(path: Path, folder: Path, quantity: LightUnit | None = None) -> Description:
    """Describe a CSV or `.mat` file of curves and plot it as `<folder>/<stem>.png`.

    Parameters
    ----------
    path : Path
        The file.
    folder : Path
        Folder of the picture.
    quantity : LightUnit, optional
        Lights in energy or photons; by default lights (in energy) or QE are guessed.

    Returns
    -------
    Description
        Text and JSON object.

    Raises
    ------
    DataError
        If nothing can be read.
    OutputError
        If the picture cannot be written, or a file of that name is no picture of a description.
    """
    scan = scan_curves(path)
    issues = tuple(merge_equal_issues(list(chain.from_iterable(scan.issues))))
    facts = facts_of(scan)
    names = [curve.name for curve in facts.curves]
    lines = [f"{path}: {len(names)} curve{'' if len(names) == 1 else 's'}{': ' if names else ''}{_shown(names)}."]
    if not any(curve.values.size for curve in facts.curves):
        return Description((*lines, "Nothing in it can be drawn."), issues, {"curves": []})
    lines += [f"Read: {note}." for note in scan.notes]
    as_qe = facts.is_likely_qe and quantity is None
    colors = {} if as_qe else facts.colors(quantity or "energy")
    lines += [_range(facts), _guess(facts, quantity)]
    width = min(max(map(len, names)), 40)
    lines += [f"  {curve.name:<{width}}  {_curve(curve, colors)}" for curve in facts.curves]
    if quantity == "photons":
        energy = facts.colors("energy").items()
        words = [f"{name} {color.xy[0]:.4f} {color.xy[1]:.4f}" for name, color in energy if color is not None]
        lines += [f"  the same numbers as energy would be at xy: {'; '.join(words)}"] if words else []
    lines += [f"Note: {note}." for note in notes(facts, as_qe=as_qe)]
    if not issues:
        lines.append("Its samples are clean: a study can read it.")
    elif repair_curves(scan).issues == ():
        lines.append(f"`sweep describe {shlex.quote(str(path))} --clean NEW.csv` writes a file that a study can read.")
    picture = folder / f"{path.stem}.png"
    if os.path.lexists(picture) and _SOFTWARE.encode() not in read_input(picture, _MOST_PICTURE, OutputError)[:200]:
        raise OutputError(ValidationIssue("holds something else already", str(picture), allowed="another --output"))
    write_bytes(_png(path.name, facts, colors), picture)
    values = {
        "kind": "qe" if as_qe else "lights",
        "picture": str(picture),
        "curves": [_curve_facts(curve, colors.get(curve.name)) for curve in facts.curves],
    }
    return Description((*lines, f"Picture: {picture}"), issues, values)


def _png(title: str, facts: Facts, colors: Mapping[str, LightColor | None]) -> bytes:
    buffer = BytesIO()
    with warnings.catch_warnings(), np.errstate(over="ignore"):
        warnings.filterwarnings("ignore", "Glyph")  # names in scripts that the font lacks
        draw(title, facts, colors).savefig(buffer, format="png", dpi=160, metadata={"Software": _SOFTWARE})
    return buffer.getvalue()


def _curve_facts(curve: Curve, color: LightColor | None) -> dict[str, Any]:
    """Largest value of a curve, where it is, and the color of a light."""
    peak = {"largest": curve.values.max(), "at_nm": curve.peak_nm} if curve.values.size else {}
    hue = {} if color is None else {"xy": color.xy, "dominant_nm": color.dominant_nm, "region": color.region}
    return {"name": curve.name, **peak, **hue}


def clean_file(path: Path, to: Path) -> list[str]:
    """Write the curves of a file as clean CSV.

    Parameters
    ----------
    path : Path
        The file.
    to : Path
        The file to write.

    Returns
    -------
    list of str
        What was changed.

    Raises
    ------
    DataError
        If the file has a problem that no rule solves.
    OutputError
        If `to` exists or cannot be written.
    """
    scan = scan_curves(path)
    clean = repair_curves(scan)
    if clean.issues:
        raise DataError(merge_equal_issues([replace(issue, file=str(path)) for issue in clean.issues]))
    if os.path.lexists(to):
        raise OutputError(ValidationIssue("is there already, and stays as it is", str(to), allowed="another --clean"))
    write_text(clean.text(path.name, scan.notes), to)
    changes = clean.changes or ("nothing",)
    return [*(f"Read: {n}." for n in scan.notes), *(f"Changed: {change}." for change in changes), f"Clean: {to}"]


def _shown(names: Sequence[str]) -> str:
    if len(names) <= _MOST_NAMES:
        return ", ".join(names)
    return f"{', '.join(names[: _MOST_NAMES - 1])}, ... {names[-1]}"


def _range(facts: Facts) -> str:
    wave = facts.samples_nm
    steps = np.round(np.diff(wave), 6)
    if not steps.size:
        return f"Wavelengths: one sample, at {wave[0]:g} nm."
    step = f"step {steps.min():g} nm"
    if steps.max() > steps.min():
        step = f"steps of {steps.min():g} to {steps.max():g} nm"
    read_as = f" ({facts.read_as})" if facts.read_as else ""
    return f"Wavelengths: {wave[0]:g} to {wave[-1]:g} nm{read_as}, {step}, {wave.size:,} samples."


def _guess(facts: Facts, quantity: LightUnit | None) -> str:
    if quantity is not None:
        return f"Read as light spectra in {quantity}, as --quantity says."
    broad, top = np.median([c.width_nm for c in facts.curves]), max(c.peak for c in facts.curves)
    reason = (
        f"a typical curve is {broad:.0f} nm wide (integral over peak, 400 to 700 nm), the largest value is {top:.6g}"
    )
    if facts.is_likely_qe:
        return f"A guess: QE of a sensor, for {reason}. `--quantity energy` reads it as lights."
    return f"A guess: light spectra, for {reason}. Read as energy; `--quantity photons` reads photons."


def _curve(curve: Curve, colors: Mapping[str, LightColor | None]) -> str:
    """Largest value of a curve, and its color where it is a light."""
    if not curve.values.size:
        return "no sample can be used"
    text = f"largest {curve.values.max():<9.6g} at {curve.peak_nm:g} nm"
    return f"{text}  {_color_words(colors[curve.name])}" if colors else text


def _color_words(color: LightColor | None) -> str:
    """Chromaticity, dominant wavelength and region of EN 12368 of a light."""
    if color is None:
        return "no visible light"
    hue = "white" if color.purity < 1e-3 else "purple" if color.dominant_nm is None else f"{color.dominant_nm:g} nm"
    if color.region == "orange":
        region = "orange, between EN 12368's red and yellow"
    elif color.region is not None:
        region = f"{color.region} of EN 12368"
    else:
        region = f"in no region of EN 12368, {color.distance:.3f} from {color.nearest}"
    return f"xy {color.xy[0]:.4f} {color.xy[1]:.4f}, dominant {hue}, {region}"
