"""Sections of the key `tasks`."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from ...base.types import Seconds, Section
from ...camera.captures import ReadNoise
from ...study.schema_curves import FileColumns, FileEntry, Name, listed
from .spectra import SHIPPED

_MOST_TASKS = 20
_MOST_CLASSES = 40
_TaskName = Annotated[str, Field(min_length=1, max_length=40, pattern="^[a-z][a-z0-9_]*$")]


class TaskFile(FileEntry):
    """Spectra of a task's class from one file. Only their shape counts: all spectra of a task have the same photons."""

    quantity: Literal["energy", "photons", "reflectance"]
    """Unit of the file's numbers: of lamps `energy` or `photons`, of surfaces `reflectance`, in any unit."""
    columns: FileColumns | None = None
    """Columns of the file; left out, all of them."""


_Spectra = Annotated[
    Annotated[Name, Tag("<group>")] | Annotated[TaskFile, Tag("<file>")],
    Discriminator(lambda value: "<group>" if isinstance(value, str) else "<file>"),
]
_ClassSpectra = Annotated[
    list[_Spectra],
    BeforeValidator(listed, json_schema_input_type=list[_Spectra] | _Spectra),
    Field(min_length=1, max_length=_MOST_CLASSES),
]


class UserTask(Section):
    """Classes of spectra to separate: from the groups that `sweep list data` shows, and from files."""

    classes: Annotated[dict[Name, _ClassSpectra], Field(min_length=2, max_length=_MOST_CLASSES)]
    """Class -> a group of spectra, {file: ..., quantity: ...}, or a list of these; all are lamps, or all surfaces."""
    under: Annotated[list[Name], BeforeValidator(listed, json_schema_input_type=list[Name] | Name)] = []
    """Lights of a task of surfaces: d65, d50, a (a filament), led, hps, lps (sodium of high and low pressure)."""


class TasksSection(Section):
    """Further tasks of the camera: patches that fill the field, on axis, at one exposure for all CFAs.

    The noise is that of photons and of read noise, in four pixels of the CFA.
    """

    shipped: Annotated[list[Name], Field(json_schema_extra={"items": {"enum": list(SHIPPED)}})] = list(SHIPPED)
    """Tasks of the package: color, low_light, vehicle_lamps, emergency, road_marking, traffic_signs, vegetation,
    unseen_lamps; all of them where it is left out."""
    own: Annotated[dict[_TaskName, UserTask], Field(max_length=_MOST_TASKS)] = {}
    """Tasks of your own, by name."""
    exposure_s: Seconds = 0.01
    """Exposure, the same for every CFA."""
    read_noise_e: ReadNoise = 2.0
    """Read noise of a pixel, electrons."""
    illuminance_lx: Annotated[float, Field(ge=1e-9, le=1e9)] = 1000.0
    """Light on the charts of `color`; the color matrix of `low_light`, too, weighs the noise of that light."""
    swept: bool = False
    """Compute the tasks for swept designs, too, which takes about 1 ms for each; otherwise only for plain CFAs, named
    designs and the answer of the search, unless objective or constraints name a task."""

    @model_validator(mode="after")
    def _some(self) -> TasksSection:
        if not self.shipped and not self.own:
            raise ValueError("`shipped`, `own`, or both")
        if len(set(self.shipped)) < len(self.shipped):
            raise ValueError("a task is named twice")
        return self


def _tasks(value: Any) -> Any:
    """Take `all` for every task of the package, and a list for those that it names."""
    if value == "all":
        return {}
    return {"shipped": value} if isinstance(value, list) else value


TasksAsked = Annotated[
    TasksSection | None,
    BeforeValidator(_tasks, json_schema_input_type=Literal["all"] | list[Name] | TasksSection | None),
]
"""`tasks` as a study states it."""
