"""Plans are found once, as long as nothing that they depend on changes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from sweep.camera.plan.plan import Plan
from sweep.results.kept_plans import KeptPlans, plan_key
from sweep.run import with_plans
from sweep.study import Study, load_study

from ..build import stopband_study

FAR_M = "distance_m: 200"
SCENES = """\
tolerance_dn: 0.1
scenarios:
  near: {target: {distance_m: 40, fov_deg: 60}, optics: {f_number: 2}}
  far: {target: {distance_m: 200, fov_deg: 60}, optics: {f_number: 2}}
"""


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """Scenes that are planned, in a cache of this test."""
    monkeypatch.setenv("SWEEP_CACHE", str(tmp_path / "cache"))
    scenes: list[str] = []

    find = Study.plan

    def plan(self: Study, scenario: str, tolerance_dn: float | None = None, *, always: bool = False) -> Plan:
        scenes.append(scenario)
        return find(self, scenario, tolerance_dn, always=always)

    monkeypatch.setattr(Study, "plan", plan)
    return scenes


@pytest.fixture
def study_at(tmp_path: Path) -> Callable[..., Study]:
    """A study of two scenes, a text in it replaced by another one."""

    def at(text: str = "", other: str = "") -> Study:
        study = stopband_study(
            "two", "{left_nm: [600, 610], left_width_nm: 20, right_nm: [650, 660], right_width_nm: 10}", before=SCENES
        )
        assert text in study
        path = tmp_path / "two.yaml"
        path.write_text(study.replace(text, other) if text else study)
        return load_study(path)

    return at


def _silent(_: str, __: int, ___: int) -> None:
    pass


def test_a_scene_is_planned_once(found: list[str], study_at: Callable[..., Study]) -> None:
    plans = with_plans(study_at(), 1, _silent).plans
    assert found == ["near", "far"]
    assert with_plans(study_at(), 1, _silent).plans == plans
    assert found == ["near", "far"]
    with_plans(study_at(FAR_M, "distance_m: 210"), 1, _silent)
    assert found == ["near", "far", "far"]
    with_plans(study_at(), 1, _silent, tolerance_dn=10)
    assert found == ["near", "far", "far", "near", "far"]


@pytest.mark.parametrize(
    ("text", "other"),
    [
        ("tolerance_dn: 0.1", "tolerance_dn: 0.2"),
        ("sensor: ar0820\nlights", "sensor: ar0820\npixel: {well_e: 9000}\nlights"),
        ("[600, 610]", "[600, 611]"),
        ("far: {", "far: {visibility_m: 300, "),
    ],
)
def test_the_key_knows_what_a_plan_depends_on(study_at: Callable[..., Study], text: str, other: str) -> None:
    assert plan_key(study_at(), "far", None) == plan_key(study_at(), "far", None)
    assert plan_key(study_at(), "far", None) != plan_key(study_at(text, other), "far", None)


def test_a_damaged_plan_is_found_again(found: list[str], study_at: Callable[..., Study], tmp_path: Path) -> None:
    plans = with_plans(study_at(), 1, _silent).plans
    kept = sorted((tmp_path / "cache" / "plans").iterdir())
    assert len(kept) == 4  # under the study's key, and under that of each scene
    texts = [path.read_text() for path in kept]
    for path, text in zip(kept, texts, strict=True):
        assert "skip" in text
        path.write_text(text.replace("skip", "full", 1) if path is not kept[0] else "[" * 100_000)
    assert with_plans(study_at(), 1, _silent).plans == plans
    assert len(found) == 4
    assert [path.read_text() for path in kept] == texts


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(
    found: list[str], study_at: Callable[..., Study], tmp_path: Path
) -> None:
    (tmp_path / "cache").write_text("in the way")
    assert with_plans(study_at(), 1, _silent).plans.keys() == {"near", "far"}
    assert KeptPlans().of(plan_key(study_at(), "far", None)) is None
    assert found == ["near", "far"]
