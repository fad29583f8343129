"""Key `published` of a study."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...base.errors import Fault, unknown
from ...base.types import Number, Section
from ...camera.scene import OBJECT_RESOLUTION
from ...metrics.quantity import RequestedQuantities
from ...metrics.registry import quantities_of

if TYPE_CHECKING:
    from ...study.checks import Checked


class Keys(Section):
    """Keys of a study."""

    published: dict[str, dict[str, dict[str, Number]]] = {}
    """Printed figures to compare with: table -> CFA, design or geometry -> quantity -> value."""


KEYS = {"StudySection": Keys}


def faults(checked: Checked) -> Iterator[Fault]:
    """Check the names of published figures."""
    section = checked.section
    nominal = quantities_of(RequestedQuantities(checked.lights.classes)).values()
    columns = [q.name for q in nominal if q.ends and q.needs != "family"]
    known = dict.fromkeys([*checked.mosaics, *section.designs, *section.geometry])
    for table, rows in section.key("published").items():
        for row, values in rows.items():
            path = ("published", table, row)
            if row not in known:
                yield unknown(path, "CFA, design or geometry", row, known)
                continue
            names = [OBJECT_RESOLUTION] if row in section.geometry else columns
            for quantity in values:
                if quantity not in names:
                    yield unknown((*path, quantity), "quantity", quantity, names)
