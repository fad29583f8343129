"""The section of a study that says what else its designs are judged by."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from ..base.types import Seconds
from ..camera.pixel import ReadNoise
from ..curves.tasks import SHIPPED
from .schema_curves import Documented, Name, TaskFile

_MOST_OWN = 20
_MOST_CLASSES = 40
_TaskName = Annotated[str, Field(min_length=1, max_length=40, pattern="^[a-z][a-z0-9_]*$")]


def _listed(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


def _kind_of(value: Any) -> str:
    return "<group>" if isinstance(value, str) else "<file>"


_Spectra = Annotated[Annotated[Name, Tag("<group>")] | Annotated[TaskFile, Tag("<file>")], Discriminator(_kind_of)]
_ClassSpectra = Annotated[
    list[_Spectra],
    BeforeValidator(_listed, json_schema_input_type=list[_Spectra] | _Spectra),
    Field(min_length=1, max_length=_MOST_CLASSES),
]


class OwnTask(Documented):
    """Classes of spectra to tell apart: from the groups that `sweep list data` shows, and from files."""

    classes: Annotated[dict[Name, _ClassSpectra], Field(min_length=2, max_length=_MOST_CLASSES)]
    """Class -> a group of spectra, {file: ..., quantity: ...}, or a list of these; all are lamps, or all surfaces."""
    under: Annotated[list[Name], BeforeValidator(_listed, json_schema_input_type=list[Name] | Name)] = []
    """Lights of a task of surfaces: d65, d50, a (a filament), led, hps, lps (sodium of high and low pressure)."""


class TasksSection(Documented):
    """What designs gain and lose elsewhere: patches that fill the field, on axis, at one exposure for all CFAs.

    The noise is that of photons and of read noise, in four pixels of the CFA.
    """

    shipped: Annotated[list[Name], Field(json_schema_extra={"items": {"enum": list(SHIPPED)}})] = list(SHIPPED)
    """Tasks of the package: color, low_light, vehicle_lamps, emergency, road_marking, traffic_signs, vegetation,
    unseen_lamps; all of them where it is left out."""
    own: Annotated[dict[_TaskName, OwnTask], Field(max_length=_MOST_OWN)] = {}
    """Tasks of your own, by name."""
    exposure_s: Seconds = 0.01
    """Exposure, the same for every CFA."""
    read_noise_e: ReadNoise = 2.0
    """Read noise of a pixel, electrons."""
    illuminance_lx: Annotated[float, Field(ge=1e-9, le=1e9)] = 1000.0
    """Light on the charts of `color`; the color matrix of `low_light`, too, weighs the noise of that light."""

    @model_validator(mode="after")
    def _some(self) -> TasksSection:
        if not self.shipped and not self.own:
            raise ValueError("`shipped`, `own`, or both")
        if len(set(self.shipped)) < len(self.shipped):
            raise ValueError("a task is named twice")
        return self


def short(value: Any) -> Any:
    """`all` is every task of the package, a list those that it names."""
    if value == "all":
        return {}
    return {"shipped": value} if isinstance(value, list) else value


TasksAsked = Annotated[
    TasksSection | None,
    BeforeValidator(short, json_schema_input_type=Literal["all"] | list[Name] | TasksSection | None),
]
"""`tasks` as a study states it."""
