"""Columns of the result table, and metrics that compute them."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..base.types import Array, Float, FloatArray, PerChannel
from ..camera.mosaic import Mosaic
from ..camera.setup import Feature, Setup
from ..spectra.lights import Pair
from .separation import pixel_roots
from .smooth import Rows, SmoothDesign
from .user_metrics import UserMetric

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

WORST = "worst_"
"""How the name of a quantity's worst case begins: over shifts of the edges in production, and over the population of
the lights."""
WORST_CASE: Literal["worst case"] = "worst case"
YIELD = "yield_"
"""Prefix of the columns of a yield: values that the wanted share of drawn lamps and cameras reaches."""
OF_A_SHARE: Literal["yield"] = "yield"
BEST_PHASE = "best_phase_"
"""How the name of a CSD's largest value over the places where the light may fall on the mosaic begins, each at its
worst moment of a pulsed light."""
DN = "DN"
"""Unit of digital numbers."""
UPPER_BOUND = "upper_bound"
"""Column of what no filter exceeds, beside the answer of a search, in the unit of the objective."""
LOG10 = "decades"
"""Unit of how far an error is below 1: its logarithm to base 10."""
Columns = dict[str, FloatArray]
End = Literal["min", "max"]


@dataclass(frozen=True)
class Column:
    """Column in words and facts, as a run keeps it.

    `unit`: unit; empty for a ratio.
    """

    name: str
    metric: str
    meaning: str
    unit: str = ""
    label: str = ""
    digits: int = 4
    direction: Literal["more", "less", ""] = ""
    role: Literal["separation", "light", ""] = ""
    extreme: Literal["worst case", "best place", "yield", ""] = ""
    of: str = ""
    pair: Pair | None = None

    @property
    def words(self) -> str:
        """Name in texts."""
        return self.label or self.name

    @property
    def axis(self) -> str:
        """Name with unit, for an axis."""
        return f"{self.words} / {self.unit}" if self.unit else self.words

    def amount(self, value: float, digits: int | None = None) -> str:
        """Format a value with its unit.

        `digits`: digits after the point, instead of those of the column.
        """
        places = self.digits if digits is None else digits
        return f"{value:.{places}f} {self.unit}" if self.unit else f"{value:.{self.digits}f}"

    def formatted(self, value: float) -> str:
        """Format a value for sentences and plots: in DN whole from 10 on."""
        return self.amount(value, 0 if self.unit == DN and abs(value) >= 10 else None)

    def format_bound(self, value: float) -> str:
        """Format an upper bound, rounded up."""
        digits = 1 if self.unit == DN and abs(value) >= 10 else self.digits
        return self.amount(math.ceil(value * 10**digits) / 10**digits, digits)


@dataclass(frozen=True)
class LinearRows:
    """Quantity as rows of the curve N of one modified channel: rows @ N + constant is `scale` times each of them.

    The smallest is the quantity if more is wanted, else the largest.
    """

    rows: csr_matrix
    constant: float = 0.0
    scale: float = 1.0


@dataclass(frozen=True)
class Quantity(Column):
    """Column that is computed, with the properties that constraints, search and upper bound need.

    Parameters
    ----------
    ends : tuple of str
        Ends that a constraint may have; left out, the least if more is wanted, and the most if less is.
    constrained : bool
        A constraint may name it.
    goal : bool
        A search may maximize it (or minimize it, if less is wanted).
    needs : {'modified', 'family', 'own', ''}
        It exists only with a modified channel, in some families, or for some CFAs.
    infinite, signed : bool
        It may be infinite, or negative.
    nominal : bool
        It has no worst case.
    scale : {'linear', 'squared', 'log10'}
        Form of its smooth rows.
    distance_kind : {'', 'DN', 'noise', 'chromatic'}
        Smallest distance of two signals: in DN, in units of the noise, or over all brightnesses in DN.
    per_pixel : bool
        Every pixel of the tile counts, not each channel once.
    most : float
        Upper bound on any filter.
    share : bool
        Smallest ratio of a curve to its base.
    states : tuple of str
        Signal types that noise may confuse.
    slopes : bool
        Its rows have derivatives.
    smooth, smooth_members, yield_rows : callable, optional
        Smooth rows of a design, over a population, over random lamps and cameras.
    linear : callable, optional
        Linear rows.
    """

    ends: tuple[End, ...] = ()
    constrained: bool = True
    goal: bool = False
    needs: Literal["modified", "family", "own", ""] = ""
    infinite: bool = False
    signed: bool = False
    nominal: bool = False
    scale: Literal["linear", "squared", "log10"] = "linear"
    distance_kind: Literal["", "DN", "noise", "chromatic"] = ""
    per_pixel: bool = False
    most: float = np.inf
    share: bool = False
    states: tuple[str, ...] = ()
    slopes: bool = True
    smooth: Callable[[SmoothDesign], Rows] | None = field(default=None, repr=False)
    smooth_members: Callable[[SmoothDesign], Rows] | None = field(default=None, repr=False)
    yield_rows: Callable[[SmoothDesign], Rows] | None = field(default=None, repr=False)
    linear: Callable[[Setup], LinearRows] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        usual: dict[str, tuple[End, ...]] = {"more": ("min",), "less": ("max",), "": ()}
        ends = (self.ends or usual[self.direction]) if self.constrained else ()
        object.__setattr__(self, "ends", ends)

    @property
    def has_error_bound(self) -> bool:
        """True for a CSD, also at its best place, which the error bound of a plan covers."""
        return (self.distance_kind == DN and not self.per_pixel) or self.extreme == "best place"

    @property
    def has_limit(self) -> bool:
        """True if an upper bound on any filter exists."""
        return bool(self.distance_kind) or self.share or self.linear is not None

    @property
    def column(self) -> Column:
        """The part that a run keeps."""
        return Column(**{column.name: getattr(self, column.name) for column in fields(Column)})

    def factors(self, mosaic: Mosaic) -> PerChannel:
        """Return the factors of readings in its distances."""
        return pixel_roots(mosaic) if self.per_pixel else np.ones(len(mosaic.channels))

    def worst(self, over: Sequence[str]) -> Quantity:
        """Return the worst case of the quantity."""
        meaning = f"the worst case of `{self.name}` over {' and '.join(over)}"
        label = f"worst-case {self.words}"
        return replace(
            self, name=WORST + self.name, meaning=meaning, label=label, extreme=WORST_CASE, of=self.name, goal=True
        )

    def of_share(self, share: float, drawn: str) -> Quantity:
        """Return the value that a share of what is drawn has, in words."""
        percent = f"{100 * share:.10g} %"
        meaning = (
            f"at least {percent} of the drawn {drawn} (`population`, `production`, `uncertainty`) have this "
            f"`{self.name}`, and with 95 % confidence {percent} of all, where the design was not chosen by the same "
            "draws: the mean of draws of a rank so low, before clipping and rounding, with all effects; it has no "
            "upper bound"
        )
        label = f"{self.words} of {percent} of drawn {drawn}"
        named = replace(self, name=YIELD + self.name, meaning=meaning, label=label, extreme=OF_A_SHARE, of=self.name)
        unknown = replace(named, distance_kind="", linear=None, smooth_members=None)
        return replace(unknown, scale="linear", smooth=self.yield_rows, yield_rows=None)

    def value(self, rows: Rows) -> float:
        """Return the quantity from its smooth rows."""
        most = self.direction == "less" and self.scale != "log10"
        return self.of_row(float(rows.values.max() if most else rows.values.min()))

    def of_row(self, row: float) -> float:
        """Return the value that a smooth row stands for; a probability is at most 1."""
        if self.scale == "log10":
            return float(min(10.0**-row, 1.0))
        return math.sqrt(max(row, 0.0)) if self.scale == "squared" else row

    def worse(
        self, values: Float[Array, " cases *conditions"] | Sequence[Float[Array, "*conditions"]]
    ) -> Float[Array, "*conditions"]:
        """Return the worst of several cases."""
        return np.asarray(np.max(values, axis=0) if self.direction == "less" else np.min(values, axis=0), dtype=float)


@dataclass(frozen=True)
class RequestedQuantities:
    """Quantities requested by a study.

    `wanted_yield`: share of random lamps and cameras; 0: none; `features`: those that are asked for, and what their
    columns depend on; `brightest`: curve whose light is 1, if there is no clear pixel.
    """

    classes: tuple[str, ...]
    states: tuple[str, ...] = ()
    any_place: bool = False
    edge_shift: bool = False
    population: bool = False
    wanted_yield: float = 0.0
    features: tuple[tuple[str, Hashable], ...] = ()
    user_metrics: tuple[UserMetric, ...] = ()
    brightest: str = ""

    def asked(self, feature: str) -> Any:
        """Return what the columns of a feature depend on; None where it is not asked for."""
        return dict(self.features).get(feature)


def asked_of(features: Mapping[str, Feature]) -> tuple[tuple[str, Hashable], ...]:
    """Return what is asked of features, for `RequestedQuantities`."""
    return tuple((name, feature.columns) for name, feature in features.items())
