"""Worst values over a series, also between its scenarios: of the search's answer beside other designs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..metrics.columns.flicker import FALSE_HUE, LAMP_SEEN, MODULATION
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..results.output import Output
from ..results.tables import FOUND, PLAIN
from ..study.axes import series_of
from .leaders import Row, label, of_reference
from .noise import rounded
from .series import over_series, quantity_of

if TYPE_CHECKING:
    import pandas as pd

_ALL = 1 - 1e-9


def searched_series(output: Output) -> tuple[str, str] | None:
    """Return series and key that the answer of the search is the worst over, if its refined values are known."""
    search = output.provenance.search
    if search is None or search.scenarios < 2 or output.worst is None:
        return None
    known = output.worst[output.worst["quantity"] == output.goal.name]
    series = [group for group, scenarios in series_of(output.scenarios).items() if search.scenario in scenarios]
    return series[0] if series and (known["series"] == series[0][0]).any() else None


def worst_words(output: Output, best: Row) -> str:
    """Return the worst value of the answer over its series, beside the worst of others; empty if there is none."""
    group = searched_series(output)
    if group is None or best["kind"] != FOUND or output.worst is None:
        return ""
    goal, scenarios, (_, unit) = output.goal, series_of(output.scenarios)[group], quantity_of(group[1])
    known = output.worst[(output.worst["series"] == group[0]) & (output.worst["quantity"] == goal.name)]
    known = known.dropna().set_index("name")
    light = output.few.drop_duplicates("name").set_index("name")[CFA_SENSITIVITY]
    plain = [name for name in output.kind(PLAIN)["name"].unique() if name in known.index]
    numbers = list(scenarios.values())

    least_of = dict(
        zip(known.index, zip(known["value"].astype(float), known["at"].astype(float), strict=True), strict=True)
    )

    def least(name: str) -> str:
        value, at = least_of[name]
        return f"{rounded(value, up=False) if value > 0 else 0} {goal.unit}".rstrip() + f" (at {at:.3g} {unit})"

    name = label(best)
    text = (
        f"has a {goal.words} of at least {least(name)} from {numbers[0]:g} to {numbers[-1]:g} {unit}, "
        f"at {light[name]:.3f} {of_reference(output)}"
    )
    rival = max(plain, key=lambda other: known.loc[other, "value"], default=None)
    if rival is not None and known.loc[rival, "value"] > 0:
        ratio = known.loc[name, "value"] / known.loc[rival, "value"]
        text += f". {rival} has at least {least(rival)} at {light[rival]:.3f}: {ratio:.2f} times its worst and "
        text += f"{light[name] / light[rival]:.2f} times its light"
        values = over_series(output.few, scenarios, goal.name)
        loses = [
            f"{number:.3g}"
            for number, mine, its in zip(numbers, values[name], values[rival], strict=True)
            if its > mine
        ]
        text += f"; {rival} has more at {', '.join(loses)} {unit}" if loses else ""
    others = [f"{other} {least(other)}" for other in known.index if other not in (name, rival)]
    return text + (f". Others: {', '.join(others)}" if others else "")


def flicker_lines(output: Output) -> Iterator[str]:
    """Yield how pulsed lamps look in an HDR pixel: over series of pulses at their worst number, or by scenario."""
    if LAMP_SEEN not in output.few or output.few[LAMP_SEEN].isna().all():
        return
    worst = output.worst
    if worst is None or not (worst["quantity"] == LAMP_SEEN).any():
        pulsed = output.few.dropna(subset=[LAMP_SEEN])
        least = min(pulsed.to_dict("records"), key=lambda row: float(row[LAMP_SEEN]))
        share = f"{_percent(least[LAMP_SEEN])} of the phases ({least['name']} in {least['scenario']})"
        yield f"Pulsed lamps are seen in {'all phases' if least[LAMP_SEEN] > _ALL else f'as few as {share}'}."
        return
    known = worst.dropna().reset_index(drop=True)
    seen, modulated, hue = (
        known.loc[getattr(known[known["quantity"] == name]["value"], which)()]
        for name, which in ((LAMP_SEEN, "idxmin"), (MODULATION, "idxmax"), (FALSE_HUE, "idxmax"))
    )
    share = f"as few as {_percent(seen['value'])} of the phases ({_where(seen)})"
    hues = known[known["quantity"] == FALSE_HUE].groupby("name", sort=False)["value"].max()
    others = [f"{name} {value:,.3g} DN" for name, value in hues.items() if name != hue["name"]]
    yield (
        f"Pulsed lamps are seen in {'all phases' if seen['value'] > _ALL else share}; their modulation is at most "
        f"{modulated['value']:.2f} ({_where(modulated)}), their false hue at most {hue['value']:.3g} DN "
        f"({'; '.join([_where(hue), *others])})."
    )


def _percent(share: float) -> str:
    """Return a share, rounded down."""
    return f"{np.floor(1000 * share) / 10:.1f} %"


def _where(row: pd.Series[Any]) -> str:
    name, unit = quantity_of(str(row["key"]))
    number = f"{row['at']:.3g}"
    return f"{row['name']} at {f'{number} {unit}' if unit else f'a {name} of {number}'}"
