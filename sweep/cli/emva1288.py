"""Figures of a pixel from EMVA 1288 results: the XML that the standard's reference implementation writes.

Each result is an element of a section, with its `Value` and `Unit`. Source: EMVA1288/emva1288, "Results Comparison".
"""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from pydantic import ValidationError

from ..base.disk import read_input
from ..base.errors import DataError, ValidationIssue
from ..camera.pixel import Pixel
from ..spectra.read_text import MOST_BYTES

_RESULTS = {
    "u_e_sat": ("well_e", ("e-", "e"), 1.0),
    "K": ("gain_dn_per_e", ("DN/e-", "DN/e"), 1.0),
    "sigma_d": ("read_noise_e", ("e-", "e"), 1.0),
    "u_I_mean": ("dark_e_per_s", ("e-/s", "e/s"), 1.0),
    "PRNU1288": ("prnu", ("%",), 0.01),
}
"""Result of the standard -> key of `pixel:`, its units without markup, and the factor between them."""


def pixel_lines(path: Path) -> list[str]:
    """Convert EMVA 1288 results to the section `pixel:` of a study.

    Parameters
    ----------
    path : Path
        XML file of the results.

    Returns
    -------
    list of str
        The section, and the keys that the file does not state.

    Raises
    ------
    DataError
        As `pixel_figures`.
    """
    figures, missing = pixel_figures(path)
    text = ", ".join(f"{key}: {value:.12g}" for key, value in figures.items())
    return [
        f"{path}: EMVA 1288 results. In a study:",
        f"pixel: {{{text}}}",
        f"Not in the file, and to be added: {', '.join(missing)}.",
    ]


def pixel_figures(path: Path) -> tuple[dict[str, float], list[str]]:
    """Read the keys of `pixel:` from EMVA 1288 results.

    Parameters
    ----------
    path : Path
        XML file of the results.

    Returns
    -------
    tuple
        Values by key, and keys that the file does not state.

    Raises
    ------
    DataError
        If the file has no such results, or an unknown unit or an impossible value.
    """
    root, figures, missing = read_xml(path), {}, []
    for name, (key, units, factor) in _RESULTS.items():
        elements = root.findall(f"*/{name}") if root.tag == "results" else []
        if len(elements) > 1:
            raise DataError(ValidationIssue("a result is there twice", str(path), key=name))
        value = _value(path, elements[0], units) * factor if elements else math.nan
        if math.isnan(value):
            missing.append(key)
        else:
            figures[key] = value
    if not figures:
        raise DataError(
            ValidationIssue("not EMVA 1288 results", str(path), allowed="`results` with " + ", ".join(_RESULTS))
        )
    try:
        Pixel.model_validate(figures)
    except ValidationError as error:
        first = error.errors()[0]
        where = str(first["loc"][0]) if first["loc"] else None
        issue = ValidationIssue(
            "not a pixel's figure", str(path), key=where, value=first["input"], allowed=first["msg"]
        )
        raise DataError(issue) from None
    return figures, [*missing, "bits", "offset_dn", "pitch_um"]


def _value(path: Path, element: ElementTree.Element, units: tuple[str, ...]) -> float:
    text = (element.findtext("Value") or "").strip()
    unit = "".join(c for c in element.findtext("Unit") or "" if c not in "$\\^{} \n\t")
    if unit not in units:
        raise DataError(ValidationIssue("another unit", str(path), key=element.tag, value=unit, allowed=units[0]))
    try:
        return float(text)
    except ValueError:
        raise DataError(ValidationIssue("not a number", str(path), key=element.tag, value=text)) from None


def read_xml(path: Path) -> ElementTree.Element:
    """Parse an XML file without entities.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    Element
        The root element.

    Raises
    ------
    DataError
        If the file is not XML or defines entities.
    """
    file, content = str(path), read_input(path, MOST_BYTES, DataError)

    def refuse(*_: object) -> None:
        raise DataError(ValidationIssue("not EMVA 1288 results", file, allowed="XML without entities of its own"))

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse  # entities, which make a small file a large one, are declared there
    try:
        parser.Parse(content, True)
        return ElementTree.fromstring(content)
    except (expat.ExpatError, ElementTree.ParseError, ValueError, LookupError) as error:
        raise DataError(ValidationIssue(f"not readable XML: {error}", file)) from None
