"""Cost of a worst case over lamps in the nominal one, changes that break an answer, and the share of lamps it keeps."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..metrics.quantity import WORST, WORST_CASE
from ..metrics.share import told_share
from ..results.output import Output
from ..results.tables import FOUND, NAMED, PLAIN
from .leaders import Row
from .names import capital, full_name


def over_population(output: Output) -> bool:
    """Whether the separation of the trade-off is a worst case over a population of lights."""
    separation = output.trade_off[0]
    return output.study.population is not None and separation.extreme == WORST_CASE and separation.pair is not None


def worst_over(output: Output) -> str:
    """The range of a worst case in words."""
    over = ["production"] if output.study.production.tolerance else []
    return " and ".join(over + (["all lamps"] if over_population(output) else []))


def robustness_lines(output: Output, best: Row | None) -> Iterator[str]:
    """Cost of the worst case, what breaks designs, and yields; nothing without a population of lights.

    In the scenario of the best design, else in the first one.
    """
    if output.study.population is None:
        return
    scenario = output.scenarios[0] if best is None else best["scenario"]
    few: list[Row] = list(output.few[output.few["scenario"] == scenario].to_dict("records"))
    if best is not None and over_population(output):
        yield from _price(output, best, [row for row in few if row["kind"] == NAMED])
    plain = [row for row in few if row["kind"] == PLAIN]
    for row in few:
        if row["kind"] in (NAMED, FOUND) and np.isfinite(row.get("breaks_at", np.nan)):
            yield _breaks(output, row, plain)
        elif row["kind"] == FOUND and plain:
            who = capital(full_name(row))
            yield f"{who} stays above the plain CFAs up to 3 times the stated range of lamps and edges."
    shares = []
    for row in few:
        if np.isfinite(row.get("yield", np.nan)):
            share, low, high = (told_share(row[name], 2) for name in ("yield", "yield_low", "yield_high"))
            name = "the search's answer" if row["kind"] == FOUND else row["name"]
            shares.append(f"{name} {share} ({low} to {high})")
    if shares:
        wanted = output.trade_off[0].told(output.study.population.wanted_dn or 0.0)
        yield f"At least {wanted} have, of random lamps and cameras: {', '.join(shares)} (with 95 % intervals)."


def _price(output: Output, best: Row, named: list[Row]) -> Iterator[str]:
    """The best one beside the named design that separates most in the nominal case."""
    worst = output.trade_off[0]
    nominal = output.columns[worst.of]
    rivals = [row for row in named if row[nominal.name] > best[nominal.name] and row[worst.name] > 0]
    if rivals:
        rival = max(rivals, key=lambda row: float(row[nominal.name]))
        lost, gained = 1 - best[nominal.name] / rival[nominal.name], best[worst.name] / rival[worst.name]
        yield (
            f"Its worst case costs {lost:.1%} of the nominal separation: {nominal.told(best[nominal.name])} against "
            f"{nominal.told(rival[nominal.name])} of {rival['name']}, which has {worst.told(rival[worst.name])} in the "
            f"worst case; {worst.told(best[worst.name])} are {gained:.2f} times that."
        )


def _breaks(output: Output, row: Row, plain: list[Row]) -> str:
    """Where a design falls below the best plain CFA, by which lights, at which temperature."""
    separation, who = output.trade_off[0], capital(full_name(row))
    worst = WORST + (separation.of or separation.name)
    rival = max(plain, key=lambda other: float(other[worst]))
    if row["breaks_at"] == 0:
        return f"{who} is below {rival['name']} with the study's own lights."
    causes = [f"{row[f'breaks_{side}']} ({row[f'breaks_{side}_nm']:+.1f} nm)" for side in ("first", "second")]
    text = " and ".join(causes)
    low, high = row["breaks_low_c"], row["breaks_high_c"]
    if np.isfinite(low):
        text += f", junctions at {' to '.join(dict.fromkeys((f'{low:.0f}', f'{high:.0f}')))} degrees"
    if row["breaks_edge_nm"]:
        text += f", edges {row['breaks_edge_nm']:+.1f} nm"
    if row["breaks_thickness"]:
        text += f", films {row['breaks_thickness']:+.2%}"
    return (
        f"{who} falls below {rival['name']} at {row['breaks_at']:.2f} times the stated range of lamps and "
        f"production: {text}, {separation.told(row['breaks_dn'])}."
    )
