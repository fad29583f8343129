"""Separation that the wanted share of random lamps and cameras has, on draws that no search has looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pyarrow as pa

from ...base.types import delayed
from ...metrics.quantity import OF_A_SHARE
from ...metrics.separation import csd_name
from ...runs.analysis import Calls, named_designs, table_of_calls
from ...spectra.lights import Pair
from ...study import Study
from . import YIELDS
from .robustness import Candidate, candidate_of, drawn_dn
from .uncertainty import quantile

if TYPE_CHECKING:
    import pandas as pd

_SCHEMA = pa.schema(
    [("design_id", pa.int64()), ("name", pa.string()), ("scenario", pa.string()), ("quantity", pa.string())]
    + [("share", pa.float64()), ("draws", pa.int64())]
    + [(name, pa.float64()) for name in ("dn", "dn_low", "dn_high")]
)


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Judge each design, with a 95 % interval of the value that the share of all lamps and cameras has."""
    for design in named_designs(study, rows):
        key = design.key | {"name": design.row["name"], "scenario": design.row["scenario"]}
        for pair in _pairs(study):
            candidate, share = candidate_of(study, design), study.section.wanted_yield
            yield key, delayed(_judged, candidate, pair, share, study.section.seed)


def _pairs(study: Study) -> list[Pair]:
    """Return the types whose yield is asked for, in the order of the lights; else those of the front."""
    asked = [study.quantities[name] for name in (*study.objective.weights, *study.constraints)]
    wanted = {quantity.pair for quantity in asked if quantity.extreme == OF_A_SHARE}
    wanted = wanted or {study.quantities[study.trade_off[0]].pair}
    return [pair for pair in study.pairs if pair in wanted]


def _judged(design: Candidate, pair: Pair, share: float, seed: int) -> list[dict[str, Any]]:
    dn = drawn_dn(design, pair, seed)
    of_all = dict(zip(("dn", "dn_low", "dn_high"), quantile(dn, 1 - share), strict=True))
    return [{"quantity": csd_name(pair), "share": share, "draws": dn.size, **of_all}]


JUDGED_YIELDS = table_of_calls(
    YIELDS,
    "other lamps and cameras",
    lambda study: study.requested.wanted_yield > 0 and bool(_pairs(study)),
    lambda _: _SCHEMA,
    _calls,
    is_kept=True,
)
