"""From which red LEDs on the answering design separates less than RGGB."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...results.output import Output
from ...results.tables import RGGB
from ...spectra.moved_leds import FIRST_NM
from ..leaders import answering, label
from ..section import Section, Table
from ..words import against_in_words, quantity, quoted


@dataclass(frozen=True)
class Limit:
    """Limits of one shape of the LED and one quantity, nm and DN; NaN where there is none."""

    shape: str
    words: str
    red_nm: float
    x: float
    y: float
    dn: float
    yellow_nm: float
    wanted_nm: float
    deepest_nm: float
    deepest_ratio: float


@dataclass(frozen=True)
class DeeperReds(Section):
    """Limits of the answering design."""

    name: str
    limits_of: tuple[Limit, ...]

    heading = "Deeper reds"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a run that moved reds."""
        best = answering(output)
        if output.lamp_limits is None or best is None:
            return
        known = output.lamp_limits[output.lamp_limits["design_id"] == best["design_id"]]
        numbers = ["red_limit_nm", "red_limit_x", "red_limit_y", "red_limit_dn", "yellow_limit_nm", "wanted_limit_nm",
                   "deepest_nm", "deepest_ratio"]  # fmt: skip
        limits = tuple(
            Limit(row["shape"], quantity(output.columns[row["quantity"]]), *(float(row[name]) for name in numbers))
            for row in known.to_dict("records")
            if row["quantity"] in output.columns
        )
        if limits:
            yield cls(label(best), limits)

    @property
    def answer(self) -> list[str]:
        """From which peak on the design is below RGGB, by quantity, over the shapes."""
        kinds = list(dict.fromkeys(one.words for one in self.limits_of))
        ends = [_ends([one.red_nm for one in self.limits_of if one.words == words]) for words in kinds]
        more = [f", and at any brightness {end}" for end in ends[1:]]
        return [
            f"At the same red, {quoted(self.name)} has less {kinds[0]} than {RGGB} {ends[0]}, by the LED's shape"
            f"{''.join(more)}."
        ]

    @property
    def deepest(self) -> str:
        """What the design has at the deepest red of the study, in a sentence."""
        first = self.limits_of[0].words
        known = [one for one in self.limits_of if one.words == first and np.isfinite(one.deepest_ratio)]
        if not known:
            return ""
        ends = [min(known, key=lambda one: one.deepest_ratio), max(known, key=lambda one: one.deepest_ratio)]
        parts = list(dict.fromkeys(against_in_words(one.deepest_ratio, 1.0, RGGB) for one in ends))
        span = f"{parts[0].removesuffix(f' than {RGGB}')} to {parts[-1]}" if len(parts) > 1 else parts[0]
        return f" At the same red of {_nm(known[0].deepest_nm)} it has {span}, by the LED's shape."

    @property
    def table(self) -> Table | None:
        """A row for each shape, with the color where it is first below RGGB."""
        kinds = list(dict.fromkeys(one.words for one in self.limits_of))
        wanted = any(np.isfinite(one.wanted_nm) for one in self.limits_of)
        rows = []
        for shape in dict.fromkeys(one.shape for one in self.limits_of):
            of = [one for one in self.limits_of if one.shape == shape]
            first = of[0]
            color = f"{first.x:.3f}, {first.y:.3f}" if np.isfinite(first.x) else ""
            more = [_nm(first.wanted_nm)] if wanted else []
            rows.append((shape, *(_nm(one.red_nm) for one in of), color, _nm(first.yellow_nm), *more))
        head = ("LED", *kinds, "x, y of the first", "and up to")
        note = "German and US: the shapes of tl16's LEDs, modeled."
        return Table((*head, *(["below the wanted one from"] if wanted else [])), tuple(rows), note)


def _ends(peaks_nm: list[float]) -> str:
    """Return from which peak on, over the shapes that have one."""
    known = [peak for peak in peaks_nm if np.isfinite(peak)]
    if not known:
        return "from none of these reds on"
    if min(known) == max(known) == FIRST_NM:
        return f"already at {_nm(FIRST_NM)}"
    low, high = f"{min(known):.1f}", _nm(max(known))
    span = f"**{low} to {high}**" if high != _nm(min(known)) else f"**{high}**"
    some = "" if len(known) == len(peaks_nm) else f" for {len(known)} of {len(peaks_nm)} shapes"
    return f"from a red peak of {span} on{some}"


def _nm(value: float) -> str:
    return f"{value:.1f}\u00a0nm" if np.isfinite(value) else "not found"
