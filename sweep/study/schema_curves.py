"""Sections of a study that name curves: a sensor's and lights', built in or from files."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterable
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, WithJsonSchema, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from ..base.types import Ratio, Section
from ..curves.builtin.registry import BUILT_IN_LIGHTS
from ..curves.scan import MOST_CURVES
from ..curves.spectrum import Outside, Resampling
from ..designs.technology import Stated

Name = Annotated[str, Field(min_length=1, max_length=100)]
FileColumns = Annotated[list[Name], Field(min_length=1, max_length=MOST_CURVES)]
FilePath = Annotated[str, Field(min_length=1, max_length=4096)]


class Documented(Section):
    """A section whose keys are described by the text below them, for editors; the texts are read when these ask."""

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        made = handler(core_schema)
        keys = handler.resolve_ref_schema(made)["properties"]
        for part in cls.__mro__[: cls.__mro__.index(Documented)]:
            for name, text in _texts_below(part).items():
                keys[cls.model_fields[name].alias or name].setdefault("description", text)
        return made


def _texts_below(section: type) -> dict[str, str]:
    """Key of a section -> the text below it in the source."""
    (made,) = ast.parse(textwrap.dedent(inspect.getsource(section))).body
    assert isinstance(made, ast.ClassDef)
    return {
        key.target.id: inspect.cleandoc(text.value.value)
        for key, text in pairwise(made.body)
        if isinstance(key, ast.AnnAssign)
        and isinstance(key.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }


class CurveFile(Documented):
    """QE curves from one file: `columns` maps the sensor's curve names to the file's column names."""

    file: FilePath
    """Path of a file of curves, relative to the study or to the folder of --data.

    At most 40 MB, 2,000 curves, 100,000 samples of each and 2,000,000 values; values are 0 to 1e100."""
    columns: Annotated[dict[Name, Name], Field(min_length=1)]
    """Channel of the sensor -> column of the file."""
    scale: Ratio = 1.0
    """Factor on the file's values: 0.01 for percent."""
    relative_to: Name | None = None
    """A curve of the sensor that the file's values are relative to: they are transmissions, and are multiplied by it.

    A built-in curve, or one of a file without `relative_to`."""
    resampling: Resampling = "linear"
    """`mean` over each bin keeps the integral of lines that are finer than the grid."""
    outside: Outside = "refuse"
    """`zero` takes 0 where the samples end inside the grid."""


class SensorSection(Documented):
    """A built-in sensor by its name, curves from files, or both: own curves beside the built-in ones."""

    builtin: str | None = None
    """A built-in sensor; a curve of a file takes the place of its curve of the same name."""
    name: Name | None = None
    files: list[CurveFile] = []
    clear: Name | None = None
    """The pixel without filter: the reference of the CFA's sensitivity.

    Left out, it is the built-in sensor's own, or the largest curve, which counts as clear only if it is called C, W,
    clear, white, mono or panchromatic."""
    technology: dict[Name, Stated] = {}
    """Curve -> `pigment`, or `interference: {effective_index: 1.8}`, whose transmission over the clear curve moves with
    the angle of the light; a curve that is left out, as on axis."""

    @model_validator(mode="after")
    def _some_source(self) -> SensorSection:
        if self.builtin is None and not self.files:
            raise ValueError("a sensor is the name of a built-in one, or a mapping with `builtin`, `files` or both")
        if self.builtin is not None and not self.files and (self.name or self.clear):
            raise ValueError("a built-in sensor alone has its own `name` and `clear`; leave these out, or add `files`")
        return self


class LightFile(Documented):
    """Lights from one file: `signals` maps a signal type to the file's columns."""

    file: FilePath
    """Path of a file of curves, relative to the study or to the folder of --data."""
    quantity: Annotated[str, Field(pattern="^(energy|photons)$"), WithJsonSchema({"enum": ["energy", "photons"]})]
    """What the file's numbers are."""
    signals: Annotated[dict[Name, FileColumns], Field(min_length=1)]
    resampling: Resampling = "linear"
    """`mean` over each bin keeps the integral of lines that are finer than the grid."""
    outside: Outside = "refuse"
    """`zero` takes 0 where the samples end inside the grid."""


class TaskFile(Documented):
    """Spectra of a task's class from one file. Only their shape counts: all spectra of a task have the same photons."""

    file: FilePath
    """Path of a file of curves, relative to the study or to the folder of --data."""
    quantity: Literal["energy", "photons", "reflectance"]
    """What the file's numbers are: of lamps `energy` or `photons`, of surfaces `reflectance`, in any unit."""
    columns: FileColumns | None = None
    """Columns of the file; left out, all of them."""
    resampling: Resampling = "linear"
    """`mean` over each bin keeps the integral of lines that are finer than the grid."""
    outside: Outside = "refuse"
    """`zero` takes 0 where the samples end inside the grid."""


class LightsSection(Documented):
    """A built-in data set by its name, or lights from files.

    A file alone in the place of the mapping is taken as energy; the colors of its columns tell their signal types, and
    the resolved study holds what was understood."""

    builtin: str | None = None
    name: Name | None = None
    files: list[LightFile] = []
    photon_ratio: Ratio | None = None
    """K: photons of a signal patch over those of the white patch; from the spectra where it is left out."""

    @model_validator(mode="after")
    def _one_source(self) -> LightsSection:
        if (self.builtin is None) == (not self.files):
            raise ValueError("lights are the name of a built-in data set, a file, or a mapping with `files`")
        return self


def named(names: Iterable[str]) -> Any:
    """The type of built-in names, as editors complete them; installed packages may offer others."""
    return Annotated[str, WithJsonSchema({"anyOf": [{"type": "string", "enum": list(names)}, {"type": "string"}]})]


def builtin(value: Any) -> Any:
    """A name alone is that of a built-in one."""
    return {"builtin": value} if isinstance(value, str) else value


LIGHTS_NAME: Any = named(BUILT_IN_LIGHTS)
"""The type of lights that are named alone."""


class Validation(Documented):
    """How designs do on lights that they have not seen. The photons of a light are those of the study's own lights."""

    lights: Annotated[
        LightsSection | None,
        BeforeValidator(builtin, json_schema_input_type=LIGHTS_NAME | LightsSection),
    ] = None
    """Other lights, of signal types that the study has; their CSDs stand beside its own. A built-in set, a file, or a
    mapping with `files`."""
    leave_one_out: bool = False
    """Search again without each light in turn: how far does the optimum fall on it?"""

    @model_validator(mode="after")
    def _something(self) -> Validation:
        if self.lights is None and not self.leave_one_out:
            raise ValueError("`lights`, `leave_one_out: true`, or both")
        return self
