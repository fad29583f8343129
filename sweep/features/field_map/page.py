"""Answer of a scene with a field: from the center of the sensor to its corner."""

from __future__ import annotations

from dataclasses import replace

from ...report.answers import figures, filters, others_over, over, trade_off
from ...report.panels import Answer, Section
from ...report.run import LIGHT, Run, Series
from . import SENSOR_MAP


def field(run: Run) -> Answer:
    """Return the separation from the center of the sensor to its corner."""
    of, goal = run.output.tables[SENSOR_MAP], run.goal.of or run.goal.name
    named = of.assign(name=of["design_id"].map(run.names)).dropna(subset=["name"])
    table = named.pivot_table(goal, "cra_deg", "name", aggfunc="min", sort=True)
    one = Series("", "cra_deg", {str(angle): float(angle) for angle in table.index})
    section = over(run, one, {name: table[name].to_numpy(dtype=float) for name in run.values(LIGHT) if name in table})
    if section is None:
        return trade_off(run)
    lead = replace(section, title="From the center to the corner", panels=(*filters(run), *section.panels))
    return Answer(
        "series",
        lead,
        {"dark": "", "over": "from the center to the corner", "others": others_over(run, lead.table)},
        [Section("The price", figures(run))],
    )


KINDS = {"field": (10, lambda run: SENSOR_MAP in run.output.tables, field)}
