"""Pulsed lamps: how many an exposure misses, how their brightness swings, and how far their hue moves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Float
from ...camera.scene import WhitePatchExposure
from ...metrics.columns.chromatic import CHROMATIC_CSD
from ...metrics.columns.flicker import FALSE_HUE, LAMP_SEEN, MODULATION
from ...results.output import Output
from ...results.tables import RGGB
from ...spectra.lights import pair_name
from ...study.axes import series_of
from ..leaders import answering, label, reference_of
from ..panels import Line, Lines, Panel, Picture
from ..section import Section, Table
from ..series import Numbers, over_series
from ..words import amount, change, joined, number, quoted

Values = Float[Array, " numbers"]
_ALL = 1 - 1e-9
_MOST_SERIES = 2
_SHOWN = 0.01
"""Share of the largest false hue from which on that of a series is drawn."""


@dataclass(frozen=True)
class Worst:
    """The worst value of a quantity over a series, also between its scenes."""

    name: str
    at: float
    value: float


@dataclass(frozen=True)
class OverPulses:
    """Shares over one number: of lamps missed, swings of brightness, false hue of the yellow/red distance.

    `fixed`: the other number of the pulses, in words; `apart`: distance of the two types, DN.
    """

    numbers: Numbers
    fixed: str
    missed: Mapping[str, Values]
    swing: Mapping[str, Values]
    hue: Mapping[str, Values]
    apart: Mapping[str, Values]
    worst: Mapping[str, tuple[Worst, ...]]

    @property
    def least_seen(self) -> float:
        """The smallest share of phases in which a lamp is seen, between the scenes, too, where known."""
        refined = [known.value for known in self.worst.get(LAMP_SEEN, ())]
        return min([1 - float(np.max([*self.missed.values()])), *refined])

    def with_worst(self, name: str) -> tuple[Values, Values]:
        """Return numbers and false hue of a design, with the worst place between them."""
        x, y = np.array(self.numbers.x), self.hue[name]
        for known in self.worst.get(FALSE_HUE, ()):
            apart = float(np.interp(known.at, x, self.apart[name]))
            if known.name == name and known.at not in x and apart > 0:
                share = known.value / apart
                at = int(np.searchsorted(x, known.at))
                return np.insert(x, at, known.at), np.insert(y, at, share)
        return x, y

    @property
    def span(self) -> str:
        """The pulses in words."""
        low, high = self.numbers.x[0], self.numbers.x[-1]
        between = f"{number(self.numbers.factor * low)} to {self.numbers.with_unit(high)}"
        what = {"frequency_hz": f"at {between}", "duty": f"on for {between} of the time"}
        fixed = f" ({self.fixed})" if self.fixed else ""
        return f"{what.get(self.numbers.key, f'with {between} of {self.numbers.name}')}{fixed}"


@dataclass(frozen=True)
class Flicker(Section):
    """Lamps missed, swing and false hue over each series of pulses."""

    series: tuple[OverPulses, ...]
    hero: str
    rggb: str
    pair: str
    exposure: str = "the exposure"

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
        for (base, key), scenarios in series_of(output.study.scenarios).items():
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
            swing = over_series(rows, scenarios, MODULATION)
            found.append(OverPulses(numbers, _fixed(output, scenarios), missed, swing, shares, apart, worst))
        if found and all(one.least_seen >= _ALL for one in found):
            hero, rggb = answering(output), reference_of(output, output.scenarios[0])
            names = "/".join(pair)
            yield cls(
                tuple(found[:_MOST_SERIES]),
                "" if hero is None else label(hero),
                "" if rggb is None else label(rggb),
                names,
                _exposure(output),
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
        refined = all(one.worst.get(LAMP_SEEN) for one in self.series)
        lines = [
            f"**Never**: {self.exposure} meets a lamp in every phase of pulses {joined([one.span for one in self.series])}"
            f"{', also between the computed ones' * refined}. Its brightness swings by up to "
            f"**±{amount(swing.value, 'share')}** ({swing.name} at {over.numbers.with_unit(swing.at)})."
        ]
        hues = sorted(((self._hue(name), name) for name in self.series[0].hue), reverse=True)
        hues = [(share, name) for share, name in hues if np.isfinite(share)]
        if hues:
            (most, name), *others = hues
            beside = "".join(f"; {quoted(other)} {amount(share, 'share')}" for share, other in others[:3])
            lines.append(
                f"Its hue moves by at most **{amount(most, 'share')}** of the {self.pair} distance ({quoted(name)}{beside})."
            )
        return lines

    def _hue(self, name: str) -> float:
        """Return the largest false hue of a design as a share of its distance, between the scenes where known."""
        return most_of(one.with_worst(name)[1] for one in self.series)

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
        most_hue = 100 * max(most_of(one.with_worst(name)[1] for name in one.hue) for one in self.series)
        most_swing = 100 * max(most_of(one.swing.values()) for one in self.series)
        for one in self.series:
            x, axis = np.array(one.numbers.drawn), f"{one.numbers.axis}{f' ({one.fixed})' if one.fixed else ''}"
            most = {"missed": np.max([*one.missed.values()], axis=0), "swing": np.max([*one.swing.values()], axis=0)}
            lines = {f"{name}, worst CFA": Line(x, 100 * values) for name, values in most.items()}
            points = {name: one.with_worst(name) for name in one.hue}
            hue = {n: Line(one.numbers.factor * at, 100 * np.nan_to_num(y)) for n, (at, y) in points.items()}
            log = one.numbers.log
            above.append(
                Lines("lamps missed, and swing of brightness / %", axis, lines, log_x=log, height=190, most=most_swing)
            )
            if 100 * most_of(one.hue.values()) > _SHOWN * most_hue:
                below.append(
                    Lines(
                        f"false hue / % of the {self.pair} distance",
                        axis,
                        hue,
                        self.hero,
                        log,
                        height=190,
                        most=most_hue,
                    )
                )
        alone = (
            f"Lamps missed, swing of brightness and false hue over {joined([one.numbers.name for one in self.series])}."
        )
        caption = "Worst of all lamps and all moments of the pulses, at the computed pulses and the worst between them."
        if len(below) < len(above):
            caption += f" Elsewhere the false hue is below {_SHOWN * most_hue:.2g} %."
        return Picture((*above, *below), alone, caption, columns=len(self.series))

    @property
    def table(self) -> Table | None:
        """The worst of each design."""
        rows = []
        for name in self.series[0].missed:
            missed = max(float(np.max(one.missed[name])) for one in self.series)
            swing = max(float(np.max(one.swing[name])) for one in self.series)
            hue, its = self._hue(name), self._hue(self.rggb) if self.rggb in self.series[0].hue else np.nan
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


def _exposure(output: Output) -> str:
    """Return the exposure that all scenes share, in words."""
    exposures = [scene.exposure for scene in output.study.scenarios.values()]
    fixed = {exposure.exposure_s for exposure in exposures if not isinstance(exposure, WhitePatchExposure)}
    return f"an exposure of {amount(fixed.pop(), 's')}" if len(fixed) == 1 else "the exposure"


def _fixed(output: Output, scenarios: Mapping[str, float]) -> str:
    """Return the frequency or the duty that all scenes of a series share, in words."""
    drives = [drive for name in scenarios if (drive := output.study.scenarios[name].drive) is not None]
    frequencies, duties = {drive.frequency_hz for drive in drives}, {drive.duty for drive in drives}
    parts = [f"at {number(*frequencies)} Hz"] if len(frequencies) == 1 else []
    parts += [f"on for {number(100 * next(iter(duties)))} % of the time"] if len(duties) == 1 else []
    return ", ".join(parts)


def most_of(series: Iterable[Values | None]) -> float:
    """Return the largest value that is known; NaN where none is."""
    known = [values[np.isfinite(values)] for values in series if values is not None]
    values = np.concatenate(known) if known else np.empty(0)
    return float(values.max()) if values.size else np.nan
