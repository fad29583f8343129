"""Spectra as other programs exchange them: IES TM-27 (`.spdx`, XML) and the JSON of rawtoaces."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from ..base.disk import read_input
from ..base.errors import DataError, Fault
from .scan import MOST_BYTES, Scan, check_size, distinct
from .spectrum import sample_faults


def read_xml(path: Path, what: str) -> ElementTree.Element:
    """The root of an XML file that should be `what`; raises DataError for no XML, or XML with entities of its own."""
    file, content = str(path), read_input(path, MOST_BYTES, DataError)

    def refused(*_: object) -> None:
        raise DataError(Fault(f"not {what}", file, allowed="XML without entities of its own"))

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refused  # entities, which make a small file a large one, are declared there
    try:
        parser.Parse(content, True)
        return ElementTree.fromstring(content)
    except (expat.ExpatError, ElementTree.ParseError, ValueError, LookupError) as error:
        raise DataError(Fault(f"not readable XML: {error}", file)) from None


def scan_spdx(path: Path) -> Scan:
    """A spectrum of IES TM-27-14: `SpectralData` elements with the wavelength as attribute, nm.

    Raises DataError where the file is no such XML.
    """
    file, root = str(path), read_xml(path, "a spectrum of IES TM-27")
    rows = [(part.get("wavelength", ""), part.text or "") for part in root.iter() if _local(part.tag) == "SpectralData"]
    if not rows:
        raise DataError(Fault("not a spectrum of IES TM-27", file, allowed="elements SpectralData with a wavelength"))
    check_size(file, None, len(rows), 1)
    try:
        wave, values = (np.array([float(cell) for cell in cells]) for cells in zip(*rows, strict=True))
    except ValueError as error:
        raise DataError(Fault(f"not a number: {error}", file)) from None
    said = {_local(part.tag): (part.text or "").strip() for part in root.iter() if _local(part.tag) != "SpectralData"}
    name = said.get("Description") or path.stem
    quantity = f", {said['SpectralQuantity']}" if said.get("SpectralQuantity") else ""
    notes = (f"a spectrum of IES TM-27{quantity}",)
    groups = sample_faults(file, wave, [name], values[:, None])
    return Scan(wave, (name,), values[:, None], tuple(map(tuple, groups)), notes)


def _local(tag: str) -> str:
    return tag.rpartition("}")[2]


def scan_json(path: Path) -> Scan:
    """The `main` data of a rawtoaces file: columns of `index`, and a row per wavelength, nm. Raises DataError."""
    file, content = str(path), read_input(path, MOST_BYTES, DataError)
    try:
        data = json.loads(content.decode("utf-8-sig"))["spectral_data"]
        names, table = data["index"]["main"], data["data"]["main"]
        rows = sorted((float(nm), [float(v) for v in values]) for nm, values in table.items())
        names = [_text(name) for name in names]
        units = str(data.get("units", ""))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        allowed = "rawtoaces: `spectral_data` with `index` and `data`, each with `main`"
        raise DataError(Fault("not a file of spectra", file, allowed=allowed)) from None
    if not rows or any(len(values) != len(names) for _, values in rows):
        raise DataError(Fault("not as many values as names", file, value=names))
    check_size(file, None, len(rows), len(names))
    wave, values = np.array([nm for nm, _ in rows]), np.array([values for _, values in rows])
    columns = distinct(names)
    notes = (f"a rawtoaces file{f', {units}' if units else ''}",)
    return Scan(wave, columns, values, tuple(map(tuple, sample_faults(file, wave, columns, values))), notes)


def _text(name: Any) -> str:
    if not isinstance(name, str):
        raise TypeError
    return name
