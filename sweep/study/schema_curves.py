"""Sections of a study that name curves: a sensor's and lights', built in or from files."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from ..base.types import Ratio, Section
from ..designs.technology import Stated
from ..spectra.builtin.registry import BUILT_IN_LIGHTS
from ..spectra.read_table import MOST_CURVES
from ..spectra.spectrum import Outside, Resampling
from ..spectra.units import SensorQuantity

Name = Annotated[str, Field(min_length=1, max_length=100)]
FileColumns = Annotated[list[Name], Field(min_length=1, max_length=MOST_CURVES)]
FilePath = Annotated[str, Field(min_length=1, max_length=4096)]
ResamplingRule = Annotated[
    Resampling,
    Field(description="`mean` over each bin keeps the integral of lines that are finer than the grid."),
]
OutsideRule = Annotated[Outside, Field(description="`zero` takes 0 where the samples end inside the grid.")]


class FileEntry(Section):
    """Entry that names a file of curves."""

    file: FilePath
    """Path of a file of curves, relative to the study or to the folder of --data.

    At most 40 MB, 2,000 curves, 100,000 samples of each and 2,000,000 values; values are 0 to 1e100."""
    resampling: ResamplingRule = "linear"
    outside: OutsideRule = "refuse"


class CurveFile(FileEntry):
    """QE curves from one file: `columns` maps the sensor's curve names to the file's column names."""

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
    ir_cut: FilePath | None = None
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


class LightFile(FileEntry):
    """Lights from one file."""

    quantity: Literal["energy", "photons"] | None = None
    """Unit of the file's numbers; left out, what the heads of its columns say, else energy."""
    signals: Annotated[dict[Name, FileColumns], Field(min_length=1)]
    """Signal type -> columns of the file."""


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
        list[FilePath], BeforeValidator(listed, json_schema_input_type=list[FilePath] | FilePath), Field(min_length=1)
    ]
    """`modeled`, the built-in catalog of modeled bands, which no dye has; `films`, nine measured films; or files, or
    folders of files, of curves."""
    quantity: Literal["absorbance", "molar_extinction"] = "absorbance"
    """Quantity of the files; of molar extinctions, l/(mol cm), the results have concentrations in mol/l."""
    assumed: ColorantMass | None = None
    """A colorant as a map assumes it: then the map has mol/l and percent by weight, too."""
