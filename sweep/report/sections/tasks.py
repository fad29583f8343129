"""Gains and losses in tasks beside the traffic lights, against RGGB."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Float
from ...metrics.columns.tasks import PREFIX
from ...metrics.quantity import Column
from ...results.output import Output
from ...results.tables import REFERENCE
from ..leaders import answering, label, reference_of
from ..panels import Picture
from ..row_panels import Ratio, Ratios
from ..section import Section
from ..words import SAME, digits, joined, quantity, quoted

_MOST_FACTOR = 10.0
_MOST_NAMED = 3


@dataclass(frozen=True)
class Tasks(Section):
    """Factors by which each design is better than RGGB in each measure; below 1 it is worse."""

    columns: tuple[Column, ...]
    factors: dict[str, Float[Array, " measures"]]
    rggb: str
    hero: str
    designs: tuple[str, ...]
    exposure_s: float
    read_noise_e: float

    heading = "What it costs elsewhere"
    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a study with tasks."""
        columns = [c for c in output.columns.values() if c.metric.startswith(PREFIX) and not c.extreme]
        best, scenario = answering(output), output.scenarios[0]
        rggb = reference_of(output, scenario)
        if not columns or best is None or rggb is None or output.study.tasks is None:
            return
        from ...metrics.tasks.figures import FIGURES  # noqa: PLC0415  (few studies have tasks)

        first = {PREFIX + figure.what for figures in FIGURES.values() for figure in figures if figure.first}
        rows = output.named_rows[(output.named_rows["scenario"] == scenario) & (output.named_rows["status"] == "ok")]
        kept, factors = [], dict[str, list[float]]()
        for column in columns:
            values = rows[column.name].to_numpy(dtype=float)
            of = float(rggb[column.name])
            if (
                np.abs(values).max() < 10.0**-column.digits
                or column.metric not in first
                or not np.isfinite(values).all()
                or not (values > 0).all()
                or not of > 0
            ):
                continue
            kept.append(column)
            for row, value in zip(rows.to_dict("records"), values, strict=True):
                factors.setdefault(label(row), []).append(value / of if column.direction == "more" else of / value)
        if kept:
            designs = tuple(label(row) for row in rows.to_dict("records") if row["kind"] != REFERENCE)
            tasks = output.study.tasks
            arrays = {name: np.array(values) for name, values in factors.items()}
            yield cls(tuple(kept), arrays, label(rggb), label(best), designs, tasks.exposure_s, tasks.read_noise_e)

    def _gains(self, name: str) -> list[str]:
        return [
            quantity(column)
            for column, factor in zip(self.columns, self.factors[name], strict=True)
            if factor > 1 + SAME
        ]

    def _losses(self, name: str) -> int:
        return int((self.factors[name] < 1 - SAME).sum())

    @property
    def answer(self) -> list[str]:
        """In how many measures designs are better and worse than RGGB, and the largest loss and gain of the answering one."""
        alike: dict[tuple[str, int], list[str]] = {}
        for name in self.designs:
            gains = self._gains(name)
            shown = f" ({', '.join(gains)})" if 0 < len(gains) <= _MOST_NAMED else ""
            alike.setdefault((f"**{len(gains)}**{shown}", self._losses(name)), []).append(name)
        parts = [
            f"{joined([quoted(name) for name in names])} {'is' if len(names) == 1 else 'are'} better in {better} and worse in **{worse}**"
            for (better, worse), names in alike.items()
        ]
        rest = any(len(self._gains(name)) + self._losses(name) < len(self.columns) for name in self.designs)
        lines = [
            f"Against {self.rggb}, of {len(self.columns)} measures of other tasks, {'; '.join(parts)}{'; the rest is the same' * rest}."
        ]
        if self.hero in self.factors:
            factors = self.factors[self.hero]
            least, most = int(np.argmin(factors)), int(np.argmax(factors))
            parts = (
                [f"loses most in {quantity(self.columns[least])} (**{digits(1 / factors[least])}** times worse)"]
                if factors[least] < 1 - SAME
                else []
            )
            parts += (
                [f"gains most in {quantity(self.columns[most])} (**{digits(factors[most])}** times better)"]
                if factors[most] > 1 + SAME
                else []
            )
            lines += [f"{quoted(self.hero)} {joined(parts)}."] if parts else []
        return lines

    @property
    def limits(self) -> list[str]:
        """What plain CFAs do."""
        lines = []
        others = [name for name in self.factors if name not in (*self.designs, self.rggb)]
        if others:
            parts = [f"{name} in {len(self._gains(name))} and {self._losses(name)}" for name in others]
            lines.append(f"Other CFAs, better and worse: {'; '.join(parts)}.")
        return lines

    @property
    def picture(self) -> Picture | None:
        """A row for each measure, a mark for each design."""
        ratios = [
            Ratio(quantity(column), name, float(np.clip(self.factors[name][at], 1 / _MOST_FACTOR, _MOST_FACTOR)))
            for at, column in enumerate(self.columns)
            for name in self.designs
        ]
        panel = Ratios(
            "other tasks", f"times as good as {self.rggb} (1); left of it worse", tuple(ratios), self.hero, 22
        )
        caption = f"d': distance in units of the noise. Tasks have a camera of their own: patches that fill the field, on axis, all exposed for {1e3 * self.exposure_s:g} ms, with {self.read_noise_e:g} e of read noise."
        if any(np.abs(np.log(values)).max() > np.log(_MOST_FACTOR) for values in self.factors.values()):
            caption += f" Beyond {_MOST_FACTOR:g} times: at the edge."
        return Picture((panel,), f"Gains and losses against {self.rggb} in {len(self.columns)} measures.", caption)
