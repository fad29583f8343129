"""Description of a file of curves: lines for a person, and a picture."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ...base.answer import Answer
from ...base.disk import read_input
from ...base.errors import DataError, OutputError, ValidationIssue
from ...report.panels import Lines, axis_over, png
from ...results.atomic import write_bytes
from ...spectra.facts import Curve, Facts, facts_of, merge_equal_issues, notes
from ...spectra.formats import curves_from, scan_curves
from ...spectra.signal_color import LightColor
from ...spectra.spectrum import Quantity
from ...spectra.units import FITTING, Use, stated_quantity, used_as

_MOST_NAMES, _MOST_DRAWN = 12, 16
_MOST_PICTURE = 100_000_000
_USES: dict[str, Use] = {"qe": "sensor", "filters": "filter", "surfaces": "surface", "lights": "light"}
_NAMES = {"qe": "QE of a sensor", "filters": "filters", "surfaces": "surfaces", "lights": "light spectra"}
_SOFTWARE = "sweep describe"
"""Software that a picture names in its first bytes: by this it is known to be a description's."""


def describe(file: Path | str, *, output: Path | str = "outputs/describe", quantity: str | None = None) -> Answer:
    """Plot and check a file of curves: contents, issues, colors of its lights.

    Parameters
    ----------
    file : path-like
        A file or folder of curves.
    output : path-like
        Folder of the picture, ``<stem of the file>.png``.
    quantity : str, optional
        Unit of the numbers, such as qe or energy; left out, what the heads say, else lights (in energy) or QE are
        guessed.

    Returns
    -------
    Answer
        What the file holds; a problem with the issues for which studies refuse it.

    Raises
    ------
    SweepError
        If nothing can be read, or the picture cannot be written.
    """
    path, folder, stated = Path(file), Path(output), stated_quantity(quantity) if quantity else None
    lines, issues, facts = _described(path, folder, stated)
    values = {"file": str(file), **facts, "faults": [str(issue) for issue in issues]}
    return Answer(lines, values, DataError(issues) if issues else None)


def _described(
    path: Path, folder: Path, quantity: Quantity | None
) -> tuple[list[str], Sequence[ValidationIssue], dict[str, Any]]:
    """Return lines to print, issues for which studies refuse a file, and plain values."""
    scan = scan_curves(path)
    issues: Sequence[ValidationIssue] = merge_equal_issues(list(chain.from_iterable(scan.issues)))
    facts = facts_of(scan)
    names = [curve.name for curve in facts.curves]
    lines = [f"{path}: {len(names)} curve{'' if len(names) == 1 else 's'}{': ' if names else ''}{_shown(names)}."]
    if not any(curve.values.size for curve in facts.curves):
        return [*lines, "Nothing in it can be drawn."], issues, {"curves": []}
    lines += [f"Read: {note}." for note in scan.notes]
    kind = _kind(facts, quantity)
    colors: dict[str, LightColor | None] = {}
    for unit in ("energy", "photons") if kind == "lights" else ():
        of_unit = facts.colors(unit)
        colors |= {
            curve.name: of_unit[curve.name]
            for curve in facts.curves
            if unit == (quantity or curve.unit.quantity or "energy")
        }
    lines += [_range(facts), _guess(facts, quantity, kind)]
    width = min(max(map(len, names)), 40)
    lines += [f"  {curve.name:<{width}}  {_curve(curve, colors)}" for curve in facts.curves]
    if quantity == "photons":
        energy = facts.colors("energy").items()
        words = [f"{name} {color.xy[0]:.4f} {color.xy[1]:.4f}" for name, color in energy if color is not None]
        lines += [f"  the same numbers as energy would be at xy: {'; '.join(words)}"] if words else []
    if not issues:
        try:
            taken = used_as(curves_from(scan, path), scan.names, _USES[kind], quantity)
            lines += [f"Read: {note}." for note in taken.notes[len(scan.notes) :]]
        except DataError as error:
            issues = error.issues
    lines += [f"Note: {note}." for note in notes(facts, as_qe=kind == "qe")]
    if not issues:
        lines.append("Its samples are clean: a study can read it.")
    picture = folder / f"{path.stem}.png"
    if os.path.lexists(picture) and _SOFTWARE.encode() not in read_input(picture, _MOST_PICTURE, OutputError)[:200]:
        raise OutputError(ValidationIssue("holds something else already", str(picture), allowed="another --output"))
    write_bytes(_png(path.name, facts), picture)
    values = {
        "kind": kind,
        "picture": str(picture),
        "curves": [_curve_facts(curve, colors.get(curve.name)) for curve in facts.curves],
    }
    return [*lines, f"Picture: {picture}"], issues, values


def _png(title: str, facts: Facts) -> bytes:
    """Return a picture of the curves; of many an even sample."""
    from PIL import Image, PngImagePlugin  # noqa: PLC0415  (slow to import)

    shown = facts.curves[:: -(-len(facts.curves) // _MOST_DRAWN)]
    if len(shown) < len(facts.curves):
        title = f"{title}: {len(shown)} of {len(facts.curves):,} curves"
    lines = {curve.name: (curve.wavelength_nm, curve.values) for curve in shown}
    across, up = (np.concatenate([line[at] for line in lines.values()]) for at in (0, 1))
    x = axis_over("wavelength", "nm", across, zero=False, log=False)
    panel = Lines(f"{title}: value in the file", x, axis_over("value in the file", "", up, log=False), lines=lines)
    buffer, told = BytesIO(), PngImagePlugin.PngInfo()
    told.add_text("Software", _SOFTWARE)
    Image.open(BytesIO(png([panel]))).save(buffer, format="png", pnginfo=told)
    return buffer.getvalue()


def _curve_facts(curve: Curve, color: LightColor | None) -> dict[str, Any]:
    """Largest value of a curve, where it is, and the color of a light."""
    peak = {"largest": curve.values.max(), "at_nm": curve.peak_nm} if curve.values.size else {}
    hue = (
        {}
        if color is None
        else {"xy": color.xy, "dominant_nm": color.dominant_nm, "region": color.region, "markers": [*color.markers]}
    )
    return {"name": curve.name, **peak, **hue}


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
    return f"Wavelengths: {wave[0]:g} to {wave[-1]:g} nm, {step}, {wave.size:,} samples."


def _kind(facts: Facts, quantity: Quantity | None) -> str:
    """Return what curves are: as stated, as heads say, or as their shapes look."""
    told = {quantity} if quantity else {curve.unit.quantity for curve in facts.curves} - {None}
    for kind, use in _USES.items():
        if told and told <= set(FITTING[use]):
            return kind
    return "qe" if facts.is_likely_qe else "lights"


def _guess(facts: Facts, quantity: Quantity | None, kind: str) -> str:
    if quantity is not None:
        return f"Read as {_NAMES[kind]}, as --quantity {quantity} says."
    if any(curve.unit.quantity for curve in facts.curves):
        return f"By the heads of its columns: {_NAMES[kind]}."
    broad, top = np.median([c.width_nm for c in facts.curves]), max(c.peak for c in facts.curves)
    reason = (
        f"a typical curve is {broad:.0f} nm wide (integral over peak, 400 to 700 nm), the largest value is {top:.6g}"
    )
    if kind == "qe":
        return f"A guess: QE of a sensor, for {reason}. `--quantity energy` reads it as lights."
    return f"A guess: light spectra, for {reason}. Read as energy; `--quantity photons` reads photons."


def _curve(curve: Curve, colors: Mapping[str, LightColor | None]) -> str:
    """Largest value of a curve and where it is, its mean, and its color where it is a light."""
    if not curve.values.size:
        return "no sample can be used"
    unit = f" {curve.unit.words}" if curve.unit.words else ""
    text = f"largest {curve.values.max():<9.6g} at {curve.peak_nm:g} nm, mean {curve.mean:.4g}{unit}"
    return f"{text}  {_color_words(colors.get(curve.name))}" if colors else text


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
    also = "".join(f", also of {name}" for name in color.markers)
    return f"xy {color.xy[0]:.4f} {color.xy[1]:.4f}, dominant {hue}, {region}{also}"
