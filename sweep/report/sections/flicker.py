"""Pulsed lamps: how many an exposure misses, how their brightness swings, and how far their hue moves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Float
from ...metrics.columns.chromatic import CHROMATIC_CSD
from ...metrics.columns.flicker import FALSE_HUE, LAMP_SEEN, MODULATION
from ...results.output import Output
from ...spectra.lights import pair_name
from ...study.axes import series_of
from ..leaders import RGGB, answering, label, reference_of
from ..panels import Line, Lines, Panel, Picture
from ..section import Section, Table
from ..series import Numbers, over_series
from ..words import amount, change, digits, joined

Values = Float[Array, " numbers"]
_LEAST_SHARE = 1e-8
_ALL = 1 - 1e-9
_MOST_SERIES = 2


@dataclass(frozen=True)
class Worst:
    """The worst value of a quantity over a series, also between its scenes."""

    name: str
    at: float
    value: float


@dataclass(frozen=True)
class OverPulses:
    """Shares over one number: of lamps missed, swings of brightness, false hue of the yellow/red distance."""

    numbers: Numbers
    missed: Mapping[str, Values]
    swing: Mapping[str, Values]
    hue: Mapping[str, Values]
    worst: Mapping[str, tuple[Worst, ...]]


@dataclass(frozen=True)
class Flicker(Section):
    """Lamps missed, swing and false hue over each series of pulses."""

    series: tuple[OverPulses, ...]
    hero: str
    rggb: str
    pair: str

    heading = "Pulsed lamps"
    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for pulsed lamps before an HDR pixel, where every exposure sees them; else series say where."""
        rows = output.named_rows
        if LAMP_SEEN not in rows or rows[LAMP_SEEN].isna().all() or output.trade_off[0].pair is None:
            return
        pair, found = output.trade_off[0].pair, []
        far = pair_name(CHROMATIC_CSD, pair)
        for (base, key), scenarios in series_of(output.scenarios).items():
            seen = over_series(rows, scenarios, LAMP_SEEN)
            if not seen or not np.isfinite(np.concatenate([*seen.values()])).all():
                continue
            apart, hue = over_series(rows, scenarios, far), over_series(rows, scenarios, FALSE_HUE)
            worst = dict[str, tuple[Worst, ...]]()
            if output.worst is not None:
                known = output.worst[(output.worst["series"] == base) & (output.worst["key"] == key)].dropna()
                for quantity, of in known.groupby("quantity", sort=False):
                    worst[str(quantity)] = tuple(
                        Worst(str(r["name"]), float(r["at"]), float(r["value"])) for r in of.to_dict("records")
                    )
            shares = {name: hue[name] / np.where(apart[name] > 0, apart[name], np.nan) for name in hue if name in apart}
            numbers = Numbers(base, key, tuple(scenarios.values()))
            missed = {name: 1 - values for name, values in seen.items()}
            found.append(OverPulses(numbers, missed, over_series(rows, scenarios, MODULATION), shares, worst))
        if found and all(float(np.max([*one.missed.values()])) <= 1 - _ALL for one in found):
            hero, rggb = answering(output), reference_of(output, output.scenarios[0])
            names = "/".join(pair)
            yield cls(
                tuple(found[:_MOST_SERIES]),
                "" if hero is None else label(hero),
                "" if rggb is None else label(rggb),
                names,
            )

    def _extreme(self, quantity: str, computed: str) -> tuple[Worst, OverPulses]:
        """Return the worst value of a quantity over all series and designs, refined where the run has that."""
        candidates = []
        for one in self.series:
            for known in one.worst.get(quantity, ()):
                candidates.append((known, one))
            for name, values in getattr(one, computed).items() if not one.worst.get(quantity) else ():
                at = int(np.nanargmax(values))
                candidates.append((Worst(name, one.numbers.x[at], float(values[at])), one))
        return max(candidates, key=lambda item: item[0].value)

    @property
    def answer(self) -> list[str]:
        """Whether lamps are missed, how they swing, and how far hue moves."""
        swing, over = self._extreme(MODULATION, "swing")
        swings = f"its brightness swings by up to **±{amount(swing.value, 'share')}** ({swing.name} at {over.numbers.with_unit(swing.at)})"
        lines = [f"The exposure **misses no lamp** in any phase of the pulses; {swings}."]
        hues = [(name, one, v) for one in self.series for name, v in one.hue.items() if np.isfinite(v).any()]
        if hues:
            name, one, values = max(hues, key=lambda item: float(np.nanmax(item[2])))
            number, share = one.numbers.x[int(np.nanargmax(values))], float(np.nanmax(values))
            dn, _ = (
                self._extreme(FALSE_HUE, "hue")
                if any(one.worst.get(FALSE_HUE) for one in self.series)
                else (None, None)
            )
            text = f"Its hue moves by at most **{amount(share, 'share')}** of the {self.pair} distance at the computed pulses ({name} at {one.numbers.with_unit(number)})"
            text += "" if dn is None else f", and by at most {digits(dn.value)} DN between them, too ({dn.name})"
            lines.append(f"{text}.")
        return lines

    @property
    def limits(self) -> list[str]:
        """What was not searched."""
        return [
            f"Computed at {len(one.numbers.x)} values of the {one.numbers.name} ({one.numbers.at(0)} to {one.numbers.at(len(one.numbers.x) - 1)})."
            for one in self.series
        ]

    @property
    def picture(self) -> Picture | None:
        """Missed lamps and swings above false hue, a column for each series."""
        above, below = list[Panel](), list[Panel]()
        for one in self.series:
            x = np.array(one.numbers.drawn)
            most = {"missed": np.max([*one.missed.values()], axis=0), "swing": np.max([*one.swing.values()], axis=0)}
            lines = {f"{name}, worst CFA": Line(x, 100 * values) for name, values in most.items()}
            above.append(
                Lines(
                    "lamps missed, and swing of brightness / %",
                    one.numbers.axis,
                    lines,
                    log_x=one.numbers.log,
                    height=190,
                )
            )
            hue = {name: Line(x, np.maximum(100 * np.nan_to_num(v), 100 * _LEAST_SHARE)) for name, v in one.hue.items()}
            below.append(
                Lines(
                    f"false hue / % of the {self.pair} distance",
                    one.numbers.axis,
                    hue,
                    self.hero,
                    one.numbers.log,
                    True,
                    height=190,
                )
            )
        alone = (
            f"Lamps missed, swing of brightness and false hue over {joined([one.numbers.name for one in self.series])}."
        )
        return Picture(
            (*above, *below),
            alone,
            f"Worst of all lamps and all moments of the pulses. Under {100 * _LEAST_SHARE:g} % is drawn there.",
            columns=len(self.series),
        )

    @property
    def table(self) -> Table | None:
        """The worst of each design."""
        rows = []
        for name in self.series[0].missed:
            missed = max(float(np.max(one.missed[name])) for one in self.series)
            swing = max(float(np.max(one.swing[name])) for one in self.series)
            hue = most_of(one.hue.get(name) for one in self.series)
            its = most_of(one.hue.get(self.rggb) for one in self.series)
            rows.append(
                (
                    name,
                    amount(missed, "share"),
                    f"±{amount(swing, 'share')}",
                    amount(hue, "share"),
                    "" if name == self.rggb else change(hue, its),
                )
            )
        return Table(
            (
                "",
                "lamps missed, at most",
                "swing, at most",
                f"false hue of the {self.pair} distance, at most",
                f"against {self.rggb or RGGB}",
            ),
            tuple(rows),
        )


def most_of(series: Iterable[Values | None]) -> float:
    """Return the largest value that is known; NaN where none is."""
    known = [values[np.isfinite(values)] for values in series if values is not None]
    values = np.concatenate(known) if known else np.empty(0)
    return float(values.max()) if values.size else np.nan
