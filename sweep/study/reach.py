"""Constraints that nothing in a box can meet, told from the box alone: no light is simulated."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..base.errors import Fault
from ..designs.space import Space
from ..metrics.columns.sensitivity import CFA_SENSITIVITY, SENSITIVITY
from ..metrics.quantity import DN
from .model import Study

_PERCENT = (2.0, 100.0)
_SLACK = 1e-9


def likely_percents(study: Study) -> Iterator[str]:
    """Bounds on ratios that look like percent."""
    for name, bound in study.constraints.items():
        quantity = study.quantities[name]
        for end, value in (("min", bound.min), ("max", bound.max)):
            if quantity.role == "light" and value is not None and _PERCENT[0] < value <= _PERCENT[1]:
                place = f"constraints.{name}.{end}"
                yield f"{place}: {value:g} of a ratio; is it a percentage? {value:g} % are {value / 100:g}"


def out_of_reach(study: Study, space: Space, scenario: str) -> list[Fault]:
    """A fault for each constraint that no filter of a space can meet, whatever else it meets.

    Of sensitivities by the largest curve that a filter of the box can be, of widths by the box, of CSDs by the longest
    distance of digital numbers. What is not here may be out of reach all the same.
    """
    faults = []
    most = dict(_most(study, space, scenario))
    for name, bound in study.constraints.items():
        plain = study.quantities[name].of or name
        if bound.min is not None and plain in most and bound.min > most[plain] * (1 + _SLACK):
            told = math.ceil(most[plain] * 1e4) / 1e4
            problem = f"out of reach: {name} {bound}; no filter of {space.name} has more than {told:g}"
            faults.append(Fault(problem, key=f"constraints.{name}"))
    return faults


def _most(study: Study, space: Space, scenario: str) -> Iterator[tuple[str, float]]:
    """Quantities with the largest values that they can have in a space."""
    setup = study.setup(space, scenario)
    for name, quantity in study.quantities.items():
        if quantity.apart == DN and not quantity.extreme:
            yield name, setup.camera.longest_distance_dn
    if space.filter is None:
        return
    low, high = (np.array([end(axis) for axis in space.axes], dtype=float) for end in (min, max))
    made = [space.filter.family.produced(off) for off in study.tolerance.places]
    top = np.max([family.hull(low, high)[1] for family in made], axis=0)
    counts, modified = setup.camera.mosaic.counts, list(setup.camera.modified)
    qe = setup.camera.qe.copy()
    qe[modified] = top
    yield SENSITIVITY, float(top.sum() / setup.camera.base_qe.sum())
    yield CFA_SENSITIVITY, float((qe.sum(axis=1) * counts).sum() / (counts.sum() * setup.camera.clear_qe.sum()))
    for name, rows in space.filter.family.dimensions.items():
        yield name, float(np.maximum(rows * low, rows * high).sum(axis=1).min())
