"""What the answering design gains and loses against RGGB, beside the tile that it changes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from ...metrics.columns.chromatic import CHROMATIC_CSD
from ...metrics.columns.color_separation import CSD
from ...metrics.columns.exposure import EXPOSURE
from ...metrics.columns.pixel_separation import CHROMATIC_PIXEL_CSD, PIXEL_CSD
from ...metrics.columns.sensitivity import CFA_SENSITIVITY
from ...metrics.quantity import Column
from ...results.output import Output
from ...spectra.lights import pair_name
from ...study.axes import series_of
from ..leaders import Row, answering, label, own_tile, reference_of
from ..section import Section, Table
from ..series import scene_in_words
from ..words import amount, change, effect, of_column, quantity

_TASKS = ("color_delta_e_mean_d65", "low_light_lux_led", "low_light_lux_a")
_MOST = 10
COUNTED = "By pixel, RGGB's two greens count as two."


@dataclass(frozen=True)
class Price(Section):
    """Quantities of RGGB, of the tile that the design changes, and of the design."""

    columns: tuple[Column, ...]
    names: tuple[str, ...]
    values: tuple[tuple[float, ...], ...]
    where: str

    heading = "The price"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it where there is a design to compare."""
        best = answering(output)
        plain = None if best is None else reference_of(output, str(best["scenario"]))
        if best is None or plain is None:
            return
        own = own_tile(output, best)
        rows = [plain, *([own] if own is not None and label(own) != label(plain) else []), best]
        columns = [
            column
            for name in _names(output)
            if (column := output.columns.get(name)) is not None and _known(column, rows)
        ]
        values = tuple(tuple(float(row[column.name]) for row in rows) for column in columns[:_MOST])
        if columns:
            yield cls(tuple(columns[:_MOST]), tuple(label(row) for row in rows), values, _where(output, best))

    @property
    def title(self) -> str:
        """In which scene."""
        return f"{self.heading} ({self.where})" if self.where else self.heading

    @property
    def table(self) -> Table | None:
        """A row each, with gain or loss against RGGB."""
        rows = []
        for column, values in zip(self.columns, self.values, strict=True):
            words = quantity(column)
            cells = [amount(value, "s") if column.name == EXPOSURE else of_column(column, value) for value in values]
            rows.append(
                (
                    words[:1].upper() + words[1:],
                    *cells,
                    change(values[-1], values[0]),
                    effect(column, values[-1], values[0]),
                )
            )
        note = ""
        effects = {column.name: row[-1] for column, row in zip(self.columns, rows, strict=True)}
        if "gain" in effects.get(CFA_SENSITIVITY, "") and any("loss" in effects.get(name, "") for name in _TASKS[1:]):
            note = (
                "Why light is a gain and lux a loss: the tile collects more light, but the color matrix that makes RGB of its channels multiplies "
                "the noise. "
            )
        if any(column.metric in (PIXEL_CSD, CHROMATIC_PIXEL_CSD) for column in self.columns):
            note += COUNTED
        return Table(
            ("", *self.names, f"against {self.names[0]}", ""),
            tuple(rows),
            note,
            len(self.names),
            2 if len(self.names) > 2 else -1,
        )


def _where(output: Output, best: Row) -> str:
    """Return the scene, where the study has others that are no series."""
    inner = {name for members in series_of(output.study.scenarios).values() for name in members}
    alone = len(output.scenarios) == 1 or inner >= {*output.scenarios}
    return "" if alone else scene_in_words(str(best["scenario"]))


def _names(output: Output) -> list[str]:
    """Return the columns of a price in order: the separation, other pairs', light, exposure, tasks."""
    separation = output.trade_off[0]
    names = [separation.name, *([separation.of] if separation.extreme else [])]
    if separation.pair is not None:
        names += [pair_name(metric, separation.pair) for metric in (CSD, PIXEL_CSD, CHROMATIC_CSD, CHROMATIC_PIXEL_CSD)]
    names += [CFA_SENSITIVITY, *_TASKS, EXPOSURE]
    names += [name for name in output.distances if output.columns[name].metric == CSD]
    return list(dict.fromkeys(names))


def _known(column: Column, rows: list[Row]) -> bool:
    return all(math.isfinite(float(row.get(column.name, math.nan))) for row in rows)
