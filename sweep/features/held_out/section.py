"""Key `validate` of a study."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from ...base.errors import Fault
from ...base.types import Section

if TYPE_CHECKING:
    from ...study import Study
    from ...study.checks import Checked


class Validation(Section):
    """Validation on lights that the search does not use."""

    leave_one_out: bool
    """Search again without each light in turn: how far does the optimum fall on it?"""


class Keys(Section):
    """Keys of a study."""

    validation: Annotated[Validation | None, Field(alias="validate")] = None
    """How designs do on lights that they have not seen."""


KEYS = {"StudySection": Keys}


def leaves_one_out(study: Study) -> bool:
    """Return whether each light is left out of a search in turn."""
    requested = study.section.key("validation")
    return requested is not None and bool(requested.leave_one_out) and study.search is not None


def faults(checked: Checked) -> Iterator[Fault]:
    """Check that one box is searched."""
    requested, search = checked.section.key("validation"), checked.section.search
    if requested is None or not requested.leave_one_out:
        return
    path = "validate", "leave_one_out"
    if search is None:
        yield Fault(path, "nothing is searched", None, "a study with `search`")
    elif checked.search is not None and checked.search.tiles:
        name = search.space or ""
        yield Fault(path, "of one tile, and the search is over several", name, "a box of one")
