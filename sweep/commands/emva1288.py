"""The figures of a pixel out of EMVA 1288 results: the XML that the standard's reference implementation writes.

Each result is an element of a section, with its `Value` and `Unit`. Source: EMVA1288/emva1288, "Results Comparison".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

from pydantic import ValidationError

from ..base.disk import read_input
from ..base.errors import DataError, Fault
from ..camera.pixel import Pixel
from ..curves.scan import MOST_BYTES

_WHAT = "EMVA 1288 results"


@dataclass(frozen=True)
class _Result:
    """A result of the standard, the pixel's figure that it is, its unit without markup, and the factor between them."""

    name: str
    key: str
    units: tuple[str, ...]
    factor: float = 1.0


_RESULTS = (
    _Result("u_e_sat", "well_e", ("e-", "e")),
    _Result("K", "gain_dn_per_e", ("DN/e-", "DN/e")),
    _Result("sigma_d", "read_noise_e", ("e-", "e")),
    _Result("u_I_mean", "dark_e_per_s", ("e-/s", "e/s")),
    _Result("PRNU1288", "prnu", ("%",), 0.01),
)


@dataclass(frozen=True)
class PixelFigures:
    """Keys of `pixel:` with what a file says of them, and those that it says nothing of."""

    given: Mapping[str, float]
    missing: tuple[str, ...]


def pixel_lines(path: Path) -> list[str]:
    """`pixel:` of a study with what the file says of it, and what it does not say; errors as for `pixel_figures`."""
    found = pixel_figures(path)
    told = ", ".join(f"{key}: {value:.12g}" for key, value in found.given.items())
    return [
        f"{path}: {_WHAT}. In a study:",
        f"pixel: {{{told}}}",
        f"Not in the file, and to be added: {', '.join(found.missing)}.",
    ]


def pixel_figures(path: Path) -> PixelFigures:
    """What the file says of a pixel.

    Raises DataError for a file without such results, a result of another unit, and a figure that no pixel has.
    """
    root, file = read_xml(path), str(path)
    found: dict[str, float] = {}
    missing = []
    for result in _RESULTS:
        value = None if root.tag != "results" else _value(file, root.findall(f"*/{result.name}"), result)
        if value is None:
            missing.append(result.key)
        else:
            found[result.key] = value
    if not found:
        raise DataError(Fault(f"not {_WHAT}", file, allowed="`results` with " + ", ".join(r.name for r in _RESULTS)))
    try:
        Pixel.model_validate(found)
    except ValidationError as error:
        first = error.errors()[0]
        key = str(first["loc"][0]) if first["loc"] else None
        raise DataError(
            Fault("not a pixel's figure", file, key=key, value=first["input"], allowed=first["msg"])
        ) from None
    return PixelFigures(found, (*missing, "bits", "offset_dn", "pitch_um"))


def read_xml(path: Path) -> ElementTree.Element:
    """Return the root of an XML file; raises DataError for no XML, or XML with entities of its own."""
    file, content = str(path), read_input(path, MOST_BYTES, DataError)

    def refused(*_: object) -> None:
        raise DataError(Fault(f"not {_WHAT}", file, allowed="XML without entities of its own"))

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refused  # entities, which make a small file a large one, are declared there
    try:
        parser.Parse(content, True)
        return ElementTree.fromstring(content)
    except (expat.ExpatError, ElementTree.ParseError, ValueError, LookupError) as error:
        raise DataError(Fault(f"not readable XML: {error}", file)) from None


def _value(file: str, elements: list[Element], result: _Result) -> float | None:
    """The one value of a result; None where there is none, or NaN."""
    if not elements:
        return None
    if len(elements) > 1:
        raise DataError(Fault("a result is there twice", file, key=result.name))
    said = (elements[0].findtext("Value") or "").strip()
    unit = "".join(c for c in elements[0].findtext("Unit") or "" if c not in "$\\^{} \n\t")
    if unit not in result.units:
        raise DataError(Fault("another unit", file, key=result.name, value=unit, allowed=result.units[0]))
    try:
        value = float(said) * result.factor
    except ValueError:
        raise DataError(Fault("not a number", file, key=result.name, value=said)) from None
    return None if math.isnan(value) else value
