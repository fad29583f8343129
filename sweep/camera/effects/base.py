"""What an effect of the image chain is: its methods, when it is without consequence, what it changes, what it costs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol, Self

from ...base.types import FloatArray, Section
from ..scene import Scene
from ..seen import SeenFilters
from ..shot import Shot

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


NEXT_TO_NOTHING_DN = 1e-5
"""A bound in closed form that is no larger is not looked at more sharply."""
MULTIPLICATION_S = 1.5e-10
"""Seconds of a multiplication of the response of designs; `tests/bench_work.py` measures them."""


class SceneOptions(Section):
    """What a scene says for one effect. Every option has a default that means that there is none of it."""

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """The options in a scene, which has checked them."""
        return cls.model_validate(scene, from_attributes=True)


class Stage(IntEnum):
    """Where an effect acts. Effects are switched in this order, and light passes them in the opposite one."""

    READOUT = 0
    SAMPLING = 1
    OPTICS = 2


class Chosen(Protocol):
    """The method of each effect, by the effect's name."""

    def __getattr__(self, effect: str) -> str:
        """The method of an effect."""

    @property
    def straight(self) -> bool:
        """Whether digital numbers are linear in electrons."""


class Designs(Protocol):
    """The designs that a change is bounded for, and the light that they may see."""

    @property
    def qe_low(self) -> FloatArray:
        """No channel of any design is below this, ndarray[n_channels, n_wavelengths]."""

    @property
    def qe_high(self) -> FloatArray:
        """No channel of any design is above this, ndarray[n_channels, n_wavelengths]."""

    @property
    def least_light(self) -> float:
        """The least light of any exposure, relative to its mean."""

    @property
    def most_light(self) -> float:
        """The most light of any exposure, relative to its mean."""


class Part(Enum):
    """What of the kernel an effect changes: the light of each pixel, the weights with which pixels are read, whether
    there are pixels, or the places of the light.
    """

    LIGHT = "light"
    WEIGHTS = "weights"
    PIXELS = "pixels"
    PLACES = "places"


@dataclass(frozen=True)
class KernelChange:
    """Another kernel. `knots`: the method of blur between whose wavelengths it is interpolated, where that alone is
    what changes.
    """

    part: Part
    knots: str | None = None


@dataclass(frozen=True)
class ShareChange:
    """Light that is less by a share of it; `of_background`: the background, too."""

    lost: float
    of_background: bool


@dataclass(frozen=True)
class LightChange:
    """A factor on the light, before and after, ndarray[n_wavelengths]; `of_background`: on the background, too."""

    before: FloatArray
    after: FloatArray
    of_background: bool


@dataclass(frozen=True)
class CurveChange:
    """By how much QE curves change: between `low` and `high`, ndarray[n_channels, n_wavelengths]."""

    low: FloatArray
    high: FloatArray


@dataclass(frozen=True)
class FilterChange:
    """Filters as other rays see them, of the light and of its background."""

    before: SeenFilters
    after: SeenFilters

    @property
    def matrices(self) -> dict[int, csr_matrix]:
        """Of each channel that moves, [n_wavelengths, n_wavelengths]: matrix @ curve is what was seen less what is."""
        return {
            channel: self.before.matrix(channel) - self.after.matrix(channel)
            for channel in {*self.before.matrices, *self.after.matrices}
        }


Change = KernelChange | ShareChange | LightChange | CurveChange | FilterChange


class Load(NamedTuple):
    """How long there is to compute, in the seconds of `tests/bench_work.py`; each effect adds its own.

    `cases`: places of the light; `searched`: those of a search for the worst of all, and `search_s` what it takes for
    each design; `scales`: moments of a pulse; `units`: pixels or channels that are read; `nodes`: wavelengths at which
    QE is looked at; `knots`: those of the kernel; `shared_s`: what CFAs share whose tiles are alike; `own_s`: once for
    each CFA; `value_s`: for each value that is read.
    """

    units: float
    nodes: int
    cases: float = 1.0
    searched: float = 0.0
    search_s: float = 0.0
    scales: int = 1
    knots: int = 1
    shared_s: float = 0.0
    own_s: float = 0.0
    value_s: float = 0.0


class Effect(ABC):
    """An effect of the image chain; every class of its own in a file of this folder is one.

    `methods`: from the cheapest to the reference. `order`: when it is switched among the effects of its
    stage. `Options`: what a scene says for it, which `Scenario` then takes.
    """

    name: ClassVar[str]
    methods: ClassVar[tuple[str, ...]]
    stage: ClassVar[Stage]
    order: ClassVar[int]
    Options: ClassVar[type[SceneOptions]] = SceneOptions
    off: ClassVar[str | None] = "skip"
    """The method that computes nothing; None where all of them do."""
    without: ClassVar[str] = "changes nothing here"
    """Why it changes nothing in a scene in which its cheapest method does not."""
    needed_for_noise: ClassVar[bool] = False
    """Whether metrics of noise need its reference."""
    bends: ClassVar[bool] = False
    """Whether the readout is straight only without it."""
    is_limit: ClassVar[bool] = False
    """Whether its reference is a limit that is approached and not reached, and part of it stays open in every plan."""

    @property
    def reference(self) -> str:
        """The method that everything is compared with."""
        return self.methods[-1]

    @abstractmethod
    def exact(self, shot: Shot) -> str | None:
        """Why its cheapest method changes nothing, whatever the design; None where it may."""

    def refused(self, scene: Scene) -> str | None:
        """Why a scene cannot have what it says for this effect; None where it can."""
        return None

    def allowed(self, shot: Shot, methods: Chosen) -> bool:
        """Whether its method goes together with the other methods."""
        return True

    def all_count(self, shot: Shot, methods: Chosen) -> bool:
        """Whether a scene asks for the limit, where `is_limit`, and these methods come near it."""
        return False

    def limit_dn(self, method: str) -> float | None:
        """How far a CSD by this method is from the limit at most, DN, where `is_limit`; None where nothing says so."""
        return None

    def never_reached(self, shot: Shot, brightest_dn: float, signals_dn: float) -> str | None:
        """Why its cheapest method changes nothing where no pixel is brighter; None where it may.

        `brightest_dn`: with all that adds to it, unclipped; `signals_dn`: the brightest signal alone.
        """
        return None

    def factor(self, shot: Shot, method: str, wavelength_nm: FloatArray) -> FloatArray | None:
        """What it leaves of the light, ndarray[n_wavelengths]; None where it is no factor of the light."""
        return None

    dims_background: ClassVar[bool] = True
    """Whether `factor` holds for the background, too."""

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """The load with its own share, light having passed all effects before it."""
        return load


class ReadoutEffect(Effect):
    """An effect between the electrons of a pixel and its digital number."""

    stage = Stage.READOUT
    needed_for_noise = True

    @abstractmethod
    def range_dn(self, shot: Shot, brightest_dn: float, methods: Chosen) -> float:
        """Range of what leaving it out changes in one coordinate, DN: up to a pixel of `brightest_dn`, unclipped.

        `methods`: those of the rest of the readout, of which what is before it in the order has been switched.
        """


class LinearEffect(Effect):
    """An effect of the sampling or the optics: electrons are linear in light with and without it."""

    @abstractmethod
    def change(self, shot: Shot, before: str, after: str, designs: Designs, *, straight: bool) -> Change:
        """What switching it from one method to another changes; `straight`: as seen by a straight readout."""


class KernelEffect(LinearEffect):
    """An effect on the image on the pixels, or on how these are read. `part`: what of the kernel it changes."""

    part: ClassVar[Part]

    def kernel_method(self, method: str) -> str:
        """The method by which a kernel for comparisons is made in place of this one."""
        return method

    def change(self, shot: Shot, before: str, after: str, designs: Designs, *, straight: bool) -> Change:
        """Another kernel."""
        return KernelChange(self.part)


class FilterEffect(LinearEffect):
    """An effect on what the rays of the light see of the filters."""


class LightEffect(LinearEffect):
    """A factor on each wavelength of the light on its way to the image; its method `off` leaves all of it."""

    stage = Stage.OPTICS

    @abstractmethod
    def transmittance(self, shot: Shot, method: str, wavelength_nm: FloatArray) -> FloatArray:
        """What is left of the light, ndarray[n_wavelengths]."""

    def factor(self, shot: Shot, method: str, wavelength_nm: FloatArray) -> FloatArray | None:
        """`transmittance`."""
        return self.transmittance(shot, method, wavelength_nm)

    def change(self, shot: Shot, before: str, after: str, designs: Designs, *, straight: bool) -> Change:
        """Another factor."""
        seen, other = (self.transmittance(shot, method, shot.grid.nodes_nm) for method in (before, after))
        return LightChange(seen, other, self.dims_background)
