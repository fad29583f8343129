"""Sections of a study that name curves: a sensor's, lights' and tasks', built in or from files."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator

from ..base.types import Ratio, Seconds, Section
from ..camera.captures import ReadNoise
from ..designs.technology import Stated
from ..spectra.builtin.registry import BUILT_IN_LIGHTS
from ..spectra.read_table import MOST_CURVES
from ..spectra.spectrum import Outside, Resampling
from ..spectra.tasks import SHIPPED
from ..spectra.units import SensorQuantity

_MOST_TASKS = 20
_MOST_CLASSES = 40

Name = Annotated[str, Field(min_length=1, max_length=100)]
FileColumns = Annotated[list[Name], Field(min_length=1, max_length=MOST_CURVES)]
_Path = Annotated[str, Field(min_length=1, max_length=4096)]
FilePath = Annotated[
    _Path, Field(description="Path of a file of curves, relative to the study or to the folder of --data.")
]
ResamplingRule = Annotated[
    Resampling,
    Field(description="`mean` over each bin keeps the integral of lines that are finer than the grid."),
]
OutsideRule = Annotated[Outside, Field(description="`zero` takes 0 where the samples end inside the grid.")]


class CurveFile(Section):
    """QE curves from one file: `columns` maps the sensor's curve names to the file's column names."""

    file: _Path
    """Path of a file of curves, relative to the study or to the folder of --data.

    At most 40 MB, 2,000 curves, 100,000 samples of each and 2,000,000 values; values are 0 to 1e100."""
    columns: Annotated[dict[Name, Name], Field(min_length=1)]
    """Channel of the sensor -> column of the file."""
    quantity: SensorQuantity | None = None
    """Unit of the file's numbers, where the heads of its columns do not tell it, or tell it wrong: `qe`,
    `responsivity` (A/W), `relative_responsivity` (per energy, in any scale); `transmission`, `density` (optical
    density, absorbance) and `decibel` with `relative_to`."""
    scale: Ratio = 1.0
    """Factor on the file's values, in the place of what their heads say: 0.01 for percent."""
    relative_to: Name | None = None
    """A curve of the sensor that the file's values are relative to: they are transmissions, and are multiplied by it.

    A built-in curve, or one of a file without `relative_to`."""
    resampling: ResamplingRule = "linear"
    outside: OutsideRule = "refuse"


class SensorSection(Section):
    """A built-in sensor by its name, curves from files, or both: own curves beside the built-in ones."""

    builtin: str | None = None
    """A built-in sensor; a curve of a file takes the place of its curve of the same name."""
    name: Name | None = None
    """Name of the sensor in the report."""
    files: list[CurveFile] = []
    """Files of QE curves."""
    clear: Name | None = None
    """The pixel without filter: the reference of the CFA's sensitivity.

    Left out, it is the built-in sensor's own, or the largest curve, which counts as clear only if it is called C, W,
    clear, white, mono or panchromatic."""
    ir_cut: _Path | None = None
    """File of one curve: the transmission of an IR cut in front of the sensor, which multiplies every curve."""
    technology: dict[Name, Stated] = {}
    """Curve -> `pigment`, or `interference: {effective_index: 1.8}`, whose transmission over the clear curve moves with
    the angle of the light; a curve that is left out, as on axis."""

    @model_validator(mode="after")
    def _some_source(self) -> SensorSection:
        if self.builtin is None and not self.files:
            raise ValueError("a sensor is the name of a built-in one, or a mapping with `builtin`, `files` or both")
        if self.builtin is not None and not self.files and (self.name or self.clear) and self.ir_cut is None:
            raise ValueError("a built-in sensor alone has its own `name` and `clear`; leave these out, or add `files`")
        return self


class LightFile(Section):
    """Lights from one file."""

    file: FilePath
    quantity: Literal["energy", "photons"] | None = None
    """Unit of the file's numbers; left out, what the heads of its columns say, else energy."""
    signals: Annotated[dict[Name, FileColumns], Field(min_length=1)]
    """Signal type -> columns of the file."""
    resampling: ResamplingRule = "linear"
    outside: OutsideRule = "refuse"


class TaskFile(Section):
    """Spectra of a task's class from one file. Only their shape counts: all spectra of a task have the same photons."""

    file: FilePath
    quantity: Literal["energy", "photons", "reflectance"]
    """Unit of the file's numbers: of lamps `energy` or `photons`, of surfaces `reflectance`, in any unit."""
    columns: FileColumns | None = None
    """Columns of the file; left out, all of them."""
    resampling: ResamplingRule = "linear"
    outside: OutsideRule = "refuse"


class LightsSection(Section):
    """A built-in data set by its name, or lights from files.

    A file alone in the place of the mapping is taken as energy; the colors of its columns tell their signal types, and
    the resolved study holds what was understood.
    """

    builtin: str | None = None
    """A built-in data set; excludes `files`."""
    name: Name | None = None
    """Name of the lights in the report."""
    files: list[LightFile] = []
    """Files of spectra; exclude `builtin`."""
    outside: OutsideRule = "refuse"
    photon_ratio: Ratio | None = None
    """K: photons of a signal patch over those of the white patch; from the spectra where it is left out."""

    @model_validator(mode="after")
    def _one_source(self) -> LightsSection:
        if self.builtin is not None and self.files:
            raise ValueError("`builtin` and `files` exclude each other here; give one")
        if self.builtin is None and not self.files:
            raise ValueError("lights are the name of a built-in data set, a file, or a mapping with `files`")
        return self


def named(names: Iterable[str]) -> Any:
    """Return the type of a built-in name, with the choices that editors complete."""
    return Annotated[str, WithJsonSchema({"anyOf": [{"type": "string", "enum": list(names)}, {"type": "string"}]})]


def builtin(value: Any) -> Any:
    """Read a plain name as `{builtin: NAME}`."""
    return {"builtin": value} if isinstance(value, str) else value


LIGHTS_NAME: Any = named(BUILT_IN_LIGHTS)
"""The type of lights that are named alone."""


class Validation(Section):
    """Validation on lights that the search does not use."""

    leave_one_out: bool
    """Search again without each light in turn: how far does the optimum fall on it?"""


_TaskName = Annotated[str, Field(min_length=1, max_length=40, pattern="^[a-z][a-z0-9_]*$")]


def listed(value: Any) -> Any:
    """Read a single entry as a list of one."""
    return value if isinstance(value, list) else [value]


def catalog(value: Any) -> Any:
    """Read a name, or a list of names, as `{catalog: [...]}`."""
    return {"catalog": listed(value)} if isinstance(value, str | list) else value


class ColorantMass(Section):
    """Figures of a colorant and its film, from which an absorbance becomes a concentration."""

    molar_extinction: float = Field(gt=0, le=1e8)
    """Decadic molar extinction at the peak, l/(mol cm)."""
    molar_mass_g_per_mol: float = Field(gt=0, le=1e6)
    """Molar mass, g/mol."""
    film_density_g_per_cm3: float = Field(gt=0, le=30)
    """Density of the film, g/cm^3."""


class ColorantsSection(Section):
    """Absorption spectra that filters of the family `mixture` choose from."""

    catalog: Annotated[
        list[_Path], BeforeValidator(listed, json_schema_input_type=list[_Path] | _Path), Field(min_length=1)
    ]
    """`modeled`, the built-in catalog of modeled bands, which no dye has; `films`, nine measured films; or files, or
    folders of files, of curves."""
    quantity: Literal["absorbance", "molar_extinction"] = "absorbance"
    """Quantity of the files; of molar extinctions, l/(mol cm), the results have concentrations in mol/l."""
    assumed: ColorantMass | None = None
    """A colorant as a map assumes it: then the map has mol/l and percent by weight, too."""


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
