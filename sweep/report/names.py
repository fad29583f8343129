"""How designs are called where people read them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..results.tables import FOUND, NAMED, PLAIN


def label(row: Mapping[Any, Any]) -> str:
    """A design's name, or its number."""
    return str(row["name"]) if isinstance(row["name"], str) else f"design {row['design_id']}"


def capital(text: str) -> str:
    """A sentence's beginning, in upper case."""
    return text[:1].upper() + text[1:]


def full_name(row: Mapping[Any, Any]) -> str:
    """Its name in a sentence: a CFA or named design by its name, others with the CFA that they are made in."""
    if row["kind"] in (PLAIN, NAMED):
        return label(row)
    return f"the {label(row)} of {row['cfa']}" if row["kind"] == FOUND else f"{label(row)} of {row['cfa']}"
