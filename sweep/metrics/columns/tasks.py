"""Columns of a study's tasks: color, low light, and separations of other lamps and of surfaces."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from ...spectra.tasks import LightName
from ..batch import Batch
from ..metric import Metric
from ..quantity import Columns, Quantity, RequestedQuantities
from ..smooth import Rows, SmoothDesign

if TYPE_CHECKING:
    from ..tasks.evaluation import TaskEvaluation

PREFIX = "task_"
"""How the metrics of tasks begin."""


class TaskFigures(Metric):
    """Columns of tasks; none if a study has no tasks."""

    order = 6
    needs = "tasks"

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        if not requested.tasks:
            return ()
        from ..tasks.figures import figures_of

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
            for task in requested.tasks
            for name, figure, case in figures_of(task)
        )

    def of_batch(self, batch: Batch) -> Columns:
        """Compute the columns; see `evaluation.task_columns`."""
        from ..tasks.evaluation import task_columns

        return task_columns(batch.setup, batch.block)


def _rows(design: SmoothDesign, *, task: str, what: str, case: LightName) -> Rows:
    """Return a figure's rows with derivatives; figures of a task share common parts."""
    from ..complex_step import COMPLEX_STEP

    rows = design.cached(task, partial(_evaluation, design, task)).rows(what, case)
    return Rows(rows.real[0], rows.imag.T / COMPLEX_STEP)


def _evaluation(design: SmoothDesign, task: str) -> TaskEvaluation:
    from ..tasks.color import PatchCamera
    from ..tasks.evaluation import TaskEvaluation

    tasks = design.setup.tasks
    assert tasks is not None
    return TaskEvaluation(
        tasks.by_name[task], PatchCamera.along(design.setup, design.curves, design.by_u), tasks.conditions
    )
