"""No function of an effect that a scene leaves out is entered, and a design alone is the same as in a batch."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import numpy as np
import pytest

import sweep
from sweep.camera.model import SceneModel
from sweep.metrics.evaluate import evaluate
from sweep.study import load_study, sensor_studies_in

from ..hard.scenes import DARK, FAR, scene

PACKAGE = f"{Path(sweep.__file__).parent}/"
STUDIES = [path for path in sorted(Path(__file__).parents[2].glob("studies/*.yaml")) if sensor_studies_in(path) is None]
STATES = ("yellow", "red")
EFFECTS = {
    "HDR": ("camera/noise/merge", "camera/noise/subsets", "Merged."),
    "pulse": ("camera/pwm.py", "Pulsed"),
    "angle": ("camera/angular.py",),
    "target": (
        "camera/phases.py",
        "camera/disc_image.py",
        "camera/disc_kernels.py",
        "camera/psf.py",
        "sampling.window",
    ),
    "pixels": ("Pixels.", "camera/pixel_kernels.py"),
    "axes": ("camera/axis.py",),
    "noise": ("camera/noise/law", "camera/noise/moments", "camera/noise/errors", "Confusion.of_cases"),
    "brightness": ("metrics/walk_kernels.py", "metrics/brightness.py"),
    "background": ("View.background.<", "Position.of_background"),
    "grids": ("camera/along.py",),
}
"""Files and functions of each effect."""
SHORT = {"exposure": {"kind": "fixed", "exposure_s": 1e-4}}
"""No pixel fills before lamps look most alike."""
SCENES = {
    "chart": ({} | SHORT, {}, set()),
    "light": ({"target": FAR} | SHORT, {}, {"target", "pixels"}),
    "any place": ({"target": FAR | {"phase_px": "any"}} | SHORT, {}, {"target", "pixels", "axes"}),
    "noise": ({"noise": True} | SHORT, DARK, {"noise", "brightness"}),
    "pulse": ({"drive": {"duty": 0.5, "frequency_hz": 90}} | SHORT, {}, {"pulse", "axes"}),
    "field": ({"field": {"cra_max_deg": 20.0}} | SHORT, {}, {"angle"}),
    "HDR": ({"noise": True} | SHORT, DARK | {"captures": "split_pixel"}, {"HDR", "noise", "brightness"}),
    "crosstalk": ({"background_cd_m2": 10.0} | SHORT, {"crosstalk": 0.02}, {"pixels", "background"}),
}


@contextmanager
def entered() -> Iterator[set[str]]:
    """Functions of the package that are entered, with their files."""
    found = set[str]()

    def follow(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and (file := frame.f_code.co_filename).startswith(PACKAGE):
            found.add(f"{file.removeprefix(PACKAGE)} {frame.f_code.co_qualname}")

    sys.setprofile(follow)
    try:
        yield found
    finally:
        sys.setprofile(None)


@pytest.mark.parametrize("name", SCENES)
def test_only_effects_of_the_scene_are_entered(name: str) -> None:
    given, pixel, allowed = SCENES[name]
    made = scene(name, "RYNCy", given, pixel or None, index=1.8 if name == "field" else None)
    states = STATES if "noise" in allowed else ()
    with entered() as functions:
        evaluate(SceneModel(made.setup), made.curves, states)
    strange = {
        function
        for effect in EFFECTS.keys() - allowed
        for part in EFFECTS[effect]
        for function in functions
        if part in function
    }
    assert not strange
    for effect in allowed:
        assert any(part in function for part in EFFECTS[effect] for function in functions), effect


@pytest.mark.slow
@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_a_batch_says_what_its_designs_say_alone(path: Path) -> None:
    """In the first scene of each kind of every study, for three designs of its first box of filters."""
    study = load_study(path).with_plans()
    spaces = [space for space in study.spaces if space.filter is not None] or list(study.spaces[:1])
    space = max(spaces, key=lambda space: space.size)
    numbers = np.unique(np.linspace(0, space.size - 1, 3).astype(int))
    curves = space.curves(space.points_of(numbers), study.grid.size)
    names = {name.split(" ")[0]: name for name in reversed(study.scenarios)}
    for name in names.values():
        setup = study.setup(space, name)
        states = study.states if setup.scene.noise is not None else ()
        together = evaluate(SceneModel(setup), curves, states)
        for at in range(len(curves)):
            alone = evaluate(SceneModel(setup), curves[at : at + 1], states)
            for column, values in together.items():
                np.testing.assert_allclose(
                    values[at], alone[column][0], rtol=1e-9, atol=1e-9, err_msg=f"{name} {column}"
                )
