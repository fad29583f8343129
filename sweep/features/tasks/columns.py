"""Columns of a study's tasks: color, low light, and separations of other lamps and of surfaces."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, get_args

from ...metrics.batch import Batch
from ...metrics.metric import Metric
from ...metrics.quantity import Columns, Quantity, RequestedQuantities
from ...metrics.smooth import Rows, SmoothDesign
from .spectra import LightName, TaskColumns, TaskMetric, tasks_in

if TYPE_CHECKING:
    from .evaluation import TaskEvaluation

EXAMPLE = tuple(TaskColumns("<task>", metric, ("<light>",)) for metric in get_args(TaskMetric))
PREFIX = "task_"
"""How the metrics of tasks begin."""


class TaskFigures(Metric):
    """Columns of tasks; none if a study has no tasks."""

    order = 6
    needs = "tasks"

    @property
    def of_scene(self) -> bool:
        """False: a task has conditions of its own."""
        return False

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        tasks = requested.asked("tasks")
        if not tasks:
            return ()
        from .figures import figures_of

        return tuple(
            Quantity(
                name=name,
                metric=PREFIX + figure.what,
                meaning=figure.meaning,
                unit=figure.unit,
                label=" ".join(part for part in (task.name.replace("_", " "), figure.words, case.upper()) if part),
                digits=figure.digits,
                direction=figure.direction,
                goal=True,
                signed=figure.signed,
                smooth=partial(_rows, task=task.name, what=figure.what, case=case),
            )
            for task in tasks
            for name, figure, case in figures_of(task)
        )

    def of_batch(self, batch: Batch) -> Columns:
        """Compute the columns; see `evaluation.task_columns`."""
        from .evaluation import task_columns

        return task_columns(batch.setup, batch.block)


def _rows(design: SmoothDesign, *, task: str, what: str, case: LightName) -> Rows:
    """Return a figure's rows with derivatives; figures of a task share common parts."""
    from ...metrics.complex_step import COMPLEX_STEP

    rows = design.cached(task, partial(_evaluation, design, task)).rows(what, case)
    return Rows(rows.real[0], rows.imag.T / COMPLEX_STEP)


def _evaluation(design: SmoothDesign, task: str) -> TaskEvaluation:
    from .color import PatchCamera
    from .evaluation import TaskEvaluation

    tasks = tasks_in(design.setup)
    return TaskEvaluation(
        tasks.by_name[task], PatchCamera.along(design.setup, design.curves, design.by_u), tasks.conditions
    )
