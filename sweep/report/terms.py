"""Constraints in words, and the terms of the first screen."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..camera.scene import Scene
from ..designs.technology import Technology
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.quantity import DN, Column
from ..results.output import Output
from ..results.tables import FOUND, NAMED, PLAIN, SWEPT
from .leaders import Row, capital
from .values import modifications


def format_constraint(output: Output, name: str, bound: Bound) -> str:
    """Return a constraint in words: `slope at most 0.06 per nm`.

    Parameters
    ----------
    output : Output
        Finished run.
    name : str
        Column name.
    bound : Bound
        Constraint.

    Returns
    -------
    str
        Text.
    """
    words, column = output.words(name), output.columns.get(name)
    if bound.max is None:
        return f"{words} at least {_amount(column, bound.min)}"
    if bound.min is None:
        return f"{words} at most {_amount(column, bound.max)}"
    if bound.min == bound.max:
        return f"{words} of {_amount(column, bound.min)}"
    return f"{words} from {bound.min:g} to {_amount(column, bound.max)}"


def format_constraints(output: Output) -> str:
    """Return all constraints in words; empty if there are none.

    Parameters
    ----------
    output : Output
        Finished run.

    Returns
    -------
    str
        Text.
    """
    return " and ".join(format_constraint(output, name, bound) for name, bound in output.constraints.items())


def format_missed_constraints(output: Output, row: Row) -> str:
    """Return the violated constraints of a row: `its sensitivity is below 0.9`.

    Parameters
    ----------
    output : Output
        Finished run.
    row : mapping
        Row of the result table.

    Returns
    -------
    str
        Text; empty if it meets all.
    """
    parts = list[str]()
    for name, bound in output.constraints.items():
        value = float(row[name])
        if math.isnan(value):
            parts.append(f"its {output.words(name)} {'' if parts else 'is '}unknown")
        for side, end, past in (("below", bound.min, -1), ("above", bound.max, 1)):
            if end is not None and past * (value - end) / bound.scale > FEASIBLE:
                verb = "" if parts else "is "
                parts.append(f"its {output.words(name)} {verb}{side} {_amount(output.columns.get(name), end)}")
    return " and ".join(parts)


def unknown_lines(output: Output) -> Iterator[str]:
    """Yield constrained quantities that designs lack; unknown is not feasible.

    Parameters
    ----------
    output : Output
        Finished run.

    Yields
    ------
    str
        Sentences.
    """
    rows = output.kind(NAMED, SWEPT, FOUND)
    rows = rows[rows["status"] == "ok"]
    for name in output.constraints:
        unknown = rows[rows[name].isna()]
        if len(unknown):
            families = ", ".join(dict.fromkeys(map(str, unknown["family"])))
            yield f"Designs of {families} have no {output.words(name)}: unknown is not feasible."


def _amount(column: Column | None, value: float | None) -> str:
    """Return a bound with the unit of its column."""
    unit = "" if column is None else column.unit
    return f"{value:g} {unit.replace('1/', 'per ', 1)}".rstrip()


def terms_of(output: Output) -> list[str]:
    """Return the meaning of the separation and of the bounded quantities, and the modified pixels.

    Parameters
    ----------
    output : Output
        Finished run.

    Returns
    -------
    list of str
        Lines.
    """
    requested = (output.trade_off[0].name, *output.constraints)
    columns = [output.columns[name] for name in requested if name in output.columns]
    lines = []
    for name in dict.fromkeys(column.of if column.extreme else column.name for column in columns):
        column = output.columns[name]
        unit = ", in digital numbers (DN)" if column.unit == DN else ""
        lines.append(f"{capital(column.words)}: {column.meaning}{unit}.")
    changed = {(entry.cfa, *entry.channel): entry.base for entry in modifications(output) if entry.channel}
    for (cfa, *channels), base in changed.items():
        if base:
            several = f"are {base} pixels whose filters change"
            what = several if len(channels) > 1 else f"is a {base} pixel whose filter changes"
            lines.append(f"In {cfa}, {' and '.join(channels)} {what}.")
    return lines


_NOT_STATED = "No technology is stated of the filters: they are taken as on axis, in parallel rays."


def _technologies(output: Output, row: Row) -> list[Technology | None]:
    """Return the technologies that a row's filter may have."""
    study, search = output.study, output.provenance.search
    if row["kind"] == PLAIN:
        return []
    if row["kind"] == NAMED:
        return [study.designs[row["name"]].technology]
    if row["kind"] == FOUND and search is not None:
        return [(study.sweeps | study.boxes)[search.space].technology]
    return list({repr(made.technology): made.technology for made in study.sweeps.values()}.values())


def technology_of(output: Output, row: Row) -> Technology | None:
    """Return the technology of a row's filter.

    Parameters
    ----------
    output : Output
        Finished run.
    row : mapping
        Row of the result table.

    Returns
    -------
    Technology or None
        None if it is not stated or not unique.
    """
    stated = _technologies(output, row)
    return stated[0] if len(stated) == 1 else None


def assumed_technology(output: Output, row: Row) -> str:
    """Return a note on the angle of the light for a row's filter; empty if no technology is stated.

    Parameters
    ----------
    output : Output
        Finished run.
    row : mapping
        Row of the result table.

    Returns
    -------
    str
        Text.
    """
    stated = technology_of(output, row)
    if stated is None:
        return ""
    if stated.interference is None:
        return "A pigment does not move with the angle of the light."
    rays = _format_light(output.study.scenarios[row["scenario"]])
    return f"Such a filter moves with the angle of the light; the figures are {rays}."


def is_angle_dependent(output: Output, row: Row) -> bool:
    """Return whether a row's filter moves with the angle of the light.

    Parameters
    ----------
    output : Output
        Finished run.
    row : mapping
        Row of the result table.

    Returns
    -------
    bool
        True if it does.
    """
    return any(t is not None and t.interference is not None for t in _technologies(output, row))


def _format_light(scene: Scene) -> str:
    """Return the rays of a scene in words."""
    lens = f"behind f/{scene.optics.f_number:g}"
    if scene.field is None:
        return f"{lens} at a chief ray angle of {scene.optics.cra_deg:g} degrees"
    angles = scene.field.knots[1]
    ends = f"{min(angles):g} to {max(angles):g}"
    places = "all" if scene.field.everywhere else f"{len(scene.field.counted_heights)}"
    return f"{lens} at chief ray angles of {ends} degrees, the worst of {places} field positions"


def assumed_technology_line(output: Output) -> str:
    """Return a note on surrogate curves and on filters without a technology; else empty.

    Parameters
    ----------
    output : Output
        Finished run.

    Returns
    -------
    str
        Text.
    """
    notes = []
    if output.provenance.sensor.surrogate or output.provenance.lights.surrogate:
        notes.append("Built-in curves are surrogates, modeled from stated parameters, not measured.")
    if any(modification.technology is None for modification in modifications(output)):
        notes.append(_NOT_STATED)
    return f"Note: {' '.join(notes)}" if notes else ""
