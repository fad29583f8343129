"""Plans of a study's scenes are found anew by each run."""

from __future__ import annotations

from pathlib import Path

import pytest

from sweep.camera.plan.plan import Plan
from sweep.run import with_plans
from sweep.study import Study, load_study

from ..build import stopband_study

SCENES = """\
tolerance_dn: 0.1
scenarios:
  near: {target: {distance_m: 40, fov_deg: 60}, optics: {f_number: 2}}
  far: {target: {distance_m: 200, fov_deg: 60}, optics: {f_number: 2}}
"""


def test_nothing_on_the_disk_stands_for_a_plan(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What was kept there could be forged, and would change rows without a word."""
    for name in ("SWEEP_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / "cache"))
    path, planned, find = tmp_path / "two.yaml", [], Study.plan

    def plan(self: Study, scenario: str, tolerance_dn: float | None = None, *, always: bool = False) -> Plan:
        planned.append(scenario)
        return find(self, scenario, tolerance_dn, always=always)

    monkeypatch.setattr(Study, "plan", plan)
    bands = "{left_nm: [600, 610], left_width_nm: 20, right_nm: [650, 660], right_width_nm: 10}"
    path.write_text(stopband_study("two", bands, before=SCENES))
    told: list[tuple[int, int]] = []
    found = [with_plans(load_study(path), 1, lambda _, *counts: told.append(counts)).plans for _ in range(2)]
    assert planned == 2 * ["near", "far"]
    assert found[0] == found[1]
    assert list(found[0]) == ["near", "far"]
    assert told == 2 * [(1, 2), (2, 2)]
    assert not (tmp_path / "cache").exists()
