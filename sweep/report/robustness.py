"""What a worst case over lamps costs in the nominal one, what breaks an answer, and which share of lamps it keeps."""

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
    """What a worst case is over, in words."""
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
    for row in few:
        if row["kind"] in (NAMED, FOUND) and np.isfinite(row.get("breaks_at", np.nan)):
            yield _breaks(output, row, few)
    held = [row for row in few if row["kind"] == FOUND and not np.isfinite(row.get("breaks_at", np.nan))]
    for row in held if any(each["kind"] == PLAIN for each in few) else ():
        yield f"{_named(row)} stays above the plain CFAs up to 3 times the stated range of lamps and edges."
    kept = [(row, row.get("yield", np.nan)) for row in few]
    each = ", ".join(f"{_name(row)} {_share(row)}" for row, share in kept if np.isfinite(share))
    if each:
        wanted = output.trade_off[0].told(output.study.population.wanted_dn or 0.0)
        yield f"At least {wanted} have, of random lamps and cameras: {each} (with 95 % intervals)."


def _price(output: Output, best: Row, named: list[Row]) -> Iterator[str]:
    """The best one beside the named design that separates most in the nominal case."""
    worst = output.trade_off[0]
    nominal = output.columns[worst.of]
    rivals = [row for row in named if row[nominal.name] > best[nominal.name] and row[worst.name] > 0]
    if not rivals:
        return
    rival = max(rivals, key=lambda row: float(row[nominal.name]))
    lost, gained = 1 - best[nominal.name] / rival[nominal.name], best[worst.name] / rival[worst.name]
    yield (
        f"Its worst case costs {lost:.1%} of the nominal separation: {nominal.told(best[nominal.name])} against "
        f"{nominal.told(rival[nominal.name])} of {rival['name']}, which has {worst.told(rival[worst.name])} in the "
        f"worst case; {worst.told(best[worst.name])} are {gained:.2f} times that."
    )


def _breaks(output: Output, row: Row, few: list[Row]) -> str:
    """Where a design falls below the best plain CFA, by which lights, at which temperature."""
    separation = output.trade_off[0]
    worst = WORST + (separation.of or separation.name)
    plain = max((each for each in few if each["kind"] == PLAIN), key=lambda each: float(each[worst]))
    if row["breaks_at"] == 0:
        return f"{_named(row)} is below {plain['name']} with the study's own lights."
    each = [f"{row[f'breaks_{side}']} ({row[f'breaks_{side}_nm']:+.1f} nm)" for side in ("first", "second")]
    low, high = row["breaks_low_c"], row["breaks_high_c"]
    warm = "" if not np.isfinite(low) else f", junctions at {_span(low, high)} degrees"
    edges = f", edges {row['breaks_edge_nm']:+.1f} nm" if row["breaks_edge_nm"] else ""
    edges += f", films {row['breaks_thickness']:+.2%}" if row["breaks_thickness"] else ""
    return (
        f"{_named(row)} falls below {plain['name']} at {row['breaks_at']:.2f} times the stated range of lamps and "
        f"production: {' and '.join(each)}{warm}{edges}, {separation.told(row['breaks_dn'])}."
    )


def _span(low: float, high: float) -> str:
    one, other = f"{low:.0f}", f"{high:.0f}"
    return one if one == other else f"{one} to {other}"


def _name(row: Row) -> str:
    return "the search's answer" if row["kind"] == FOUND else str(row["name"])


def _named(row: Row) -> str:
    return capital(full_name(row))


def _share(row: Row) -> str:
    """A share with its interval, percent."""
    low, high = (told_share(row[end], 2) for end in ("yield_low", "yield_high"))
    return f"{told_share(row['yield'], 2)} ({low} to {high})"
