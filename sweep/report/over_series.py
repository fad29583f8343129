"""Worst values over a series, also between its scenarios: of the search's answer beside other designs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..metrics.columns.flicker import FALSE_HUE, LAMP_SEEN, MODULATION
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.quantity import Column
from ..results.output import Output
from ..results.tables import REFERENCE, SEARCHED
from ..study.axes import series_of
from .leaders import Row, label, of_reference
from .noise import rounded
from .series import over_series, quantity_of, scene_in_words

if TYPE_CHECKING:
    import pandas as pd

_ALL = 1 - 1e-9


def searched_series(output: Output) -> tuple[str, str] | None:
    """Return series and key that the answer of the search is the worst over, if its refined values are known."""
    search = output.provenance.search
    if search is None or search.scenarios < 2 or output.worst is None:
        return None
    known = output.worst[output.worst["quantity"] == output.goal.name]
    series = [group for group, scenarios in series_of(output.scenarios).items() if search.scenario in scenarios]
    return series[0] if series and (known["series"] == series[0][0]).any() else None


@dataclass(frozen=True)
class WorstOfSeries:
    """The answer's worst value over its series beside that of the plain CFA with the largest one, and of others.

    `least`: worst value, and the number at which it is, by design. `light`: of each CFA. `loses`: numbers of scenarios
    at which the rival has more. `of`: what the light is a share of.
    """

    column: Column
    series: str
    unit: str
    name: str
    rival: str | None
    least: Mapping[str, tuple[float, float]]
    light: Mapping[str, float]
    loses: tuple[float, ...]
    of: str

    def value(self, design: str) -> str:
        """Worst value of a design, rounded down."""
        value = self.least[design][0]
        return f"{rounded(value, up=False) if value > 0 else 0} {self.column.unit}".rstrip()

    def _beside(self, design: str) -> str:
        return f"{self.value(design)} (at {self.least[design][1]:.3g} {self.unit})"

    @property
    def ratio(self) -> str:
        """The answer's worst as a multiple of the rival's."""
        assert self.rival is not None
        return f"{self.least[self.name][0] / self.least[self.rival][0]:.2f}"

    @property
    def words(self) -> str:
        """Sentence without its subject."""
        text = f"has a {self.column.words} of at least {self._beside(self.name)} {self.series}"
        text += f", at {self.light[self.name]:.3f} {self.of}"
        if self.rival is not None:
            text += (
                f". {self.rival} has at least {self._beside(self.rival)} at {self.light[self.rival]:.3f}: {self.ratio} "
            )
            text += f"times its worst and {self.light[self.name] / self.light[self.rival]:.2f} times its light"
            more = ", ".join(f"{number:.3g}" for number in self.loses)
            text += f"; {self.rival} has more at {more} {self.unit}" if self.loses else ""
        others = [f"{other} {self._beside(other)}" for other in self.least if other not in (self.name, self.rival)]
        return text + (f". Others: {', '.join(others)}" if others else "")

    @property
    def numbers(self) -> list[tuple[str, str, str]]:
        """Value, name and comparison of the first screen."""
        beside = "" if self.rival is None else f"{self.ratio} times {self.rival}'s worst ({self.value(self.rival)})"
        light = "" if self.rival is None else f"{self.light[self.name] / self.light[self.rival]:.2f} times {self.rival}"
        light += "" if self.rival is None else f" ({self.light[self.rival]:.3f})"
        return [
            (self.value(self.name), f"worst {self.column.words} {self.series}", beside),
            (f"{self.light[self.name]:.3f}", self.of, light),
        ]


def worst_of_series(output: Output, best: Row) -> WorstOfSeries | None:
    """Return the worst of the answer over its series; None if its refined values are not known."""
    group = searched_series(output)
    if group is None or best["kind"] != SEARCHED or output.worst is None:
        return None
    goal, scenarios, (_, unit) = output.goal, series_of(output.scenarios)[group], quantity_of(group[1])
    known = output.worst[(output.worst["series"] == group[0]) & (output.worst["quantity"] == goal.name)].dropna()
    least = {str(row["name"]): (float(row["value"]), float(row["at"])) for row in known.to_dict("records")}
    light = {str(row["name"]): float(row[CFA_SENSITIVITY]) for row in output.named_rows.to_dict("records")}
    plain = [name for name in output.kind(REFERENCE)["name"].unique() if least.get(name, (0.0, 0.0))[0] > 0]
    rival, name, numbers = max(plain, key=lambda cfa: least[cfa][0], default=None), label(best), [*scenarios.values()]
    loses: tuple[float, ...] = ()
    if rival is not None:
        values = over_series(output.named_rows, scenarios, goal.name)
        pairs = zip(numbers, values[name], values[rival], strict=True)
        loses = tuple(number for number, mine, its in pairs if its > mine)
    series = f"from {numbers[0]:g} to {numbers[-1]:g} {unit}"
    return WorstOfSeries(goal, series, unit, name, rival, least, light, loses, of_reference(output))


def flicker_lines(output: Output) -> Iterator[str]:
    """Yield how pulsed lamps look in an HDR pixel: over series of pulses at their worst number, or by scenario."""
    if LAMP_SEEN not in output.named_rows or output.named_rows[LAMP_SEEN].isna().all():
        return
    worst = output.worst
    if worst is None or not (worst["quantity"] == LAMP_SEEN).any():
        pulsed = output.named_rows.dropna(subset=[LAMP_SEEN])
        least = min(pulsed.to_dict("records"), key=lambda row: float(row[LAMP_SEEN]))
        share = f"{_percent(least[LAMP_SEEN])} of the phases ({least['name']} in {scene_in_words(least['scenario'])})"
        yield f"Pulsed lamps are seen in {'all phases' if least[LAMP_SEEN] > _ALL else f'as few as {share}'}."
        return
    known = worst.dropna().reset_index(drop=True)
    seen, modulated, hue = (
        known.loc[getattr(known[known["quantity"] == name]["value"], which)()]
        for name, which in ((LAMP_SEEN, "idxmin"), (MODULATION, "idxmax"), (FALSE_HUE, "idxmax"))
    )
    share = f"as few as {_percent(seen['value'])} of the phases ({_where(seen)})"
    hues = known[known["quantity"] == FALSE_HUE].groupby("name", sort=False)["value"].max()
    others = [f"{name} {value:,.3g} DN" for name, value in hues.items() if name != hue["name"]]
    yield (
        f"Pulsed lamps are seen in {'all phases' if seen['value'] > _ALL else share}; their modulation is at most "
        f"{modulated['value']:.2f} ({_where(modulated)}), their false hue at most {hue['value']:.3g} DN "
        f"({'; '.join([_where(hue), *others])})."
    )


def _percent(share: float) -> str:
    """Return a share, rounded down."""
    return f"{np.floor(1000 * share) / 10:.1f} %"


def _where(row: pd.Series[Any]) -> str:
    name, unit = quantity_of(str(row["key"]))
    number = f"{row['at']:.3g}"
    return f"{row['name']} at {f'{number} {unit}' if unit else f'a {name} of {number}'}"
