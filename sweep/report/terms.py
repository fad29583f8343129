"""Text of the report on constraints, defined terms and filter technologies."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..camera.scene import Scene
from ..designs.technology import Technology
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.quantity import DN, Column
from ..results.output import Output
from ..results.tables import NAMED, REFERENCE, SEARCHED, SWEPT
from .leaders import Row, capital
from .values import modifications

_NO_TECHNOLOGY = "Filters without a stated technology are evaluated at normal incidence."
"""Note on filters without a technology, whose transmission is that at normal incidence."""


def format_constraint(output: Output, name: str, bound: Bound) -> str:
    """Format a constraint, for example `slope at most 0.06 per nm`."""
    words, column = output.words(name), output.columns.get(name)
    if bound.max is None:
        return f"{words} at least {_with_unit(column, bound.min)}"
    if bound.min is None:
        return f"{words} at most {_with_unit(column, bound.max)}"
    if bound.min == bound.max:
        return f"{words} of {_with_unit(column, bound.min)}"
    return f"{words} from {bound.min:g} to {_with_unit(column, bound.max)}"


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


def term_definitions(output: Output) -> list[str]:
    """Define the separation, the constrained quantities, and the modified channels of each CFA.

    Returns one sentence per term, then one per CFA with modified channels.
    """
    names = (output.trade_off[0].name, *output.constraints)
    columns = [output.columns[name] for name in names if name in output.columns]
    lines = []
    # A worst case is explained by the quantity that it is of; duplicates are dropped.
    for name in dict.fromkeys(column.of if column.extreme else column.name for column in columns):
        column = output.columns[name]
        unit = ", in digital numbers (DN)" if column.unit == DN else ""
        lines.append(f"{capital(column.words)}: {column.meaning}{unit}.")
    base_filters = {(entry.cfa, *entry.channel): entry.base for entry in modifications(output) if entry.channel}
    for (cfa, *channels), base in base_filters.items():
        if not base:
            continue
        if len(channels) > 1:
            lines.append(f"In {cfa}, {' and '.join(channels)} are {base} pixels whose filters change.")
        else:
            lines.append(f"In {cfa}, {channels[0]} is a {base} pixel whose filter changes.")
    return lines


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


def angle_note(output: Output, row: Row) -> str:
    """Return a sentence on the angle dependence of a row's filter.

    Empty if no technology is stated or it is not unique.
    """
    technology = technology_of(output, row)
    if technology is None:
        return ""
    if technology.interference is None:
        return "The transmission of a pigment filter does not depend on the angle of incidence."
    incidence = _format_incidence(output.study.scenarios[row["scenario"]])
    return f"The band of an interference filter shifts with the angle of incidence; the values are {incidence}."


def is_angle_dependent(output: Output, row: Row) -> bool:
    """Return whether the transmission of a row's filter may depend on the angle of incidence.

    True if any possible technology is an interference filter.
    """
    return any(t is not None and t.interference is not None for t in _technologies(output, row))


def _format_incidence(scene: Scene) -> str:
    """Format the f-number and the chief ray angles, in degrees, under which light reaches the pixels."""
    lens = f"behind f/{scene.optics.f_number:g}"
    if scene.field is None:
        return f"{lens} at a chief ray angle of {scene.optics.cra_deg:g} degrees"
    angles_deg = scene.field.knots[1]
    angle_range = f"{min(angles_deg):g} to {max(angles_deg):g}"
    positions = "all" if scene.field.everywhere else f"{len(scene.field.counted_heights)}"
    return f"{lens} at chief ray angles of {angle_range} degrees, the worst of {positions} field positions"


def assumptions_line(output: Output) -> str:
    """Return a note on what the run assumes: surrogate curves, and filters without a stated technology.

    Empty if neither applies.
    """
    notes = []
    modeled = [origin.name for origin in (output.provenance.sensor, output.provenance.lights) if origin.surrogate]
    if len(modeled) == 2:
        notes.append("Built-in curves are surrogates, modeled from stated parameters, not measured.")
    elif modeled:
        notes.append(f"The curves of {modeled[0]} are surrogates, modeled from stated parameters, not measured.")
    if any(modification.technology is None for modification in modifications(output)):
        notes.append(_NO_TECHNOLOGY)
    return f"Note: {' '.join(notes)}" if notes else ""
