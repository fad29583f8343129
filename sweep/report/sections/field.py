"""Over the sensor: a separation from its center to its corner, and where a filter falls below RGGB."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Float
from ...metrics.quantity import Column
from ...results.output import Output
from ...results.tables import RGGB
from ..leaders import answering, label, leaders_of, upper_bound_beside
from ..look import styles_of
from ..panels import Curves, Line, Lines, Picture, Ring
from ..section import MOST_ROWS, Section, Table
from ..terms import bound_conditions, colorants_of, edges_in_words, edges_of, is_angle_dependent
from ..words import amount, change, digits, joined, of_column, quantity, quoted
from .trade_off import filter_curves

Values = Float[Array, " places"]


@dataclass(frozen=True)
class Field(Section):
    """Separations over the chief ray angle, degrees; `worst`: of each over the field, as the run refined it; `notes`: colorants."""

    column: Column
    angles: Values
    values: Mapping[str, Values]
    worst: Mapping[str, float]
    hero: str
    edges: str
    notes: tuple[str, ...]
    f_number: float
    bound: float | None
    bound_of: str
    moves: bool
    filters: Curves | None
    edges_of: Mapping[str, str]
    notes_of: Mapping[str, tuple[str, ...]]

    heading = "From the center to the corner"
    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it where the answering scene is of a field."""
        leaders, column, best = leaders_of(output), output.trade_off[0], answering(output)
        scene = output.study.scenarios[leaders.scenario]
        if output.places is None or scene.field is None or best is None or column.name not in output.places:
            return
        rows = output.named_rows[output.named_rows["scenario"] == leaders.scenario]
        names = {row["design_id"]: label(row) for row in rows.to_dict("records")}
        values, angles = {}, np.empty(0)
        for design, places in output.places.groupby("design_id", sort=False):
            if design in names:
                ordered = places.sort_values("height")
                values[names[design]] = ordered[column.name].to_numpy(dtype=float)
                angles = ordered["cra_deg"].to_numpy(dtype=float)
        worst = {label(row): float(row[column.name]) for row in rows.to_dict("records")}
        if label(best) in values:
            yield cls(
                column,
                angles,
                values,
                worst,
                label(best),
                edges_in_words(edges_of(best)),
                tuple(colorants_of(output, best)),
                scene.optics.f_number,
                upper_bound_beside(output, best),
                bound_conditions(output),
                is_angle_dependent(output, best),
                filter_curves(output, best, styles_of(values)[label(best)].color, 200),
                {
                    label(row): ", ".join(f"{a:.0f} to {b:.0f} nm" for a, b in edges_of(row))
                    for row in rows.to_dict("records")
                },
                {label(row): tuple(colorants_of(output, row)) for row in rows.to_dict("records")},
            )

    def _falls(self, name: str) -> bool:
        """Return whether a design has more than RGGB in the center, and less farther out."""
        return name not in (self.hero, RGGB) and bool(self._below(name))

    def _below(self, name: str) -> float | None:
        """Return the first angle at which a design has less than RGGB, on straight lines between places."""
        if RGGB not in self.values or name == RGGB:
            return None
        apart = self.values[name] - self.values[RGGB]
        if apart[0] < 0:
            return 0.0
        ends = np.flatnonzero((apart[:-1] >= 0) & (apart[1:] < 0))
        if not ends.size:
            return None
        at = int(ends[0])
        return float(np.interp(0.0, (-apart[at], -apart[at + 1]), self.angles[at : at + 2]))

    @property
    def answer(self) -> list[str]:
        """What the best one keeps up to the corner, and what becomes of the others."""
        corner = f"{self.angles[-1]:g}{chr(0xA0)}degrees"
        edges = f"With {self.edges}, {quoted(self.hero)}" if self.edges else quoted(self.hero)
        edges += f" ({'; '.join(self.notes)})" if self.notes else ""
        beside = "" if RGGB not in self.worst else f" ({RGGB}: {of_column(self.column, self.worst[RGGB])})"
        lines = [
            f"{edges} keeps at least **{of_column(self.column, self.worst[self.hero])}** from the center to the corner at {corner}{beside}."
        ]
        if not self.moves:
            others = sorted(
                (name for name in self.values if name != self.hero and name in self.edges_of),
                key=lambda n: -self.worst[n],
            )
            rival = next((name for name in others if name != RGGB), None)
            beside = (
                ""
                if rival is None
                else f" {quoted(rival)} comes next with {of_column(self.column, self.worst[rival])}."
            )
            return [f"{lines[0][:-1]}: it does not move with the angle.{beside}"]
        fallen = [
            f"{quoted(name)} (from {digits(float(y[0]))} to {amount(float(y[-1]), 'DN')}) at **{at:.0f}°**"
            for at, name, y in sorted(
                ((self._below(name) or 0.0, name, y) for name, y in self.values.items() if self._falls(name)),
                key=lambda item: item[:2],
            )
        ]
        if fallen:
            lines.append(f"Below RGGB fall{'s' if len(fallen) == 1 else ''} {joined(fallen)}.")
        return lines

    @property
    def limits(self) -> list[str]:
        """Upper bound, and why."""
        lines = []
        if self.bound is not None:
            lines.append(
                f"No filter that {'moves like it' if self.moves else 'does not move'} and stays below the curve that it replaces keeps more than {self.column.format_bound(self.bound)} at every place of the field {self.bound_of} (proven, before "
                f"rounding); {quoted(self.hero)} reaches {amount(self.worst[self.hero] / self.bound, 'share')} of that."
            )
        return lines

    @property
    def picture(self) -> Picture | None:
        """A line each, with rings where a filter falls below RGGB."""
        lines = {name: Line(self.angles, y) for name, y in self.values.items()}
        rings = []
        for name in self.values:
            at = self._below(name)
            if at:
                rings.append(Ring(at, float(np.interp(at, self.angles, self.values[RGGB])), f"{at:.0f}°"))
        panel = Lines(
            f"{quantity(self.column)} / {self.column.unit}, f/{self.f_number:g}",
            "chief ray angle / degrees",
            lines,
            self.hero,
            rings=tuple(rings),
            marked=False,
            height=320 if self.moves else 240,
        )
        caption = (
            f"Computed at {len(self.angles)} places. Rings: the angle at which a filter falls below RGGB."
            if rings
            else f"Computed at {len(self.angles)} places."
        )
        if self.filters is None or self.moves:
            return Picture((panel,), "Separation over the chief ray angle.", caption)
        return Picture(
            (self.filters, panel), "Where it filters, and separation over the chief ray angle.", caption, columns=1
        )

    @property
    def table(self) -> Table | None:
        """Center, corner and the least of each."""
        rows = [
            (name, self.edges_of.get(name, ""), of_column(self.column, float(y[0])), of_column(self.column, float(y[-1])), of_column(self.column, self.worst[name]),
             "" if name == RGGB or RGGB not in self.worst else change(self.worst[name], self.worst[RGGB]))
            for name, y in list(self.values.items())[:MOST_ROWS]
        ]  # fmt: skip
        return Table(("", "edges of its stopbands", "center", "corner", "least", "least against RGGB"), tuple(rows))
