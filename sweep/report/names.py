"""Names of designs in sentences and tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..results.output import Output
from ..results.tables import FOUND, NAMED, PLAIN


def of_reference(output: Output) -> str:
    """The light that a whole CFA's is told in: a clear sensor's, or that of the brightest curve in every pixel."""
    sensor = output.provenance.sensor
    return "of a clear sensor's light" if sensor.has_clear else f"of the light of {sensor.reference} pixels alone"


def label(row: Mapping[Any, Any]) -> str:
    """A design's name, or its number."""
    return str(row["name"]) if isinstance(row["name"], str) else f"filter {row['filter_id']}"


def capital(text: str) -> str:
    """A sentence's beginning, in upper case."""
    return text[:1].upper() + text[1:]


def full_name(row: Mapping[Any, Any]) -> str:
    """Its name in a sentence: a CFA or named design by its name, others with the CFA that they are made in."""
    if row["kind"] in (PLAIN, NAMED):
        return label(row)
    return f"the {label(row)} of {row['cfa']}" if row["kind"] == FOUND else f"{label(row)} of {row['cfa']}"


def rate_told(rate: float) -> str:
    """A separation for each millisecond of exposure."""
    return f"{rate:.{0 if rate >= 100 else 1}f}"
