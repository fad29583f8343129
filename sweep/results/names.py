"""Names that commands give to the files of a run."""

from __future__ import annotations

import re

from .tables import (
    AUDIT,
    CROSSINGS,
    CURVES,
    FRONT,
    LEFT_OUT,
    LIMITED_BY,
    POINTS,
    PROVENANCE,
    RECOGNITION,
    REGIONS_MAP,
    RENDERED,
    RESOLVED,
    RESULTS,
    ROBUSTNESS,
    SEARCH_LOG,
    SENSOR_MAP,
    TRADED,
    VALIDATED,
    VISION_TABLES,
)

RUN, SUMS = "run.json", "SHA256SUMS"
REPORT, FIGURES, VISION_FIGURES = "report.html", "figures", "vision-"
TABLES = (
    RESULTS,
    SEARCH_LOG,
    FRONT,
    CURVES,
    POINTS,
    LIMITED_BY,
    VALIDATED,
    LEFT_OUT,
    ROBUSTNESS,
    REGIONS_MAP,
    SENSOR_MAP,
    RECOGNITION,
    CROSSINGS,
    TRADED,
    RENDERED,
    *VISION_TABLES,
)
MADE_BY_RUN = frozenset((*TABLES, RESOLVED, PROVENANCE))
"""What a run itself writes beside its list; the report draws from it, `sweep audit` adds a table."""
_DRAWN = re.compile(
    r"report\.html|cfas\.(png|svg)|pareto(-\d+)?\.(png|svg)|paper_comparison\.(csv|parquet)"
    r"|figures/((filters|series|places)-\d+|tiles|sensor|signals|chart|scorecard|(color-noise|rendered)-\d+"
    r"|regions-\d+|clouds-(cfas|designs)|vision-(errors|ranks|misread))\.(png|svg)"
)


def is_drawn(name: str) -> bool:
    """Whether it is a file of the report."""
    return _DRAWN.fullmatch(name) is not None


def is_own(name: str) -> bool:
    """Whether it is a name that commands give to files of a run, beside its two lists."""
    return name in MADE_BY_RUN or name == AUDIT or is_drawn(name)
