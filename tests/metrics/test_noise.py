"""Noise metrics of whole scenes, against draws of every pixel; studies that ask for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.base.errors import StudyError
from sweep.camera.model import SceneModel
from sweep.study import load_study

from ..draws import draws_dn
from ..hard.scenes import DARK, F2, FAR, FIXED, DesignScene, scene
from ..readout_oracle import pixels_of

NOISY = (
    scene("patch, crosstalk", "quad", {"noise": True}, DARK | {"crosstalk": 0.1}),
    scene("far, center", "RYNCy", {"noise": True, "target": FAR | {"readout": "center"}, "optics": F2}, DARK),
    scene("gain errors", "RCCC", {"noise": True, "target": FAR, "optics": F2}, DARK | {"prnu": 0.05}),
    scene(
        "pulsed, far",
        "RGGB",
        {"noise": True, "target": FAR, "exposure": FIXED, "drive": {"duty": 0.7, "frequency_hz": 100}, "optics": F2},
        DARK,
    ),
)


@pytest.mark.parametrize("made", NOISY, ids=lambda made: made.name)
def test_mean_and_variance_of_the_readout_agree_with_draws_of_every_pixel(made: DesignScene) -> None:
    model = SceneModel(made.setup)
    read = model.read_with_noise(made.curves)
    mean, variance = read.mean, read.variance
    np.testing.assert_array_equal(mean, SceneModel(made.setup).read(made.curves)[0])
    draws, rng = 20_000, np.random.default_rng(7)
    per_place = mean.shape[1] // model.n_cases
    for case in {0, mean.shape[1] - 1}:
        electrons, weights, _ = pixels_of(model, made.curves, case // per_place)
        of_signals = electrons[0, case % per_place]
        for signal in (0, len(made.setup.lights.names) - 1):
            every = np.broadcast_to(of_signals[signal], (draws, of_signals.shape[1]))
            values = draws_dn(every, model.readout.pixel, rng) @ weights
            # 4 sigma of the mean and, by the fourth moment, of the variance.
            off = 4 * values.std(axis=0) / draws**0.5
            np.testing.assert_array_less(np.abs(values.mean(axis=0) - mean[0, case, signal]), off + 1e-9)
            fourth = ((values - values.mean(axis=0)) ** 4).mean(axis=0)
            band = 4 * np.sqrt((fourth - values.var(axis=0) ** 2) / draws)
            np.testing.assert_array_less(np.abs(values.var(axis=0) - variance[0, case, signal]), band + 1e-9)


def test_a_scene_has_its_own_noise() -> None:
    own = scene("own", "RGGB", {"noise": {"read_noise_e": 50, "prnu": 0.02}}, DARK)
    loaded = own.setup.scene.noise
    assert loaded is not None
    pixel = loaded.of(own.setup.camera.pixel)
    assert (pixel.read_noise_e, pixel.prnu, pixel.offset_dn) == (50, 0.02, 64)


STUDY = """
study: noisy
columns: all
seed: 5
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2, offset_dn: 168}
scenarios:
  dim: {noise: true, exposure: {kind: white_patch}, each: {exposure.level: [0.5, 0.02]}}
cfas: [RGGB, RYNCy]
sweeps:
  edges:
    {cfa: RYNCy, channel: N, base: Y, to: G,
     grid: {left_nm: [600, 610], left_width_nm: 10, right_nm: [650, 660], right_width_nm: 5}}
recognition: {states: [yellow, red]}
constraints: {error_yellow_red: {max: 0.5}, dprime_yellow_red: {min: 0.1}}
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("noise: true, ", "", "needs noise in every scenario"),
        ("states: [yellow, red]", "states: [yellow, rad]", "did you mean 'red'"),
        ("error_yellow_red: {max: 0.5}", "error_yellow_red: {min: 0.5}", "has no `min`"),
        ("dprime_yellow_red: {min", "dprime_yellow_green: {min", "unknown quantity"),
        ("noise: true", "noise: {prnu: 0.999}", "less than or equal to 0.1"),
        ("offset_dn: 168}", "offset_dn: 168, well_e: 1.0e+300}", "less than or equal to 10000000"),
    ],
)
def test_faults(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "noisy.yaml"
    path.write_text(STUDY.replace(old, new))
    with pytest.raises(StudyError) as error:
        load_study(path)
    assert said in "\n".join(str(issue) for issue in error.value.issues)


def test_columns_of_noise_must_differ(tmp_path: Path) -> None:
    (tmp_path / "led.csv").write_text("wavelength_nm,x\n400,1\n700,1\n")
    path = tmp_path / "noisy.yaml"
    lights = "lights: {files: [{file: led.csv, quantity: energy, signals: {a: [x], a_b: [x], b_c: [x], c: [x]}}]}"
    states = "recognition: {}\nobjective: csd_a_c\n"
    path.write_text(STUDY.split("recognition:", maxsplit=1)[0].replace("lights: tl16", lights) + states)
    with pytest.raises(StudyError, match="share the column csd_a_b_c"):
        load_study(path)
