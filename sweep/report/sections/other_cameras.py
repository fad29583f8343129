"""The separation that a share of random lamps and cameras has, judged on draws that no search has looked at."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...results.output import Output
from ..leaders import answering, label
from ..panels import Picture
from ..row_panels import Row, Rows
from ..section import Section
from ..series import scene_in_words
from ..words import NARROW, joined, of_column, quoted


@dataclass(frozen=True)
class OtherCameras(Section):
    """A bar for each design: what the share has, with its 95 % interval."""

    words: str
    axis: str
    rows: tuple[Row, ...]
    hero: str
    share: float
    draws: int
    drawn: str
    where: str

    heading = "On other random draws"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a study that wants a share of random lamps or cameras."""
        best = answering(output)
        if output.yields is None:
            return
        of_scene = output.yields[output.yields["scenario"] == output.scenario]
        for name in of_scene["quantity"].unique():
            column, known = output.columns[name], of_scene[of_scene["quantity"] == name].to_dict("records")
            yield cls(
                column.words,
                column.axis,
                tuple(
                    Row(r["name"], r["dn"], None, r["dn_low"], r["dn_high"], of_column(column, r["dn"])) for r in known
                ),
                "" if best is None else label(best),
                known[0]["share"],
                known[0]["draws"],
                "lamps and cameras" if output.study.population is not None else "sensors",
                "" if len(output.scenarios) == 1 else f"In {scene_in_words(output.scenario)}, ",
            )

    @property
    def answer(self) -> list[str]:
        """What the share has with each design."""
        named = joined([f"{row.text} with {quoted(row.name)}" for row in reversed(self.rows)])
        return [
            f"{self.where}{'of' if self.where else 'Of'} {self.draws:,} other random {self.drawn}, {self._percent} have a {self.words} of at least {named}, "
            f"before clipping and rounding; bars: 95 % intervals of what {self._percent} of all have."
        ]

    @property
    def _percent(self) -> str:
        return f"{100 * self.share:.10g}{NARROW}%"

    @property
    def picture(self) -> Picture | None:
        """A bar each."""
        panel = Rows(f"{self.words} of {self._percent} of them", self.axis, self.rows, self.hero)
        return Picture((panel,), f"{self.words} that {self._percent} of other random {self.drawn} have.")
