"""How exact two parameters must be: the most that any swept or searched filter has at each pair of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ...base.types import Array, Bool, BoolArray, Float
from ...metrics.quantity import Column
from ...results.manifest import Manifest
from ...results.output import Output
from ...results.tables import SWEPT, word_mask
from ..bands import map_lines
from ..leaders import leaders_of, reference_of
from ..panels import Map, Picture
from ..section import Section
from ..words import amount, of_column, quantity

_FEWEST = 5
_WORDS = {
    "left_nm": "left edge / nm",
    "right_nm": "right edge / nm",
    "peak_nm": "peak of the band / nm",
    "fwhm_nm": "width of the band, FWHM / nm",
}


@dataclass(frozen=True)
class Edges(Section):
    """The largest separation over two parameters; NaN where no filter meets the constraints.

    `best`: parameters and separation of the answer; `levels`: of RGGB; `bands`: what is known of absorption bands.
    """

    column: Column
    names: tuple[str, str]
    x: Float[Array, " columns"]
    y: Float[Array, " rows"]
    most: Float[Array, "rows columns"]
    best: tuple[float, float, float] | None
    levels: tuple[tuple[str, float], ...]
    bands: tuple[str, ...]

    heading = "How exact it must be"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a map of the search, or a grid over two edges."""
        column, scenario = output.trade_off[0], leaders_of(output).scenario
        best, rggb = leaders_of(output).chosen, reference_of(output, scenario)
        levels = () if rggb is None else ((str(rggb["name"]), float(rggb[column.name])),)
        if output.map is not None and output.study.search is not None and output.study.search.map:
            x_name, y_name = (list(output.study.search.map) * 2)[:2]
            rows = output.map.assign(most=np.where(output.map["feasible"], output.map["objective"], np.nan))
            table = rows.pivot_table(index=y_name, columns=x_name, values="most", dropna=False)
        else:
            grid = next(((name, sweep) for name, sweep in output.study.sweeps.items() if sweep.grid is not None), None)
            if grid is None or best is None or grid[1].cfa != best["cfa"]:
                return
            x_name, y_name = "left_nm", "right_nm"
            axes = grid[1].grid or {}
            if not all(name in axes and axes[name].size >= _FEWEST for name in (x_name, y_name)):
                return
            parts = []
            for part in Manifest(output.folder).batches(
                ("kind", "space", "scenario", "feasible", x_name, y_name, column.name)
            ):
                of_grid = (
                    word_mask(part, "kind", SWEPT)
                    & word_mask(part, "space", grid[0])
                    & word_mask(part, "scenario", scenario)
                )
                rows = part.filter(of_grid).to_pandas()
                most = rows[column.name].where(rows["feasible"])
                parts.append(most.groupby([rows[y_name], rows[x_name]]).max())
            table = pd.concat(parts).groupby(level=[0, 1]).max().unstack()
        known = np.isfinite(table.to_numpy(dtype=float))
        table = table.iloc[_around(known.any(axis=1)), _around(known.any(axis=0))]
        if (
            min(table.shape) < (2 if output.map is not None else _FEWEST)
            or not np.isfinite(table.to_numpy(dtype=float)).any()
        ):
            return
        at = None
        if best is not None and np.isfinite([float(best.get(name, np.nan)) for name in (x_name, y_name)]).all():
            at = float(best[x_name]), float(best[y_name]), float(best[column.name])
        yield cls(
            column, (x_name, y_name), table.columns.to_numpy(dtype=float), table.index.to_numpy(dtype=float), table.to_numpy(dtype=float), at, levels,
            tuple(map_lines(output)),
        )  # fmt: skip

    @property
    def answer(self) -> list[str]:
        """Which values still beat RGGB."""
        if self.bands or not self.levels:
            return [*self.bands]
        name, level = self.levels[0]
        above = self.most > level
        if not above.any():
            return [f"No filter here separates more than {name} ({of_column(self.column, level)})."]
        x, y = self.x[above.any(axis=0)], self.y[above.any(axis=1)]
        what = [_WORDS.get(one, one).split(" / ")[0] for one in self.names]
        return [
            f"Filters that separate more than {name} ({of_column(self.column, level)}) have a {what[0]} from {x[0]:g} to {amount(float(x[-1]), 'nm')} and a "
            f"{what[1]} from {y[0]:g} to {amount(float(y[-1]), 'nm')}, of those computed."
        ]

    @property
    def picture(self) -> Picture | None:
        """The map."""
        labels = [_WORDS.get(name, name) for name in self.names]
        mark = None if self.best is None else (self.best[0], self.best[1], of_column(self.column, self.best[2]))
        panel = Map(
            f"{quantity(self.column)} / {self.column.unit}",
            labels[0],
            labels[1],
            self.x,
            self.y,
            self.most,
            tuple((v, f"{n} {v:.0f}") for n, v in self.levels),
            mark,
        )
        return Picture(
            (panel,),
            "Largest separation over two parameters.",
            "Each place: the most of all feasible filters with these two parameters; gray: none. Dark is more.",
        )


def _around(known: Bool[BoolArray, " places"]) -> slice:
    """Return the places in which something is known, and two beside them."""
    at = np.flatnonzero(known)
    return slice(max(0, int(at[0]) - 2), int(at[-1]) + 3) if at.size else slice(0)
