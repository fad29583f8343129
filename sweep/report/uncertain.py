"""Sentence on uncertain curves of a run."""

from __future__ import annotations

from collections.abc import Iterator

from ..results.output import Output


def uncertain_lines(output: Output) -> Iterator[str]:
    """Yield the separations of 90 % of the random sensors, of named designs and the answer in the leading scenario."""
    errors, separation = output.study.uncertainty, output.trade_off[0]
    if output.uncertainty is None or errors is None:
        return
    known = output.uncertainty
    known = known[(known["quantity"] == separation.name) & (known["scenario"] == output.scenario)]
    parts = [
        f"{row['name']} {separation.formatted(row['dn_5'])} to {separation.formatted(row['dn_95'])}"
        + (f" ({row['ratio_5']:.2f} to {row['ratio_95']:.2f} times {row['reference']})" if row["ratio_sd"] > 0 else "")
        for row in known.to_dict("records")
    ]
    if parts:
        yield (
            f"The {separation.words} of 90 % of {errors.draws:,} random sensors within the stated errors, before "
            f"clipping and rounding: {'; '.join(parts)}."
        )
