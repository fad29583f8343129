"""Key `tasks` of a study."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...base.errors import Fault
from ...base.types import Section
from .keys import TasksAsked
from .spectra import StudyTasks

if TYPE_CHECKING:
    from ...study import Study, StudySection
    from ...study.checks import Checked
    from ...study.sources import Sources


class Keys(Section):
    """Keys of a study."""

    tasks: TasksAsked = None
    """Further tasks of the camera: `all`, a list of tasks of the package, or a mapping with own ones."""


KEYS = {"StudySection": Keys}


def made(section: StudySection, sources: Sources) -> StudyTasks | None:
    """Return the tasks that a study asks for; None after adding issues, too."""
    asked = section.key("tasks")
    if asked is None:
        return None
    from .checks import tasks_of  # noqa: PLC0415  (few studies have tasks)

    return tasks_of(asked, sources)


def faults(checked: Checked) -> Iterator[Fault]:
    """Check tasks against pixel, filters and scenes."""
    section, tasks = checked.section, checked.features.get("tasks")
    if section.key("tasks") is not None and section.pixel.captures:
        yield Fault(("tasks",), "of a pixel that is read once; `pixel.captures` are merged", None, "no captures")
    if isinstance(tasks, StudyTasks) and checked.sensor is not None:
        from .checks import check_tasks_in_scenes  # noqa: PLC0415  (few studies have tasks)

        yield from check_tasks_in_scenes(tasks, section, checked.sensor, checked.spaces)


def swept(study: Study) -> frozenset[str] | None:
    """Return the columns of tasks, where they are computed for swept designs, too; else None."""
    tasks, named = study.section.key("tasks"), {*study.objective.weights, *study.constraints}
    columns = {name for name, quantity in study.quantities.items() if quantity.metric.startswith("task_")}
    return frozenset(columns) if tasks.swept or named & columns else None
