"""The study file's schema. Sections that a lower layer owns (pixel, scenario, ...) are declared there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from ..base.types import Number, Section, with_keys_of_features
from ..camera.accuracy import STANDARD, AccuracySection
from ..camera.curve_errors import CurveErrors
from ..camera.mosaic import Mosaic
from ..camera.pixel import Pixel
from ..camera.scene import Geometry, Scene
from ..camera.sensor import BUILT_IN_SENSORS
from ..designs.registry import PIGMENTS, FamilyOptions, described_families
from ..designs.technology import PIGMENT, Stated
from ..designs.tolerance import Tolerance
from ..features import modules
from ..metrics.bound import Bound
from ..metrics.objective import Objective
from ..spectra.population import Population, stated_yield
from ..spectra.spectrum import WavelengthGrid
from .axes import ScenarioTemplate, Span, Values, expanded
from .cameras import CameraName, with_camera
from .schema_curves import (
    LIGHTS_NAME,
    ColorantsSection,
    FilePath,
    LightsSection,
    Name,
    SensorSection,
    builtin,
    catalog,
    listed,
    named,
)

_MOST_ROWS = 64
_MOST_LETTERS = 100
_MOST_OWN = 50
_MOST_BOXES = 10_000
MOST_TYPES = 40
"""Signal types of a study; 780 pairs of them have columns of their own."""


@with_keys_of_features
class CfaSection(Section):
    """Color filter array: its smallest repeated tile."""

    tile: Annotated[list[Annotated[list[Name], Field(max_length=_MOST_ROWS)]], Field(max_length=_MOST_ROWS)] | None = (
        None
    )
    """Channels of the tile, row by row; at most 64 x 64 pixels."""
    curves: dict[Name, Name] = {}
    """Channel -> curve of the sensor, where the names differ."""

    def mosaic(self, name: str) -> Mosaic:
        """Return the CFA; raises SweepError for a name or a tile that is none."""
        return Mosaic.from_name(name) if self.tile is None else Mosaic.from_rows(name, self.tile)


class Modification(Section):
    """A family of filters put into `channel` of a CFA: it starts from curve `base` and goes `to` a curve or a floor.

    A number for `to` is a floor: that fraction of the base curve. `dual` replaces two channels (a list) and goes `to` a
    ceiling; `free_form` has no `to`.
    """

    cfa: Name
    """One of `cfas`."""
    family: Annotated[
        Name,
        Field(
            description=f"One of {described_families()}; or your own: FILE.py:CLASS, or the name by which "
            "an installed package offers it.",
        ),
    ] = "stopband"
    channel: Annotated[list[Name], BeforeValidator(listed, json_schema_input_type=list[Name] | Name)] = []
    """The channel of the CFA that the filter replaces; `dual` takes a list of two."""
    base: Name | None = None
    """The curve that the filter starts from."""
    to: Name | Annotated[float, Field(ge=0, le=1)] | None = None
    """The curve that it follows inside the band; a number is a floor, that share of the base."""
    options: FamilyOptions = FamilyOptions()
    """Options of the family, such as `bands` or `nodes`."""
    technology: Stated = None
    """`pigment`, or `interference: {effective_index: 1.8}`, which moves with the angle of the light; left out, as on
    axis. Filters of colorants are pigments."""

    @model_validator(mode="before")
    @classmethod
    def _of_colorants(cls, value: Any) -> Any:
        absorbs = isinstance(value, dict) and value.get("family") in PIGMENTS
        return {"technology": PIGMENT} | value if absorbs else value


class DesignSection(Modification):
    """One filter by its parameters, or by the name of a built-in one."""

    at: dict[Name, Number | Name] | Name
    """Parameter -> value, or the name of a built-in design; the value of `colorant_1` may be a colorant's name."""


class SweepSection(Modification):
    """Filters over the family's parameters: one of `grid` and `values`."""

    grid: dict[Name, Values] | None = None
    """Every combination of the values."""
    values: (
        Annotated[list[Annotated[dict[Name, Number], Field(min_length=1)]], Field(min_length=1)] | FilePath | None
    ) = None
    """Designs one by one, each with the same parameters; or a CSV of at most 10,000 rows with a column a parameter."""

    @model_validator(mode="after")
    def _one_way(self) -> SweepSection:
        if (self.grid is None) == (self.values is None):
            raise ValueError(f"one of `grid` and `values`; there {'are both' if self.grid else 'is none of them'}")
        for number, design in enumerate(self.listed, 1):
            if set(design) != set(self.listed[0]):
                raise ValueError(f"values: design {number} names other parameters than the first one")
        return self

    @property
    def listed(self) -> list[dict[str, float]]:
        """Designs one by one; none of a grid, nor of a file."""
        return self.values if isinstance(self.values, list) else []

    @property
    def axes(self) -> dict[str, tuple[float, ...]]:
        """Values of each parameter."""
        if self.grid is not None:
            return {name: axis.points() for name, axis in self.grid.items()}
        return {name: tuple(design[name] for design in self.listed) for name in self.listed[0]}


class BoxSection(Modification):
    """A box that is searched but not swept; `cfa: tiles` makes one for each pixel of each of the study's tiles.

    An edge that is not named lies where the base curve has light; another parameter may take all its family's values.
    """

    box: dict[Name, Span] = {}
    """Parameter -> range."""
    below: bool = False
    """True: the filter takes light away only; where `to` is above the base it is the base."""
    group: str = ""
    """The box of all `tiles` that this one is of; stated by a run."""


class Production(Section):
    """Production tolerances of a filter, independent of each other."""

    edge_shift_nm: float = Field(default=0.0, ge=0, le=1000)
    """Largest shift of an edge, or of the bands of a colorant in its film, to either side, in nm."""
    thickness: float = Field(default=0.0, ge=0, le=0.2)
    """Largest relative error of the films of an interference filter; moves l nm to l (1 + thickness). A film of
    colorants absorbs so much more or less, by its thickness or its concentration."""
    broadening: float = Field(default=0.0, ge=0, le=2)
    """Largest relative excess of the width of a colorant's bands in a film, of equal area: 0.2 is up to 1.2 times.
    Thin layers have none."""

    @property
    def tolerance(self) -> Tolerance:
        """Production tolerance of a filter."""
        return Tolerance(self.edge_shift_nm, self.thickness, self.broadening)


class Recognition(Section):
    """Error rates of classifying signal types under noise."""

    states: Annotated[list[Name], Field(min_length=2, max_length=MOST_TYPES)] | None = None
    """Signal types to classify; left out, all of them."""
    error_max: float = Field(default=1e-3, ge=1e-300, lt=0.5)
    """Largest error probability of two states at which a CFA counts as usable."""


class Levels(Section):
    """Equidistant levels of sensitivity."""

    min: float = Field(ge=1e-6, lt=2)
    """Lowest sensitivity."""
    max: float = Field(ge=1e-6, lt=2)
    """Highest sensitivity."""
    count: int = Field(ge=1, le=1000)
    """Number of levels."""

    @model_validator(mode="after")
    def _ordered(self) -> Levels:
        if not self.min <= self.max:
            raise ValueError(f"min {self.min:g} must not be above max {self.max:g}")
        if (self.count == 1) != (self.min == self.max):
            raise ValueError("count 1 goes with min = max")
        return self


@with_keys_of_features
class SearchSection(Section):
    """Search in a box, or in that of a sweep (from the smallest to the largest value of each parameter)."""

    name: Name | None = None
    """Name of the best design in tables and report; left out, `best` and the family."""
    space: Name | None = None
    """The sweep or box to search; may be left out where there is one. Of a box of all `tiles`, the best tile."""
    front: Levels | None = None
    """Levels of the lowest allowed sensitivity at which the search is repeated for the trade-off; over `tiles` levels
    of the CFA sensitivity, the light of the whole tile."""
    scenario: Name | None = None
    """Scenario of the search, or one with `each`, of whose scenarios the worst counts; may be left out where there is
    one."""
    algorithm: Name = "SLSQP"
    """SLSQP, MMA, CCSAQ; without gradients COBYLA, ISRES, ORIG_DIRECT_L, AGS, whose best point SLSQP refines where
    derivatives exist."""
    starts: int = Field(default=16, ge=1, le=10_000)
    """Starting points; ORIG_DIRECT_L and AGS, the same from everywhere, take one."""
    max_evaluations: int = Field(default=2000, ge=10, le=10_000_000)
    """Largest number of evaluations, shared evenly by the starts; SLSQP after another algorithm has as many as a
    start."""


def _cfas(value: Any) -> Any:
    if isinstance(value, list):
        names = [name for name in value if isinstance(name, str)]
        if len(names) < len(value):
            raise ValueError("a list of CFAs holds names; write others as `NAME: {tile: [[R, G], [G, B]]}`")
        if len(set(names)) < len(names):
            raise ValueError("a CFA is named twice")
        return {name: {} for name in names}
    return {name: {} if tile is None else tile for name, tile in value.items()} if isinstance(value, dict) else value


def _default_objective(scenarios: Mapping[str, Scene]) -> Objective:
    """Return the separation of yellow and red; without the part that is brightness where signals differ in photons."""
    equal = all(scene.equal_photons for scene in scenarios.values())
    return Objective(minimum={"csd_yellow_red" if equal else "chromatic_csd_yellow_red": 1.0})


@with_keys_of_features
class StudySection(Section):
    """A whole study file: YAML 1.2 in UTF-8, without tags.

    At most 500,000 bytes, 50,000 keys and values (those of an alias counted each time), 20 levels of nesting and 100
    letters in a number; 16 times as many bytes and 8 times as many values in a `*.resolved.yaml`, as a run writes it.
    Figures of pixel, optics and scene have limits several orders of magnitude beyond any hardware.
    """

    study: Annotated[str, Field(min_length=1, max_length=100)]
    """The name of the study, and of the folder of its results."""
    title: Annotated[str, Field(max_length=_MOST_LETTERS)] = ""
    """The question in one line of at most 100 letters; heads its report."""
    question: str = ""
    """Question of the study in full."""
    seed: int = Field(default=1, ge=0, lt=2**32)
    """Of every random draw."""
    wavelengths: WavelengthGrid = WavelengthGrid()
    """The grid that all curves are brought to, nm."""
    sensor: Annotated[
        SensorSection, BeforeValidator(builtin, json_schema_input_type=named(BUILT_IN_SENSORS) | SensorSection)
    ]
    """QE curves: `ar0820`, a built-in surrogate, a measured one (`sweep list data`), a plugin of a package, or a
    mapping with `files`."""
    camera: CameraName | None = None
    """Pixel and lens of a camera for the road, where `pixel` and `optics` of the scenarios state nothing else: `road`,
    f/2 and a split pixel of 2.8 um; `road_read_once`, its large photodiode alone, read once."""
    pixel: Pixel = Pixel()
    """The pixel and its readout."""
    lights: Annotated[
        LightsSection,
        BeforeValidator(
            builtin, json_schema_input_type=LIGHTS_NAME | LightsSection | list[LIGHTS_NAME | LightsSection]
        ),
    ]
    """Traffic lights: `tl16`, a built-in surrogate, measured `luxeon`, a file, a plugin of a package, or a mapping with
    `files`; a list of them has one run for each."""
    scenarios: Annotated[
        dict[Name, Scene],
        BeforeValidator(expanded, json_schema_input_type=dict[Name, ScenarioTemplate]),
        Field(min_length=1),
    ] = {"chart": Scene()}
    """Scenes, by name: exposure, target, optics, weather, noise."""
    columns: Literal["asked", "all"] = "asked"
    """Columns in `results.parquet`: of swept designs `asked` (CSDs, sensitivities, exposure, the chromatic CSD of the
    objective's types, own metrics, and what objective, constraints and front name), or `all`. `pareto.parquet` and
    `designs.parquet` have all columns of the front, of plain CFAs, named designs and the best. Where one number tells
    scenarios apart, distances in DN that neither objective, constraints nor front name are of the first one alone, or,
    with `all`, of all."""
    tolerance_dn: Annotated[float, Field(ge=1e-12, le=1e12)] = 0.1
    """By how much the simulation may change any CSD, DN."""
    accuracy: AccuracySection = STANDARD
    """Sampling of the camera model: `standard`, `reference`, or a mapping of settings."""
    geometry: Annotated[dict[Name, Geometry], Field(max_length=1000)] = {}
    """Distances at which the size of a light on the sensor is told, by name."""
    cfas: Annotated[
        dict[Name, CfaSection],
        BeforeValidator(
            _cfas, json_schema_input_type=list[Name] | dict[Name, CfaSection | list[Name] | Literal["2x2"] | int | None]
        ),
        Field(min_length=1, max_length=1000),
    ]
    """CFAs to compare: a list of names of 2x2 pixels (RGGB, RYYCy), or NAME: {tile: [[R, G], [B, W]]}. Beside names,
    `tiles: 2x2` with `of` (a list of channels) makes all tiles of these, and `tiles: [RGGB, RYYCy]` those; with
    `modified: 1` a box with `cfa: tiles` is searched in each pixel of each."""
    colorants: Annotated[
        ColorantsSection | None,
        BeforeValidator(catalog, json_schema_input_type=list[Name] | Name | ColorantsSection | None),
    ] = None
    """Colorants that filters of the family `mixture` choose from."""
    designs: Annotated[dict[Name, DesignSection], Field(max_length=10_000)] = {}
    """Single filters to compare with, by name."""
    sweeps: Annotated[dict[Name, SweepSection], Field(max_length=1000)] = {}
    """Sets of filters, by name: grids, samples of a box, lists."""
    boxes: Annotated[dict[Name, BoxSection], Field(max_length=_MOST_BOXES)] = {}
    """Ranges of filters that are searched but not swept, by name."""
    production: Production = Production()
    """Production tolerances of the filter; then worst_... quantities exist."""
    population: Population | None = None
    """The lamps that the lights stand for: temperature, binning, ageing; then worst_csd_... quantities exist."""
    uncertainty: CurveErrors | None = None
    """Errors of the sensor's curves: separations on random sensors, as quantiles."""
    recognition: Recognition | None = None
    """How often noise confuses signal types; needs noise in every scenario."""
    metrics: Annotated[
        list[Name], BeforeValidator(listed, json_schema_input_type=list[Name] | Name), Field(max_length=_MOST_OWN)
    ] = []
    """Own metrics: FILE.py:NAME, or names that installed packages offer; each is a column like any other."""
    effects: Annotated[list[Name], Field(max_length=_MOST_OWN)] = []
    """Own effects on the light: FILE.py:NAME, or names that installed packages offer; always computed."""
    objective: Objective = Field(default_factory=lambda data: _default_objective(data.get("scenarios", {})))
    """Maximized quantity: a CSD or sensitivity, or several: {minimum: {...}} or {sum: {...}} with weights; or, of
    errors under noise, made small: {least: {...}}. Left out, csd_yellow_red; chromatic_csd_yellow_red where lamps
    differ in brightness (`intensity_cd`, `drive`)."""
    constraints: dict[Name, Bound] = {}
    """Quantity -> {min: ...}, {max: ...} or both."""
    search: SearchSection | None = None
    """A constrained search beside the sweep."""
    clouds: dict[Name, Annotated[list[Name], Field(min_length=2, max_length=2)]] = {}
    """CFAs whose digital numbers of all lamps the report draws: CFA -> two of its channels."""

    @model_validator(mode="before")
    @classmethod
    def _written_out(cls, value: Any) -> Any:
        value = with_camera(value)
        for module in modules("written"):
            value = module.written(value)
        return value

    @property
    def wanted_yield(self) -> float:
        """The share of random lamps and cameras of a yield; 0: none."""
        return stated_yield(self.uncertainty, self.population)
