"""Fronts of several runs on the same axes, and what each dominates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ...base.types import FloatArray
from ...metrics.objective import COMBINED
from ...metrics.pareto import hypervolume
from ...metrics.quantity import DN, WORST_CASE
from ...metrics.share import told_share
from ...results.tables import FOUND
from .. import Output

_STEP = 0.01
_BELOW = 1e-9


@dataclass(frozen=True)
class ComparedFront:
    """The trade-off of a CFA in a scenario of a run.

    `traced`: by the search, before quantization; else designs of the result table. `points`: ndarray[n, 2],
    separation and sensitivity, by rising sensitivity.
    """

    run: str
    cfa: str
    scenario: str
    traced: bool
    points: FloatArray

    @property
    def name(self) -> str:
        """What a legend calls it."""
        return f"{self.run}, {self.cfa}{', traced by the search' if self.traced else ''}"


@dataclass(frozen=True)
class Region:
    """Where hypervolumes are taken: above `reference`, ndarray[2]; `top`: the largest that any front reaches."""

    reference: FloatArray
    top: FloatArray

    @property
    def area(self) -> float:
        """Separation x sensitivity."""
        return float(np.prod(self.top - self.reference))


def on_the_same_axes(runs: Mapping[str, Output]) -> tuple[dict[str, Output], list[str]]:
    """The largest group of runs whose fronts have the same meaning, and a sentence where that is not all of them."""
    groups: dict[tuple[str, ...], dict[str, Output]] = {}
    for label, output in runs.items():
        groups.setdefault(_meaning(output), {})[label] = output
    if len(groups) == 1:
        return dict(runs), []
    chosen = max(groups.values(), key=len)
    each = "; ".join(f"{', '.join(group)}: {' / '.join(axes)}" for axes, group in groups.items())
    if len(chosen) == 1:
        return {}, [f"The fronts have different axes ({each}), so none are compared."]
    return chosen, [f"The fronts have different axes ({each}); compared are those of {' and '.join(chosen)}."]


def dn_of(output: Output) -> str:
    """What a DN of a run is: only of the same full scale and pedestal do they compare."""
    pixel = output.study.pixel
    return f"DN of {pixel.bits} bits" + (f", pedestal {pixel.offset_dn:g} DN" if pixel.offset_dn else "")


def _meaning(output: Output) -> tuple[str, ...]:
    """What the two axes are; of a combined objective, of a worst case, of DN with all that it depends on."""
    production, population = output.study.production, output.study.population
    over = [f"edges {production.edge_shift_nm:g} nm off"] if production.edge_shift_nm else []
    over += [f"films {production.thickness:.2%} off"] if production.thickness else []
    over += [] if population is None else [population.told]
    shifted = any(output.columns[name].extreme == WORST_CASE for name in output.objective.weights)
    words = []
    for axis in output.trade_off:
        combined = axis.name == COMBINED
        text = str(output.objective) if combined else axis.words
        off = axis.extreme == WORST_CASE or (combined and shifted)
        dependent = f" ({', '.join(over)})" if off else ""
        words.append(f"{text}{dependent}" + (f" in {dn_of(output)}" if axis.unit == DN or combined else ""))
    return tuple(words)


def common_scenarios(runs: Mapping[str, Output]) -> list[str]:
    """Scenarios of this name in every run, in the order of the first."""
    (first, *others) = runs.values()
    return [name for name in first.scenarios if all(name in other.scenarios for other in others)]


def fronts(runs: Mapping[str, Output], scenario: str) -> list[ComparedFront]:
    """All fronts of a scenario: of designs, which meet every constraint but those on the axes, and of the search."""
    found = []
    for label, output in runs.items():
        table = output.table
        rows = table[table["pareto"] & (table["scenario"] == scenario)]
        for cfa, own in rows.groupby("cfa", observed=True, sort=False):
            found.append(
                ComparedFront(label, str(cfa), scenario, False, _sorted(own[list(output.provenance.trade_off)]))
            )
        search = output.provenance.search
        if output.front is not None and search and search.scenario == scenario:
            traced = _sorted(output.front[["objective", "sensitivity"]].dropna())
            if len(traced):
                found.append(ComparedFront(label, str(output.kind(FOUND)["cfa"].iloc[0]), scenario, True, traced))
    return found


def _sorted(values: pd.DataFrame) -> FloatArray:
    points = np.unique(values.to_numpy(dtype=float), axis=0)
    return points[np.argsort(points[:, 1], kind="stable")]


def box_of(found: list[ComparedFront]) -> Region:
    """The box of all fronts: from no separation, and the hundredth below the lowest sensitivity of any."""
    points = np.concatenate([front.points for front in found])
    lowest = math.floor((points[:, 1].min() - _BELOW) / _STEP) * _STEP
    return Region(np.array([min(0.0, points[:, 0].min()), round(lowest, 2)]), points.max(axis=0))


def hypervolumes(found: list[ComparedFront], box: Region) -> pd.DataFrame:
    """A row per front: its ends, the area that it dominates in the box, and that as a share of the box."""
    rows = []
    for front in found:
        area, (low, high) = (
            hypervolume(front.points, box.reference),
            (front.points.min(axis=0), front.points.max(axis=0)),
        )
        rows.append(
            {
                "run": front.run,
                "CFA": front.cfa,
                "front": "traced by the search" if front.traced else "designs",
                "points": len(front.points),
                "separation / DN": f"{low[0]:.1f} to {high[0]:.1f}",
                "sensitivity": f"{low[1]:.4f} to {high[1]:.4f}",
                "hypervolume": area,
                "of the box": told_share(area / box.area) if box.area > 0 else "-",
            }
        )
    return pd.DataFrame(rows)
