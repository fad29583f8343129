"""Effects of a user's own, and the one that is shipped: veiling glare."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sweep.base.errors import StudyError, SweepError
from sweep.base.user_code import UserCode
from sweep.camera.irradiance import background_irradiance, path_factor, scene_irradiance, signal_irradiance
from sweep.camera.scene import Scene
from sweep.camera.user_effects import UserEffect
from sweep.study import load_study

from ..hard.scenes import scene, target

LIT = {"target": target(50, 60), "exposure": {"kind": "fixed", "exposure_s": 2e-3}, "background_cd_m2": 300.0}


def own_effect(body: str) -> UserEffect:
    source = f"from dataclasses import replace\nimport numpy as np\ndef effect(irradiance, scene):\n    {body}\n"
    return UserEffect(UserCode("my.py:effect", source))


def test_effects_are_applied_in_order_and_see_their_scene() -> None:
    setup = scene("lit", "RGGB", LIT).setup
    halved = own_effect("return replace(irradiance, signals=irradiance.signals / 2)")
    added = own_effect(
        "return replace(irradiance, signals=irradiance.signals + scene.target.distance_m * irradiance.background)"
    )
    seen = scene_irradiance(replace(setup, user_effects=(halved, added)))
    np.testing.assert_allclose(
        seen.signals, signal_irradiance(setup) / 2 + 50 * background_irradiance(setup), rtol=1e-14
    )
    np.testing.assert_array_equal(seen.background, background_irradiance(setup))


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("return replace(irradiance, signals=irradiance.signals[0])", "another shape of `signals`"),
        ("return replace(irradiance, background=-irradiance.background)", "no irradiance in `background`"),
        ("return replace(irradiance, signals=irradiance.signals * np.nan)", "no irradiance in `signals`"),
        ("return irradiance.signals", "AttributeError"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("return replace(irradiance, signals='bright')", "ValueError"),
    ],
)
def test_invalid_irradiance_of_a_user_effect_is_one_line(body: str, message: str) -> None:
    setup = replace(scene("lit", "RGGB", LIT).setup, user_effects=(own_effect(body),))
    with pytest.raises(SweepError, match=message):
        scene_irradiance(setup)


def test_a_failing_effect_is_refused_with_the_study(tmp_path: Path) -> None:
    (tmp_path / "my.py").write_text("def effect(irradiance, scene):\n    return None\n")
    study = tmp_path / "mine.yaml"
    study.write_text("study: mine\nsensor: ar0820\nlights: tl16\ncfas: [RGGB]\neffects: ['my.py:effect']\n")
    with pytest.raises(StudyError, match=r"mine.yaml:5: effects: my.py:effect: AttributeError"):
        load_study(study, allow_code=True)


@pytest.mark.parametrize(("field_cd_m2", "mean_cd_m2"), [(None, 300.0), (5000.0, 5000.0), (0.0, 0.0)])
def test_veiling_glare_spreads_a_share_of_the_mean_light(field_cd_m2: float | None, mean_cd_m2: float) -> None:
    plain = scene("lit", "RGGB", LIT).setup
    glare = {"share": 0.05, "field_cd_m2": field_cd_m2}
    setup = scene("glare", "RGGB", LIT | {"veiling_glare": glare}).setup
    mean = background_irradiance(plain) * mean_cd_m2 / 300
    np.testing.assert_allclose(signal_irradiance(setup), 0.95 * signal_irradiance(plain), rtol=1e-13)
    np.testing.assert_allclose(
        background_irradiance(setup), 0.95 * background_irradiance(plain) + 0.05 * mean, rtol=1e-13
    )


def test_veiling_glare_is_the_same_off_axis() -> None:
    """Light that the lens scatters is no image, and is not dimmed as one."""
    glare = LIT | {"veiling_glare": {"share": 0.05, "field_cd_m2": 2000.0}, "background_cd_m2": 0.0}
    found = []
    for off_axis_deg in (0.0, 30.0):
        setup = scene("glare", "RGGB", glare | {"off_axis_deg": off_axis_deg}).setup
        nodes_nm = setup.camera.grid.nodes_nm
        found.append(background_irradiance(setup) * path_factor(setup, nodes_nm, background=True))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12)
    assert found[0].min() > 0


def test_veiling_glare_needs_a_target() -> None:
    with pytest.raises(ValueError, match="veiling_glare needs a target"):
        Scene.model_validate({"veiling_glare": {"share": 0.05}})
