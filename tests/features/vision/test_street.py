"""Streets: each head is that of its own image, lamps have their light, and glare keeps it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sweep.features.vision.images import HeadCamera
from sweep.features.vision.keys import Street
from sweep.features.vision.lamps import TEST, Lamps, split_lamps
from sweep.features.vision.scenes import Scenes
from sweep.features.vision.street import StreetCamera, StreetScenes, corners_px, draw_streets

from .heads import NO_FILTERS, head_setup, vision

KEY = {"design_id": 0, "name": "RGGB", "cfa": "RGGB", "seed": 0}


def streets(cfa: str = "RGGB", **changes: Any) -> tuple[StreetCamera, StreetScenes]:
    few = {"columns": 3, "rows": 2, "heads": 2, "brake_lamps": 2, "street_lamps": 1, "test_images": 20}
    street = Street(**few | {"train_images": 40} | changes)
    requested, setup = vision(distances_m=[60.0, 120.0], street=street), head_setup(cfa, crosstalk=0.0)
    camera = StreetCamera(HeadCamera(setup, NO_FILTERS, requested), street)
    return camera, draw_streets(requested, street, TEST, (1, 0))


def lamps_of(camera: StreetCamera) -> Lamps:
    return split_lamps(camera.camera.setup.lights, camera.camera.vision, (1, 0))[TEST]


@pytest.mark.parametrize("cfa", ["RGGB", "RCCB"])
def test_a_head_of_a_street_is_that_of_its_own_image(cfa: str) -> None:
    """Alone it has the electrons of the benchmark's single head; around it is the background."""
    camera, scenes = streets(cfa, heads=1, brake_lamps=0, street_lamps=0)
    images, heads, lamps = camera.expected(scenes, lamps_of(camera)), camera.camera, lamps_of(camera)
    corners = corners_px(heads.vision, (2, 2), scenes)
    members = [lamps.of_lens[max(state - 1, 0)] for state in scenes.state[:, 0]]
    lamp = np.array(
        [of_type[int(share * len(of_type))] for of_type, share in zip(members, scenes.lamp[:, 0], strict=True)]
    )
    intensities = np.array(heads.vision.intensities_cd)
    alone = Scenes(
        state=scenes.state[:, 0],
        lamp=np.where(scenes.state[:, 0] > 0, lamp, -1),
        intensity=np.abs(intensities - scenes.candelas).argmin(axis=1),
        background=scenes.background,
        distance=scenes.distance[:, 0],
        level=scenes.level,
        order=np.zeros(len(scenes), dtype=np.intp),
        phantom=scenes.phantom,
        place=scenes.place[:, 0],
        key=scenes.key,
    )
    single = heads.expected(alone).reshape(-1, 24, 24)
    for image, (row, column), own, level, behind in zip(
        images, corners[:, 0], single, scenes.level, scenes.background, strict=True
    ):
        np.testing.assert_allclose(image[row : row + 24, column : column + 24], own, rtol=1e-9)
        away = np.ones_like(image, dtype=bool)
        away[row : row + 24, column : column + 24] = False
        around = np.tile(heads.background(int(level))[behind].reshape(24, 24)[:2, :2], (36, 54))
        np.testing.assert_allclose(image[away], around[away], rtol=1e-9)


def test_another_lamp_of_a_signal_s_spectrum_is_as_bright_as_the_signal() -> None:
    """The middle lens stands where other lamps do: one candela has the same electrons."""
    camera = streets()[0].camera
    photons = camera.setup.lights.photons[:3]
    lamps = camera.lamps(1, photons)
    signals = camera.electrons(1, 0).lamps[:, 1, :3]
    np.testing.assert_allclose(lamps, signals, rtol=1e-9, atol=1e-12)


def test_glare_keeps_the_light_and_fills_the_dark() -> None:
    plain, scenes = streets()
    veiled, same = streets(veiling_glare=0.05)
    np.testing.assert_array_equal(same.key, scenes.key)
    without, behind = plain.expected(scenes, lamps_of(plain)), veiled.expected(same, lamps_of(veiled))
    np.testing.assert_allclose(behind.sum(axis=(1, 2)), without.sum(axis=(1, 2)), rtol=1e-9)
    assert (behind.min(axis=(1, 2)) > without.min(axis=(1, 2))).all()
    assert (behind.max(axis=(1, 2)) < without.max(axis=(1, 2))).all()


def test_images_do_not_depend_on_how_many_are_made_at_once() -> None:
    camera, scenes = streets(test_images=50)
    together = np.concatenate([batch.images for batch in camera.batches(scenes, lamps_of(camera), KEY, TEST, "raw")])
    alone = next(camera.batches(scenes.subset(slice(40, 41)), lamps_of(camera), KEY, TEST, "raw")).images
    np.testing.assert_array_equal(together[40], alone[0])
