"""What every column of the result table means, as the documentation prints it."""

from __future__ import annotations

from ..metrics.quantity import Asked
from ..metrics.registry import listed

_KEYS = {
    (
        "design_id",
        "kind",
        "name",
        "cfa",
        "family",
        "scenario",
    ): "which design in which scene: a plain CFA "
    "(`reference`), a named design, one that was swept, or the search's answer",
    ("left_nm, ...",): "parameters of the families, unit in the name",
}
_VERDICTS = {
    ("feasible", "violation"): "whether all constraints are met, and the largest relative violation",
    ("objective",): "the study's objective, where it is of several quantities",
    ("limit", "gap"): "of the search's answer: what no filter exceeds (between the least transmission and the replaced "
    "curve, same constraints, before clipping and quantization; a design may read a little more after rounding), and "
    "how far below it the answer is",
    ("pareto",): "not dominated in separation and sensitivity among the designs of its CFA and scenario that meet "
    "every constraint but those on these two",
    (
        "plan",
        "promised_dn",
    ): "how the scene was simulated (`provenance.json` says it in full), and what that changes "
    "at most in any CSD, also at the best place and with shifted edges",
    ("status",): "`ok`, or what failed",
}
_WORST = (
    "the worst case of a CSD or sensitivity over edges that production shifts (five places from one end to the other)"
)
KEYS = tuple(name for names in (*_KEYS, *_VERDICTS) for name in names)
"""Columns that are no quantities of a metric."""


def columns_table() -> list[str]:
    """A table of Markdown: column, unit, meaning; `<a>`, `<b>` stand for any two signal types."""
    types = ("<a>", "<b>")
    rows = [_row(names, "", meaning) for names, meaning in _KEYS.items()]
    for quantity in listed(Asked(types, types, any_place=True)):
        rows.append(_row((quantity.name,), quantity.unit, quantity.meaning))
    rows.append(_row(("worst_<quantity>",), "", _WORST))
    rows += [_row(names, "", meaning) for names, meaning in _VERDICTS.items()]
    return ["| column | unit | meaning |", "| --- | --- | --- |", *rows]


def _row(names: tuple[str, ...], unit: str, meaning: str) -> str:
    return f"| {', '.join(f'`{name}`' for name in names)} | {unit} | {meaning} |"
