"""How long a report will take: a picture is drawn and timed, and a report takes as long as so many of these."""

from __future__ import annotations

import time

from ..study import Study
from .figures import CurvesFigure, draw_curves, rendered

_PICTURES, _PER_SCENARIO, _OF_GRIDS = 17.0, 0.5, 12.0
"""Of a report, for each scenario of its study, and for sweeps of many designs; `python -m tests.bench_estimate`."""
_MANY = 1000


def report_seconds(study: Study) -> float:
    """About how long the report takes."""
    many = study.n_designs / len(study.scenarios) > _MANY
    return _picture_seconds(study) * (_PICTURES + _PER_SCENARIO * len(study.scenarios) + _OF_GRIDS * many)


def _picture_seconds(study: Study) -> float:
    """Of a picture, as both kinds of file; the first one loads fonts, the second one is timed."""
    took = 0.0
    for _ in range(2):
        begun = time.monotonic()
        figure = draw_curves(CurvesFigure(study.name, "QE", study.grid.nodes_nm, study.sensor.qe))
        for kind in ("png", "svg"):
            rendered(figure, kind)
        took = time.monotonic() - begun
    return took
