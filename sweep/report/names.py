"""How columns, values and designs are called where people read them."""

from __future__ import annotations

from ..metrics.evaluate import WORST
from ..metrics.separation import CSD


def readable(column: str) -> str:
    """A column's name as people write it."""
    worst = worst_case(column)
    plain = column.removeprefix(WORST)
    if plain.startswith(CSD):
        return worst + plain.removeprefix(CSD).replace("_", "/") + " CSD"
    return worst + {"cfa_sensitivity": "CFA sensitivity"}.get(plain, plain)


def worst_case(column: str) -> str:
    """How the name of a worst case over an edge shift begins; empty for other columns."""
    return "worst-case " if column.startswith(WORST) else ""


def axis_label(column: str) -> str:
    """A quantity's name with its unit, if it has one."""
    return readable(column) + (" / DN" if CSD in column else "")


def amount(column: str, value: float, digits: int = 0) -> str:
    """A quantity's value with its unit; ratios, and combined objectives, have none and four digits."""
    return f"{value:.{digits}f} DN" if CSD in column else f"{value:.4f}"


def label(row: dict[object, object]) -> str:
    """A design's name, or its number."""
    return str(row["name"]) if isinstance(row["name"], str) else f"design {row['design_id']}"
