"""By what technology filters are taken to work, and by which rays, in sentences."""

from __future__ import annotations

from ..camera.scene import Scene
from ..designs.technology import Technology
from ..results.output import Output
from ..results.tables import FOUND, NAMED, PLAIN
from .leaders import Row

NOT_STATED = "No technology is stated of the filters: they are taken as on axis, in parallel rays."


def technologies_of(output: Output, row: Row) -> list[Technology | None]:
    """What the study states of the filter of a row: one, or of a sweep's design each that it may be of."""
    study, search = output.study, output.provenance.search
    swept = study.sweeps | study.boxes
    if row["kind"] == PLAIN:
        return []
    if row["kind"] == NAMED:
        return [study.designs[row["name"]].technology]
    if row["kind"] == FOUND and search is not None:
        return [swept[search.space].technology]
    return list({repr(made.technology): made.technology for made in study.sweeps.values()}.values())


def technology_of(output: Output, row: Row) -> str:
    """Of what technology a row's filter is, to go behind its name; empty if not stated."""
    stated = _the_one(output, row)
    return "" if stated is None else f" ({stated.told})"


def assumed(output: Output, row: Row) -> str:
    """Whether a row's filter moves with the angle of the light, and in which light it then is; empty if not stated."""
    stated = _the_one(output, row)
    if stated is None:
        return ""
    if stated.interference is None:
        return "A pigment does not move with the angle of the light."
    rays = told_light(output.study.scenarios[row["scenario"]])
    return f"Such a filter moves with the angle of the light; the figures are {rays}."


def _the_one(output: Output, row: Row) -> Technology | None:
    stated = technologies_of(output, row)
    return stated[0] if len(stated) == 1 else None


def moves_with_light(output: Output, row: Row) -> bool:
    """Whether a row's filter is said to move with the angle of the light."""
    return any(t is not None and t.interference is not None for t in technologies_of(output, row))


def told_light(scene: Scene) -> str:
    """The rays of a scene in words."""
    lens = f"behind f/{scene.optics.f_number:g}"
    if scene.field is None:
        return f"{lens} at a chief ray angle of {scene.optics.cra_deg:g} degrees"
    angles = scene.field.knots[1]
    ends = f"{min(angles):g} to {max(angles):g}"
    places = "all" if scene.field.everywhere else f"{len(scene.field.seen_heights)}"
    return f"{lens} at chief ray angles of {ends} degrees, the worst of {places} places of the sensor"


def assumed_line(output: Output) -> str:
    """A note of what is not as measured or stated: surrogate curves, filters without a technology; else empty."""
    study, found = output.study, []
    if output.provenance.sensor.surrogate or output.provenance.lights.surrogate:
        found.append("Built-in curves are surrogates, modeled from stated parameters, not measured.")
    made = [*study.designs.values(), *study.sweeps.values(), *study.boxes.values()]
    if any(modification.technology is None for modification in made):
        found.append(NOT_STATED)
    return f"Note: {' '.join(found)}" if found else ""
