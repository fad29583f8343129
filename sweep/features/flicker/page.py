"""Answer about pulsed lamps, and what pulses do over a series of scenes."""

from __future__ import annotations

import numpy as np

from ...metrics.quantity import DN
from ...report.answers import Columns, over_numbers, series
from ...report.numbers import SHARE, amount
from ...report.panels import Panel
from ...report.run import Run, Series
from ...report.tables import Column
from .columns import FALSE_HUE, LAMP_SEEN, MODULATION

_PULSES = {MODULATION: ("brightness", SHARE), FALSE_HUE: ("hue", DN), LAMP_SEEN: ("phases that miss the lamp", SHARE)}


def by_pulses(run: Run, one: Series) -> tuple[Columns, list[Panel]]:
    """Return the most that pulses shift over a series, as columns and panels."""
    columns: Columns = {}
    panels = list[Panel]()
    for name, (words, unit) in _PULSES.items():
        known = run.over(one, name)
        swings = {n: 1 - y if name == LAMP_SEEN else np.abs(y) for n, y in known.items()}
        if swings and max(float(np.nanmax(y)) for y in swings.values()) > 1e-6:
            most = {
                n: max([float(np.nanmax(y)), *(run.worst(one, name, n) if name != LAMP_SEEN else [])])
                for n, y in swings.items()
            }
            columns[words] = Column(words, unit, "less", group="most, by pulses"), most
            alike = all(np.allclose(y, swings[run.hero], equal_nan=True) for y in swings.values())
            drawn = {"every CFA": swings[run.hero]} if alike else swings
            panels += over_numbers(run, one, drawn, f"{words}, by pulses", unit)
    return columns, panels


def pulses(run: Run) -> dict[str, str]:
    """Return from when on every pulse is met, and where pulses shift most, for a sentence."""
    if not run.series:
        return {}
    pulsed = [scene.drive for scene in run.study.scenarios.values() if scene.drive is not None]
    missed = LAMP_SEEN in run.rows and float(np.nan_to_num(run.rows[LAMP_SEEN].min(), nan=1.0)) < 1
    dark = amount((1 - pulsed[0].duty) / pulsed[0].frequency_hz, "s") if pulsed and missed else ""
    return {"dark": dark, "at": _worst_at(run)}


def _worst_at(run: Run) -> str:
    """Return the number of the first series at which pulses shift the hue most, else the brightness."""
    one = run.series[0]
    swings = [run.over(one, name).get(run.hero) for name in (FALSE_HUE, MODULATION)]
    known = [np.abs(y) for y in swings if y is not None and np.nanmax(np.abs(y)) > 1e-6]
    return amount(float(one.x[int(np.nanargmax(known[0]))]), one.axis.unit, trim=True) if known else ""


def _asked(run: Run) -> bool:
    return bool(run.series and run.study.pixel.captures and all(s.drive for s in run.study.scenarios.values()))


OVER = {"flicker": by_pulses}
FACTS = {"flicker": pulses}
KINDS = {"flicker": (40, _asked, lambda run: series(run, "flicker"))}
