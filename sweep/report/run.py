"""What a page asks of a finished run: its designs, the one that answers, figures as columns, numbers over scenes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from ..base.errors import UpperBoundExceededError, ValidationIssue
from ..base.types import Array, Float
from ..features import gathered
from ..metrics.columns.chromatic import CHROMATIC_CSD, CHROMATIC_ERROR
from ..metrics.columns.color_separation import CSD
from ..metrics.columns.confusion import STATE_ERROR
from ..metrics.columns.pixel_separation import CHROMATIC_PIXEL_CSD, PIXEL_CSD
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.quantity import DN
from ..metrics.quantity import Column as Quantity
from ..results.output import Output
from ..results.tables import NAMED, REFERENCE, RGGB, SEARCHED, SWEPT, WORST
from ..study.axes import series_of
from .numbers import ERROR, NARROW, SHARE, Span, amount, digits, joined, ranges
from .tables import PROVEN, Axis, Column, Marks

LIGHT = CFA_SENSITIVITY
_ERRORS = (CHROMATIC_ERROR, STATE_ERROR)
AXES = {
    "distance_m": ("distance", "m"),
    "exposure_s": ("exposure time", "s"),
    "visibility_m": ("visibility", "m"),
    "frequency_hz": ("pulse frequency", "Hz"),
    "duty": ("share of the time on", SHARE),
    "intensity_cd": ("luminous intensity", "cd"),
    "read_noise_e": ("read noise", "e"),
    "dark_e_per_s": ("dark current", "e/s"),
    "cra_deg": ("chief ray angle", "degrees"),
    "f_number": ("f-number", ""),
    "level": ("exposure of white", SHARE),
    "bits": ("bit depth", "bits"),
    "pitch_um": ("pixel pitch", "µm"),
    "crosstalk": ("crosstalk", SHARE),
    "prnu": ("PRNU", SHARE),
    "leak": ("leak of the IR cut", SHARE),
}
"""Last parts of keys of scenes in words, with units."""
COUNTED = {
    CSD: "each channel",
    PIXEL_CSD: "every pixel",
    CHROMATIC_CSD: "any brightness",
    CHROMATIC_PIXEL_CSD: "every pixel, any brightness",
}
"""Ways to count a separation."""
_LEAST_STEADY = 4.0


def _short() -> dict[str, str]:
    """Return what a separation costs, in few words."""
    return {LIGHT: "light"} | gathered("PRICES", "page")


def name_of(row: Mapping[Any, Any]) -> str:
    """Return a design's name, or its number."""
    return str(row["name"]) if isinstance(row["name"], str) else f"filter {row['filter_id']}"


def unit_of(quantity: Quantity) -> str:
    """Return the unit that `numbers` reads: a light is a share, a probability an error."""
    return SHARE if quantity.role == "light" else ERROR if quantity.metric in _ERRORS else quantity.unit


def words_of(quantity: Quantity) -> str:
    """Return a quantity's name in words of people: a CSD is a separation."""
    words = quantity.words.replace("CSD", "separation")
    if words.startswith("chromatic ") and "separation" in words:
        return f"{words.removeprefix('chromatic ')}, any brightness"
    return _short().get(quantity.name, words)


@dataclass(frozen=True)
class Series:
    """Scenes that one number tells apart: `scenes` are their names with the numbers, in ascending order."""

    name: str
    key: str
    scenes: Mapping[str, float]

    @cached_property
    def x(self) -> Float[Array, " _scenes"]:
        """The numbers."""
        return np.array([*self.scenes.values()])

    @cached_property
    def axis(self) -> Axis:
        """Their axis, logarithmic where they grow by factors."""
        name, unit = AXES.get(self.key, (self.key.replace("_", " "), ""))
        low, high = float(self.x.min()), float(self.x.max())
        steady = low > 0 and len(self.x) > 2 and float(np.ptp(np.diff(np.log(self.x)))) < 0.06
        return Axis(name, unit, low, high, bool(low > 0 and high / low > (_LEAST_STEADY if steady else 15)))

    @property
    def whole(self) -> Span:
        """The least and the largest number."""
        return self.axis.low, self.axis.high

    def marks(self, spans: Sequence[Span], most: int = 3) -> Marks:
        """Return ranges of the numbers as a cell; `most`: digits of their ends."""
        low, high = self.whole
        shown = [(max(first, low), min(last, high)) for first, last in spans]
        return Marks(shown, (), ranges(spans, self.axis.unit, self.whole, most))

    def spans(self, mask: Any, passes: Sequence[float]) -> list[Span]:
        """Return the ranges in which something holds, by the places at which that changes; infinite beyond the numbers."""
        ends = [*([-np.inf] if mask[0] else []), *map(float, passes), *([np.inf] if mask[-1] else [])]
        return list(zip(ends[::2], ends[1::2], strict=True))

    def above(self, y: Float[Array, " _scenes"], least: Any) -> list[Span]:
        """Return where a line is above another, by straight lines between the numbers, as they are drawn."""
        across = np.log(self.x) if self.axis.log else self.x
        gap = np.nan_to_num(y, nan=-np.inf) - np.broadcast_to(least, np.shape(y))
        ends = []
        for at in np.flatnonzero((gap[:-1] >= 0) != (gap[1:] >= 0)):
            known = np.isfinite(gap[at : at + 2]).all()
            share = gap[at] / (gap[at] - gap[at + 1]) if known else float(gap[at] < 0)
            place = across[at] + share * (across[at + 1] - across[at])
            ends.append(float(np.exp(place) if self.axis.log else place))
        return self.spans(gap >= 0, ends)


class Run:
    """A finished run, as a page asks it."""

    def __init__(self, output: Output) -> None:
        self.output, self.study, self.facts = output, output.study, output.provenance
        self.goal, self.scene = output.trade_off[0], output.scenario

    @cached_property
    def rows(self) -> pd.DataFrame:
        """Designs with names in all scenes that could be computed, with their worst chromatic error."""
        rows = self.output.named_rows
        rows = rows[(rows["status"] == "ok") & rows["name"].notna()].astype({"name": str, "scenario": str})
        chromatic = [column.name for column in self.output.columns.values() if column.metric == CHROMATIC_ERROR]
        return rows.assign(**{CHROMATIC_ERROR: rows[chromatic].max(axis=1)}) if chromatic else rows

    @cached_property
    def here(self) -> dict[str, dict[Any, Any]]:
        """Rows of the scene that answers by name; a swept design that answers is one of them."""
        rows: dict[str, dict[Any, Any]] = {}
        for row in self.rows[self.rows["scenario"] == self.scene].to_dict("records"):
            rows[str(row["name"])] = row
        for row in self._found.head(1).to_dict("records"):
            rows.setdefault(name_of(row), row)
        return rows

    @property
    def _found(self) -> pd.DataFrame:
        best = self.output.best
        return best[best["scenario"] == self.scene]

    @cached_property
    def hero(self) -> str:
        """The design that the page is about: the best one found, else the named one with the largest goal."""
        for row in self._found.head(1).to_dict("records"):
            return name_of(row)
        named = [name for name, row in self.here.items() if row["kind"] == NAMED] or [*self.here]
        known = {name: self.here[name][self.goal.name] for name in named}
        return max(known, key=lambda name: np.nan_to_num(known[name], nan=-1.0), default="")

    @cached_property
    def reference(self) -> str:
        """RGGB, else the plain CFA that separates most."""
        plain = {name: row[self.goal.name] for name, row in self.here.items() if row["kind"] == REFERENCE}
        return RGGB if RGGB in plain else max(plain, key=lambda name: np.nan_to_num(plain[name]), default="")

    @property
    def found(self) -> str:
        """Where the design that answers comes from."""
        kind = self.here[self.hero]["kind"] if self.hero in self.here else ""
        return {SEARCHED: "of this search", SWEPT: "of this sweep"}.get(kind, "of this study")

    @cached_property
    def series(self) -> list[Series]:
        """Series of scenes."""
        return [Series(name, key, scenes) for (name, key), scenes in series_of(self.study.scenarios).items()]

    def over(self, series: Series, column: str) -> dict[str, Float[Array, " _scenes"]]:
        """Return a column over the numbers of a series, for each design that has it."""
        if column not in self.rows:
            return {}
        names = list(series.scenes)
        rows = self.rows[self.rows["scenario"].isin(names)]
        table = rows.pivot_table(column, "name", "scenario", sort=False, observed=True, dropna=False)
        lines = {str(name): line.reindex(names).to_numpy(dtype=float) for name, line in table.iterrows()}
        return {name: line for name, line in lines.items() if np.isfinite(line).any()}

    def values(self, column: str) -> dict[str, float]:
        """Return a figure of every design in the scene that answers; the reference and the hero come first."""
        order = sorted(self.here, key=lambda name: (name != self.reference, name != self.hero))
        return {name: float(self.here[name].get(column, np.nan)) for name in order}

    def value(self, name: str, column: str) -> float | None:
        """Return a figure of a design in the scene that answers."""
        return float(self.here[name][column]) if name in self.here and column in self.here[name] else None

    def column(self, name: str, label: str = "", group: str = "") -> Column:
        """Return a quantity as a column of a table; `label`: what it is called there."""
        quantity = self.output.columns[name]
        words = words_of(quantity)
        if not label and quantity.pair is not None and quantity.metric in COUNTED:
            group = f"{'/'.join(quantity.pair)} separation"
            words = words.removeprefix(f"{group} ") if quantity.extreme else COUNTED[quantity.metric]
        return Column(label or words, unit_of(quantity), quantity.direction, quantity.meaning, None, group)

    def figure(self, name: str, label: str = "", group: str = "") -> tuple[Column, dict[str, float]]:
        """Return a figure of every design as a column with its values."""
        column, limit = self.column(name, label, group), self.limit(name)
        return replace(column, label=f"{column.label} ({limit})") if limit else column, self.values(name)

    @property
    def prices(self) -> list[str]:
        """Columns of what a separation costs beside light."""
        return [name for name in self.figures if name in _short() and name != LIGHT]

    @property
    def asked(self) -> str:
        """The column that the search maximized or minimized, if that is not the separation."""
        name = self.output.goal.name
        return name if name not in (self.goal.name, LIGHT) and name in self.output.columns else ""

    @property
    def figures(self) -> list[str]:
        """The columns that matter of a design in one scene: the goal, the same counted otherwise, light, what it costs."""
        goal, known = self.goal, self.output.columns
        names = [*([self.asked] if self.asked else []), goal.name, *([goal.of] if goal.extreme else [])]
        plain = [column for column in known.values() if not column.extreme]
        names += [c.name for metric in COUNTED for c in plain if c.metric == metric and c.pair == goal.pair and c.pair]
        limited = gathered("PRICES_IF_LIMITED", "page").keys() - self.output.constraints.keys()
        names += [name for name in _short() if name in known and name not in limited]
        return list(dict.fromkeys(names))

    @cached_property
    def bound(self) -> tuple[str, float] | None:
        """The proven upper bound on the goal where there is one: for which filters, as the name of a row, and the bound.

        Raises UpperBoundExceededError: a filter that it is for is farther above it than rounding brings it.
        """
        search = self.facts.search
        if search is None or search.upper_bound_proven is None or self.output.goal.name != self.goal.name:
            return None
        rounding = math.sqrt(len(self.output.mosaic(search.cfa).channels))
        for name, row in self.here.items():
            own = row["feasible"] and row["kind"] in (SWEPT, SEARCHED) and row["cfa"] == search.cfa
            if own and row[self.goal.name] > search.upper_bound_proven + rounding:
                problem = f"{name} has more than its upper bound is"
                raise UpperBoundExceededError(ValidationIssue(problem, str(self.output.folder)))
        return f"{PROVEN}{self.place}", search.upper_bound_proven

    @property
    def full_scale(self) -> str:
        """Full scale of digital numbers, in words."""
        pixel = self.study.pixel
        read = {scene.pixel_of(pixel).full_scale_dn for scene in self.study.scenarios.values()}
        if self.goal.unit != DN or len(read) > 1:
            return ""
        most = pixel.saturation_e * pixel.dn_per_e + pixel.offset_dn if pixel.captures else read.pop()
        return f" of {most:,.0f}"

    def edges(self, name: str) -> list[float]:
        """Return the edges of a design's stopbands, nm."""
        row, found = self.here.get(name, {}), list[float]()
        for number in ("", *map(str, range(1, 10))):
            pair = [float(row.get(f"{side}{number}_nm", np.nan)) for side in ("left", "right")]
            if np.isfinite(pair).all() and row.get(f"depth{number}", 1) > 1e-3:
                found += pair
        return found

    @property
    def place(self) -> str:
        """The pixel that the search modified: `N of RYNCy`."""
        search = self.facts.search
        return f"{search.channel} of {search.cfa}" if search is not None and search.channel else ""

    def recipe(self, name: str) -> str:
        """Return what a filter is made of: its edges, its band, or its colorants; empty for other families."""
        row = self.here.get(name, {})
        if edges := self.edges(name):
            return f"{joined([f'{edge:.0f}' for edge in edges])}{NARROW}nm"
        dyes, known = [*self.output.curves.colorants], range(1, 10)
        used = [(row[f"colorant_{at}"], row[f"absorbance_{at}"]) for at in known if row.get(f"absorbance_{at}", 0) > 0]
        if used:
            return joined([f"{dyes[int(number) - 1]} of absorbance {digits(amount)}" for number, amount in used])
        if not row.get("peak_nm", 0) > 0:
            return ""
        return f"{row['peak_nm']:.0f}{NARROW}nm, FWHM {digits(row['fwhm_nm'])}{NARROW}nm, absorbance {digits(row['absorbance'])}"

    def broken(self, name: str) -> str:
        """Return whether a design meets the constraints, and if not which one it breaks."""
        row = self.here[name]
        for key, bound in self.output.constraints.items():
            column, value = self.output.columns.get(key), float(row.get(key, np.nan))
            least, most = (np.nan if end is None else end for end in (bound.min, bound.max))
            if column is not None and (value < least or value > most) and not row["feasible"]:
                return f"no: {words_of(column)}"
        return "yes" if row["feasible"] else "no"

    def limit(self, name: str) -> str:
        """Return the constraint on a figure in words."""
        bound, unit = self.output.constraints.get(name), unit_of(self.output.columns[name])
        ends = [] if bound is None else [("≥", bound.min), ("≤", bound.max)]
        return ", ".join(f"{sign} {amount(end, unit, trim=True)}" for sign, end in ends if end is not None)

    @cached_property
    def lamps(self) -> dict[str, Float[Array, " _wavelengths"]]:
        """The largest spectrum of each signal type at each wavelength, with peaks of 1."""
        bundles = self.output.curves.bundles
        return {kind: np.max(of / of.max(axis=1, keepdims=True), axis=0) for kind, of in bundles.items()}

    def modified(self, name: str) -> dict[str, Float[Array, " _wavelengths"]]:
        """Return the curves of a design's modified channels."""
        return dict(self.output.curves.designs.get(int(self.here[name]["design_id"]), {})) if name in self.here else {}

    def between(self, cfa: str) -> Iterator[str]:
        """Yield the sensor's curves between which a modified channel of a CFA lies."""
        for entry in (*self.study.designs.values(), *self.study.sweeps.values(), *self.study.boxes.values()):
            ends = (entry.base, entry.to) if entry.cfa == cfa else ()
            yield from (end for end in ends if isinstance(end, str) and end in self.output.curves.sensor)

    def worst(self, series: Series, column: str, name: str) -> list[float]:
        """Return the worst values that the run found between the numbers of a series."""
        known = self.output.tables.get(WORST)
        if known is None:
            return []
        own = (known["series"] == series.name) & (known["quantity"] == column) & (known["name"] == name)
        return [float(value) for value in known.loc[own, "value"] if np.isfinite(value)]

    @cached_property
    def names(self) -> dict[int, str]:
        """Names of the designs of the scene that answers by `design_id`."""
        return {int(row["design_id"]): name for name, row in self.here.items()}
