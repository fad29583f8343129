"""How designs are called where people read them."""

from __future__ import annotations


def label(row: dict[object, object]) -> str:
    """A design's name, or its number."""
    return str(row["name"]) if isinstance(row["name"], str) else f"design {row['design_id']}"
