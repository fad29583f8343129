"""Spectra of Ansys Speos as text: `.spectrum`, version 1.0.

The form: a title, a line that describes the spectrum, the number of samples, then a line of wavelength (nm) and value
(percent) each. Source: Ansys Optics, "Create spectrum file from graph". Version 2.0 is encrypted.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..base.disk import read_input
from ..base.errors import DataError, Fault
from ..base.types import FloatArray
from .scan import MOST_BYTES, MOST_SAMPLES, Scan, check_size
from .spectrum import sample_faults

_TITLE = "OPTIS - Spectrum file v1.0"
_TITLE_START = "optis - spectrum"
_PERCENT = 100.0
_HEAD_LINES = 3


def speos_text(wavelength_nm: FloatArray, values: FloatArray, about: str) -> str:
    """A curve, ndarray[n_wavelengths], 0..1, as Speos reads it; `about` describes it in ASCII, on one line."""
    plain = " ".join(about.split()).encode("ascii", "replace").decode("ascii")
    head = [_TITLE, plain, str(wavelength_nm.size)]
    rows = [f"{float(nm)!r}\t{float(share)!r}" for nm, share in zip(wavelength_nm, values * _PERCENT, strict=True)]
    return "\n".join([*head, *rows, ""])


def scan_speos(path: Path) -> Scan:
    """A spectrum of Speos, its percent as shares of 1; raises DataError where the file is none, or is encrypted."""
    file, content = str(path), read_input(path, MOST_BYTES, DataError)
    lines = content.decode("latin-1").splitlines()
    if not lines or not lines[0].strip().casefold().startswith(_TITLE_START):
        raise DataError(Fault("not a spectrum of Speos", file, 1, allowed=f"a first line {_TITLE!r}"))
    if b"\0" in content:
        raise DataError(Fault("an encrypted spectrum of Speos", file, allowed="version 1.0, which is text"))
    stated = lines[_HEAD_LINES - 1].strip() if len(lines) >= _HEAD_LINES else ""
    if not stated.isascii() or not stated.isdecimal() or len(stated) > len(str(MOST_SAMPLES)):
        raise DataError(Fault("no number of samples", file, _HEAD_LINES, value=stated, allowed="a whole number"))
    rows = [(at, line.split()) for at, line in enumerate(lines, 1) if at > _HEAD_LINES and line.strip()]
    if len(rows) != int(stated) or not rows:
        raise DataError(Fault("not as many samples as line 3 says", file, value=len(rows), allowed=stated))
    check_size(file, None, len(rows), 1)
    samples = np.array([_sample(file, at, cells) for at, cells in rows])
    wave, values = samples[:, 0], samples[:, 1:] / _PERCENT
    names = (path.stem,)
    notes = ("a spectrum of Speos: its percent as shares of 1",)
    return Scan(wave, names, values, tuple(map(tuple, sample_faults(file, wave, names, values))), notes)


def _sample(file: str, line: int, cells: list[str]) -> tuple[float, float]:
    try:
        wave, value = map(float, cells)
    except ValueError:
        allowed = "a wavelength in nm and a value in percent"
        raise DataError(Fault("not two numbers", file, line, value=" ".join(cells), allowed=allowed)) from None
    return wave, value
