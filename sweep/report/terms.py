"""Text of the report on constraints, defined terms and filter technologies."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from ..designs.technology import Technology
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.columns.tasks import PREFIX
from ..metrics.quantity import Column
from ..results.output import Output
from ..results.tables import NAMED, REFERENCE, SEARCHED, SWEPT
from .leaders import Row
from .words import joined, quantity

QE = "quantum efficiency"
_RELATIVE = 0.99
_NO_DEPTH = 1e-3


def format_constraint(output: Output, name: str, bound: Bound) -> str:
    """Format a constraint, for example `slope at most 0.06 per nm`."""
    words, column = named(output, name), output.columns.get(name)
    if bound.max is None:
        return f"{words} at least {_with_unit(column, bound.min)}"
    if bound.min is None:
        return f"{words} at most {_with_unit(column, bound.max)}"
    if bound.min == bound.max:
        return f"{words} of {_with_unit(column, bound.min)}"
    return f"{words} from {bound.min:g} to {_with_unit(column, bound.max)}"


def named(output: Output, name: str) -> str:
    """Return a constrained quantity in words of people."""
    column = output.columns.get(name)
    return quantity(column) if column is not None and column.metric.startswith(PREFIX) else output.words(name)


def format_bounded(column: Column, bound: Bound) -> str:
    """Format the limits of a quantity that is already named: `at most 0.06 per nm`."""
    words = {"at least": bound.min, "at most": bound.max}
    return " and ".join(f"{word} {_with_unit(column, limit)}" for word, limit in words.items() if limit is not None)


def _with_unit(column: Column | None, limit: float | None) -> str:
    """Format one end of a bound with the unit of its column: `0.06 per nm` for the unit `1/nm`."""
    unit = "" if column is None else column.unit
    return f"{limit:g} {unit.replace('1/', 'per ', 1)}".rstrip()


def format_constraints(output: Output) -> str:
    """Format all constraints of the study, joined by `and`.

    Empty without constraints.
    """
    return " and ".join(format_constraint(output, name, bound) for name, bound in output.constraints.items())


def format_missed_constraints(output: Output, row: Row) -> str:
    """Format the constraints that a row violates, for example `its sensitivity is below 0.9`.

    Empty if the row meets every constraint.
    """
    parts = list[str]()
    for name, bound in output.constraints.items():
        value = float(row[name])
        if math.isnan(value):
            verb = "" if parts else "is "
            parts.append(f"its {output.words(name)} {verb}unknown")
        for side, limit, sign in (("below", bound.min, -1), ("above", bound.max, 1)):
            if limit is not None and sign * (value - limit) / bound.scale > FEASIBLE:
                verb = "" if parts else "is "
                parts.append(f"its {output.words(name)} {verb}{side} {_with_unit(output.columns.get(name), limit)}")
    return " and ".join(parts)


def unknown_lines(output: Output) -> Iterator[str]:
    """Yield a sentence for each constrained quantity that is unknown (NaN) for some designs."""
    rows = output.kind(NAMED, SWEPT, SEARCHED)
    rows = rows[rows["status"] == "ok"]
    for name in output.constraints:
        unknown = rows[rows[name].isna()]
        if len(unknown):
            families = ", ".join(dict.fromkeys(map(str, unknown["family"])))
            yield f"Designs of {families} have no {output.words(name)}: unknown is not feasible."


def _technologies(output: Output, row: Row) -> list[Technology | None]:
    """Return the possible technologies of a row's filter: several for swept rows, none for a plain CFA."""
    study, search = output.study, output.provenance.search
    if row["kind"] == REFERENCE:
        return []
    if row["kind"] == NAMED:
        return [study.designs[row["name"]].technology]
    if row["kind"] == SEARCHED and search is not None:
        return [(study.sweeps | study.boxes)[search.space].technology]
    technologies = [sweep.technology for sweep in study.sweeps.values()]
    return list({repr(technology): technology for technology in technologies}.values())  # distinct ones, in order


def technology_of(output: Output, row: Row) -> Technology | None:
    """Return the technology of a row's filter.

    None if it is not stated or not unique.
    """
    candidates = _technologies(output, row)
    return candidates[0] if len(candidates) == 1 else None


def is_angle_dependent(output: Output, row: Row) -> bool:
    """Return whether the transmission of a row's filter may depend on the angle of incidence.

    True if any possible technology is an interference filter.
    """
    return any(t is not None and t.interference is not None for t in _technologies(output, row))


def colorants_of(output: Output, best: Row) -> Iterator[str]:
    """Yield the colorants of a filter with their absorbances, or the peak and width of its only modeled band."""
    names = list(output.curves.colorants)
    for slot in [name.removeprefix("colorant_") for name in output.parameters if name.startswith("colorant_")]:
        number, absorbance = float(best[f"colorant_{slot}"]), float(best[f"absorbance_{slot}"])
        if math.isfinite(number) and absorbance > 0:
            yield f"{names[round(number) - 1]} with an absorbance of {absorbance:.2f}"
    peak_nm, fwhm_nm = (float(best.get(name, math.nan)) for name in ("peak_nm", "fwhm_nm"))
    if math.isfinite(peak_nm) and math.isfinite(fwhm_nm):
        yield f"a band at {peak_nm:.0f} nm of {fwhm_nm:.0f} nm FWHM with an absorbance of {best['absorbance']:.2f}"


def response_of(curves: Mapping[str, np.ndarray]) -> str:
    """Return what a sensor's curves are: quantum efficiencies, or relative responses, whose largest is about 1."""
    top = max(float(curve.max()) for curve in curves.values())
    return "relative response" if top > _RELATIVE else QE


def edges_of(row: Row) -> tuple[tuple[float, float], ...]:
    """Return the edges of a stopband, nm, or of each of several that is not without effect; empty without any."""
    found = []
    for number in ("", *map(str, range(1, 10))):
        left, right = (float(row.get(f"{side}{number}_nm", math.nan)) for side in ("left", "right"))
        if math.isfinite(left) and math.isfinite(right) and row.get(f"depth{number}", 1) > _NO_DEPTH:
            found.append((left, right))
    return tuple(found)


def edges_in_words(edges: tuple[tuple[float, float], ...]) -> str:
    """Return edges as `edges at **613 and 651 nm**`; empty without any."""
    return f"edges at {' and at '.join(f'**{left:.0f} and {right:.0f} nm**' for left, right in edges)}" if edges else ""


def bound_conditions(output: Output) -> str:
    """Return the constraints under which a search's upper bound holds, in words."""
    search = output.provenance.search
    left_out = [] if search is None else [named(output, name) for name in search.upper_bound_left_out]
    return f"under the same constraints{f' except {joined(left_out)}' if left_out else ''}"
