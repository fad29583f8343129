"""Words on noise: who is named as the one that needs least, or bears most."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pandas as pd

from sweep.metrics.columns.confusion import STATE_ERROR
from sweep.report.noise import UsableEnds, usable_ends

LUMINANCES = (10, 20, 100, 200)
SCENES = [f"night luminance_cd_m2={value}" for value in LUMINANCES]


def ends(errors: dict[str, list[float]], passes: dict[str, float]) -> list[UsableEnds]:
    """Of a run with these errors at the luminances, and what it has computed between them."""
    rows = [
        {"name": name, "scenario": scene, STATE_ERROR: error}
        for name, own in errors.items()
        for scene, error in zip(SCENES, own, strict=True)
    ]
    found = [
        {"series": "night", "key": "luminance_cd_m2", "name": name, "at": at, "error": 0.01}
        for name, at in passes.items()
    ]
    asked = SimpleNamespace(recognition=SimpleNamespace(error_max=0.01), study="night")
    output: Any = SimpleNamespace(
        study=asked,
        few=pd.DataFrame(rows),
        scenarios=SCENES,
        crossings=pd.DataFrame(found),
        recognition=None,
        once=lambda _, make: make(),
    )
    return list(usable_ends(output))


def test_nobody_is_named_where_one_that_is_usable_may_need_less() -> None:
    """B needs about 15 cd/m2, and saturates: its error passes what is allowed twice, so that no end of it is known."""
    rising = [0.3, 0.1, 1e-3, 1e-4]
    nowhere = [0.5, 0.4, 0.3, 0.2]
    assert [each.at for each in ends({"A": rising, "C": nowhere}, {"A": 40.0})] == [{"A": 40.0}]
    assert ends({"A": rising, "B": [0.3, 1e-3, 1e-3, 0.3], "C": nowhere}, {"A": 40.0}) == []
