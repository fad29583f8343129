"""What a column of the result table is: everything that the other rooms need to know of a quantity."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..camera.forward import ForwardModel
from ..camera.readout import NoisyReadout
from ..camera.setup import Setup
from ..curves.lights import Pair
from ..curves.tasks import TaskName
from ..designs.block import Block
from ..designs.family import Family
from ..vision.section import Vision
from .own import OwnMetric
from .smooth import Rows, SmoothDesign

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

WORST = "worst_"
"""How the name of a quantity's worst case begins: over shifts of the edges in production, and over the population of
the lights."""
WORST_CASE: Literal["worst case"] = "worst case"
YIELD = "yield_"
"""How the name of what the wanted share of drawn lamps and cameras has begins."""
OF_A_SHARE: Literal["yield"] = "yield"
BEST_PLACE = "best_place_"
"""How the name of a CSD's largest value over the places where the light may fall on the mosaic begins, each at its
worst moment of a pulsed light."""
HELD_OUT = "held_out_"
"""How the name of a CSD of lights that the study does not optimize for begins."""
DN = "DN"
"""Unit of what is measured in digital numbers."""
DECADES = "decades"
"""Unit of how far an error is below 1: its logarithm to base 10."""
Columns = dict[str, FloatArray]
End = Literal["min", "max"]


@dataclass(frozen=True)
class Column:
    """A column in words and facts, as a run keeps them.

    `metric`: what is measured, the same for all pairs of signal types. `unit`: empty for a ratio. `role`: `separation`
    (how well colors are told apart) or `light` (what that costs). `extreme`: of which kind of extreme over what, if
    any, of the quantity named `of`. `wanted`: whether more of it is better, or less. `pair`: of signal types.
    """

    name: str
    metric: str
    meaning: str
    unit: str = ""
    label: str = ""
    digits: int = 4
    wanted: Literal["more", "less", ""] = ""
    role: Literal["separation", "light", ""] = ""
    extreme: Literal["worst case", "best place", "yield", ""] = ""
    of: str = ""
    pair: Pair | None = None

    @property
    def words(self) -> str:
        """Its name as people write it."""
        return self.label or self.name

    @property
    def axis(self) -> str:
        """Its name with its unit, if it has one."""
        return f"{self.words} / {self.unit}" if self.unit else self.words

    def amount(self, value: float, digits: int | None = None) -> str:
        """A value with its unit, with `digits` after the point instead of its own; a ratio always has its own."""
        own = self.digits if digits is None else digits
        return f"{value:.{own}f} {self.unit}" if self.unit else f"{value:.{self.digits}f}"

    def told(self, value: float) -> str:
        """A value as sentences, plots and large numbers say it: in DN whole from 10 on."""
        return self.amount(value, 0 if self.unit == DN and abs(value) >= 10 else None)

    def told_bound(self, value: float) -> str:
        """What nothing exceeds, as sentences say it: rounded up at the next digit, so that nothing exceeds that."""
        digits = 1 if self.unit == DN and abs(value) >= 10 else self.digits
        return self.amount(math.ceil(value * 10**digits) / 10**digits, digits)


@dataclass(frozen=True)
class LinearRows:
    """A quantity as rows of the curve N of one modified channel: rows @ N + constant is `scale` times each of them.

    The smallest is the quantity where more of it is wanted, else the largest. `rows`: [n, n_wavelengths].
    """

    rows: csr_matrix
    constant: float = 0.0
    scale: float = 1.0


@dataclass(frozen=True)
class Quantity(Column):
    """A column that is computed, with what constraints, search and limit need.

    `ends`: ends of a constraint on it. `goal`: a search may make it large, or small where less is wanted, and it has a
    worst case unless it is `nominal`. `needs`: it exists only with a modified channel, in a family that has it, or in
    CFAs of which an own metric says something.
    `infinite`: it may be so. `signed`: it may be below 0. `promised`: a plan's promise holds for it. `rows`: what its
    smooth rows are: its values, their squares, or their number of decades below 1, -log10. `apart`: it is the smallest
    distance of two signals, in DN or in units of the noise. `most`: no filter reaches more. `share`: it is the smallest
    ratio of N to the curve that N replaces. `states`: the signal types that noise may confuse in it. `slopes`: its rows
    have derivatives, else only searches without these know it. `smooth_members`: its smooth rows over the population of
    the lights; `smooth_drawn`: over random lamps and cameras.
    """

    ends: tuple[End, ...] = ()
    goal: bool = False
    needs: Literal["modified", "family", "own", ""] = ""
    infinite: bool = False
    signed: bool = False
    promised: bool = False
    nominal: bool = False
    rows: Literal["values", "squares", "decades"] = "values"
    apart: Literal["", "DN", "noise"] = ""
    most: float = np.inf
    share: bool = False
    states: tuple[str, ...] = ()
    slopes: bool = True
    smooth: Callable[[SmoothDesign], Rows] | None = field(default=None, repr=False)
    smooth_members: Callable[[SmoothDesign], Rows] | None = field(default=None, repr=False)
    smooth_drawn: Callable[[SmoothDesign], Rows] | None = field(default=None, repr=False)
    linear: Callable[[Setup], LinearRows] | None = field(default=None, repr=False)

    @property
    def has_limit(self) -> bool:
        """Whether the limit of any filter knows it."""
        return bool(self.apart) or self.share or self.linear is not None

    @property
    def column(self) -> Column:
        """What a run keeps of it."""
        return Column(**{each.name: getattr(self, each.name) for each in fields(Column)})

    def worst(self, over: Sequence[str]) -> Quantity:
        """Its worst case `over` all of something."""
        meaning = f"the worst case of `{self.name}` over {' and '.join(over)}"
        label = f"worst-case {self.words}"
        return replace(
            self, name=WORST + self.name, meaning=meaning, label=label, extreme=WORST_CASE, of=self.name, goal=True
        )

    def of_share(self, share: float) -> Quantity:
        """What a share of the drawn lamps and cameras has of it: no linear program knows that."""
        told = f"{100 * share:.10g} %"
        meaning = (
            f"at least {told} of the drawn lamps and cameras (`population`, `production`) have this `{self.name}`, and "
            f"with 95 % confidence {told} of all, where the design was not chosen by the same draws: the mean of draws "
            "of a rank so low, before clipping and rounding, with everything on; no limit is computed of it"
        )
        label = f"{self.words} of {told} of drawn lamps and cameras"
        named = replace(self, name=YIELD + self.name, meaning=meaning, label=label, extreme=OF_A_SHARE, of=self.name)
        unknown = replace(named, apart="", linear=None, promised=False, smooth_members=None)
        return replace(unknown, rows="values", smooth=self.smooth_drawn, smooth_drawn=None)

    def value(self, rows: Rows) -> float:
        """The quantity from its smooth rows."""
        most = self.wanted == "less" and self.rows != "decades"
        return self.of_row(float(rows.values.max() if most else rows.values.min()))

    def of_row(self, row: float) -> float:
        """The value that a smooth row stands for; a probability is at most 1."""
        if self.rows == "decades":
            return float(min(10.0**-row, 1.0))
        return math.sqrt(max(row, 0.0)) if self.rows == "squares" else row

    def worse(self, values: FloatArray | Sequence[FloatArray]) -> FloatArray:
        """The worst of several cases, ndarray[n_designs]."""
        return np.asarray(np.max(values, axis=0) if self.wanted == "less" else np.min(values, axis=0), dtype=float)


@dataclass(frozen=True)
class Asked:
    """What a study asks for: signal types, states that noise may confuse, any place of the light, shifts of edges, a
    population of its lights and a share of random ones (0: none), probabilities of detection and separation, tasks, a
    benchmark of vision, and own metrics. `brightest`: the curve whose light is 1, where that is no clear pixel.
    """

    classes: tuple[str, ...]
    states: tuple[str, ...] = ()
    any_place: bool = False
    edge_shift: bool = False
    population: bool = False
    wanted_yield: float = 0.0
    tasks: tuple[TaskName, ...] = ()
    probabilities: bool = False
    vision: bool = False
    own: tuple[OwnMetric, ...] = ()
    brightest: str = ""


class Metric(ABC):
    """Columns that are computed together. A file in `metrics/columns/` holds a class of one of the kinds below.

    `order`: where its columns stand among those of the others.
    """

    order: ClassVar[int]

    @abstractmethod
    def quantities(self, asked: Asked) -> Sequence[Quantity]:
        """Its columns in a study; none where they are not asked for."""


class DesignMetric(Metric):
    """What designs give without any light."""

    @abstractmethod
    def of_designs(self, setup: Setup, block: Block) -> Columns:
        """Each column, ndarray[n_designs]."""


class ReadoutMetric(Metric):
    """What the digital numbers of a scene give."""

    @abstractmethod
    def of_readout(self, response: FloatArray, members: Mapping[str, IndexArray]) -> Columns:
        """Each column at one place and moment of the light, ndarray[n_designs]; the worst one of all counts.

        `response`: ndarray[n_designs, n_signals, n_channels], DN; `members`: signal type -> indices of its signals.
        """


class NoiseMetric(Metric):
    """What mean and variance of a noisy scene give. `extra`: only where a study asks for probabilities."""

    extra: ClassVar[bool] = False

    @abstractmethod
    def of_noise(
        self, imager: ForwardModel, curves: FloatArray, read: NoisyReadout, members: Mapping[str, IndexArray]
    ) -> Columns:
        """Each column, the worst over all places and moments, ndarray[n_designs].

        `read`: what the camera reads of `curves`, ndarray[n_designs, n_modified, n_wavelengths]; `members`: state ->
        indices of its signals.
        """


class VisionMetric(Metric):
    """What images of signal heads give, where a study asks for a benchmark of vision."""

    @abstractmethod
    def of_images(self, setup: Setup, curves: FloatArray, vision: Vision, seed: int) -> Columns:
        """Each column, ndarray[n_designs]; `seed`: the study's.

        `curves`: ndarray[n_designs, n_modified, n_wavelengths].
        """


class FamilyMetric(Metric):
    """What parameters of a family say."""

    @abstractmethod
    def of_parameters(self, family: Family | None, points: FloatArray) -> Columns:
        """Each column, ndarray[n_designs], NaN where a design has none; `points`: ndarray[n_designs, n_parameters]."""
