"""How people head a column of wavelengths, and in which unit."""

from __future__ import annotations

import re

WAVELENGTH = "wavelength_nm"
"""How the package itself writes it."""
_WORDS = (
    *("wavelength", "wavelengths", "wave length", "wave", "wvl", "wl", "lambda", "\u03bb"),
    *(
        "wellenl\u00e4nge",
        "wellenlaenge",
        "longueur d'onde",
        "longitud de onda",
        "lunghezza d'onda",
        "comprimento de onda",
    ),
)
_UNITS_NM = {
    **dict.fromkeys(("nm", "nanometer", "nanometers", "nanometre", "nanometres"), 1.0),
    **dict.fromkeys(("um", "\u00b5m", "\u03bcm", "micron", "microns", "micrometer", "micrometers"), 1e3),
    **dict.fromkeys(("\u00e5", "angstrom", "angstroms"), 0.1),
    "m": 1e9,
}
_PARTS = re.compile(r"(.*?)[\s_/,.\-]*[\[(]?\s*([^\W\d_]+)\s*[\])]?")
_SAID = {1.0: "nm", 1e3: "um", 0.1: "angstrom", 1e9: "m"}


def wavelength_unit(cell: str) -> float | None:
    """What brings a column with this head to nm: 1 for `nm`, `Wavelength (nm)`; 0 where no unit is said.

    None for a head that is none of wavelengths.
    """
    text = " ".join(cell.replace("\u212b", "\u00e5").split()).casefold()
    if text in _WORDS:
        return 0.0
    match = _PARTS.fullmatch(text)
    if match is None or match[2] not in _UNITS_NM:
        return None
    return _UNITS_NM[match[2]] if not match[1] or match[1].strip() in _WORDS else None


def is_unit(cell: str) -> bool:
    """Whether a cell below a head is the unit alone: `nm`, `[nm]`."""
    return cell.strip().strip("[]()").casefold() in _UNITS_NM


def unit_words(factor: float) -> str:
    """The unit as people write it."""
    return _SAID[factor]
