"""Fronts of several runs on the same axes, a table of their ends, and their plot."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ..base.types import Array, Float
from ..metrics.objective import COMBINED
from ..metrics.quantity import DN, WORST_CASE
from ..results.output import Output
from ..results.tables import SEARCHED
from .look import INK, font, label_ends, styles_of, words_at
from .panels import right_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MARKERS = "osD^vPX<>hp"
_MARKS_PER_LINE = 12


@dataclass(frozen=True)
class ComparedFront:
    """Front of a CFA in a run."""

    run: str
    cfa: str
    traced: bool
    points: Float[Array, "points 2"]


def scene_names(runs: Mapping[str, Output]) -> dict[str, dict[str, str]]:
    """Return a name for each scene: scenarios of several runs share one only if their scenes are equal."""
    names: dict[str, str] = {}
    taken = set[str]()
    shared = {}
    for run, output in runs.items():
        shared[run] = dict[str, str]()
        for scenario, scene in output.study.scenarios.items():
            content = scene.model_dump_json()
            if content not in names:
                names[content] = f"{scenario} of {run}" if scenario in taken else scenario
                taken.add(names[content])
            shared[run][scenario] = names[content] if names[content] not in shared[run].values() else scenario
    return shared


def on_the_same_axes(runs: Mapping[str, Output]) -> tuple[dict[str, Output], list[str]]:
    """Return the largest group of runs whose fronts have the same meaning."""
    groups: dict[tuple[str, ...], dict[str, Output]] = {}
    for label, output in runs.items():
        groups.setdefault(_meaning(output), {})[label] = output
    if len(groups) == 1:
        return dict(runs), []
    chosen = max(groups.values(), key=len)
    axes = "; ".join(f"{', '.join(group)}: {' / '.join(meaning)}" for meaning, group in groups.items())
    if len(chosen) == 1:
        return {}, [f"The fronts have different axes ({axes}), so none are compared."]
    return chosen, [f"The fronts have different axes ({axes}); compared are those of {' and '.join(chosen)}."]


def dn_scale_label(output: Output) -> str:
    """Return a text with bit depth and black level of a run."""
    pixel = output.study.pixel
    return f"DN of {pixel.bits} bits" + (f", pedestal {pixel.offset_dn:g} DN" if pixel.offset_dn else "")


def _meaning(output: Output) -> tuple[str, ...]:
    """Return both axes in words, with everything that a combined objective, a worst case and DN depend on."""
    production, population = output.study.production, output.study.population
    over = [f"edges {production.edge_shift_nm:g} nm off"] if production.edge_shift_nm else []
    over += [f"films {production.thickness:.2%} off"] if production.thickness else []
    over += [f"bands {production.broadening:.0%} broader"] if production.broadening else []
    over += [] if population is None else [population.description]
    shifted = any(output.columns[name].extreme == WORST_CASE for name in output.objective.weights)
    words = []
    for axis in output.trade_off:
        combined = axis.name == COMBINED
        text = str(output.objective) if combined else axis.words
        is_worst_case = axis.extreme == WORST_CASE or (combined and shifted)
        dependent = f" ({', '.join(over)})" if is_worst_case else ""
        words.append(f"{text}{dependent}" + (f" in {dn_scale_label(output)}" if axis.unit == DN or combined else ""))
    return tuple(words)


def fronts_in(runs: Mapping[str, tuple[Output, str]]) -> list[ComparedFront]:
    """Return all fronts of a scene: of designs that meet every constraint but those on the axes, and of the search."""
    fronts = []
    for label, (output, scenario) in runs.items():
        rows = output.table[output.table["pareto"] & (output.table["scenario"] == scenario)]
        for cfa, designs in rows.groupby("cfa", observed=True, sort=False):
            points = _sorted(designs[list(output.provenance.trade_off)])
            fronts.append(ComparedFront(label, str(cfa), False, points))
        search = output.provenance.search
        if output.front is not None and search and search.scenario == scenario:
            traced = _sorted(output.front[["objective", "sensitivity"]].dropna())
            if len(traced):
                fronts.append(ComparedFront(label, str(output.kind(SEARCHED)["cfa"].iloc[0]), True, traced))
    return fronts


def _sorted(values: pd.DataFrame) -> Float[Array, "points 2"]:
    points = np.unique(values.to_numpy(dtype=float), axis=0)
    return points[np.argsort(points[:, 1], kind="stable")]


def front_table(fronts: Sequence[ComparedFront]) -> pd.DataFrame:
    """Return one row per front with its ends."""
    rows = []
    for front in fronts:
        low, high = front.points.min(axis=0), front.points.max(axis=0)
        rows.append(
            {
                "run": front.run,
                "CFA": front.cfa,
                "front": "traced by the search" if front.traced else "designs",
                "points": len(front.points),
                "separation_dn": [low[0], high[0]],
                "sensitivity": [low[1], high[1]],
            }
        )
    return pd.DataFrame(rows)


def front_words(fronts: pd.DataFrame) -> pd.DataFrame:
    """Return the ends of fronts as a person reads them."""
    ends = {"separation / DN": ("separation_dn", 1), "sensitivity": ("sensitivity", 4)}
    words = {
        title: [f"{low:.{digits}f} to {high:.{digits}f}" for low, high in fronts[name]]
        for title, (name, digits) in ends.items()
    }
    return fronts.drop(columns=["separation_dn", "sensitivity"]).assign(**words)


@dataclass(frozen=True)
class Fronts:
    """Fronts of runs: a color and a dash per run, a marker per front; stars are the best designs.

    A front of designs is a staircase: between two designs there is none. Between the levels of the search, nothing is
    known. `best`: run, light and separation.
    """

    title: str
    labels: tuple[str, str]
    order: tuple[str, ...]
    fronts: tuple[ComparedFront, ...]
    best: tuple[tuple[str, float, float], ...]

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Numbers on the left, names on the right."""
        return 70, right_of((self._name(front) for front in self.fronts), wide=wide)

    def tall(self, *, wide: bool) -> float:
        """Height of the axes, px."""
        return 340 if wide else 240

    @staticmethod
    def _name(front: ComparedFront) -> str:
        return f"{front.run}, {front.cfa}{', by the search' if front.traced else ''}"

    def draw(self, axes: Axes) -> None:
        """Draw fronts, best designs and names."""
        styles = [*styles_of(self.order).values()]
        ends = {}
        for front, marker in zip(self.fronts, itertools.cycle(_MARKERS)):
            style = styles[self.order.index(front.run)]
            marked = np.unique(np.linspace(0, len(front.points) - 1, _MARKS_PER_LINE).round()).astype(int)
            axes.plot(
                front.points[:, 1], front.points[:, 0], color=style.color,
                linestyle="none" if front.traced else style.dash, linewidth=1.7, marker=marker, markersize=6,
                markerfacecolor="white" if front.traced else style.color,
                markevery=1 if front.traced else marked.tolist(), drawstyle="steps-pre",
            )  # fmt: skip
            ends[self._name(front)] = float(front.points[-1, 0]), style, False
        for name, x, y in self.best:
            style = styles[self.order.index(name)]
            axes.plot([x], [y], "*", color=style.color, markersize=15, markeredgecolor=INK, zorder=6)
            words_at(axes, f"  {name.partition(' ')[0]}", x, y, va="bottom", zorder=7)
        axes.margins(0.05)
        label_ends(axes, ends, axes.get_ylim())
        axes.set_xlabel(self.labels[0], fontsize=font(axes.figure), color=INK)  # type: ignore[arg-type]
