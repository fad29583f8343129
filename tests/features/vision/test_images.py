"""Images against the product's readout, and against a simulation that shares no code with them."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import permutations
from typing import Any, get_args

import numpy as np
import pytest

from sweep.base.types import FloatArray
from sweep.camera.mosaic import Mosaic
from sweep.camera.noise.merge import light_of, limits_dn
from sweep.camera.pixel import Pixel
from sweep.features.vision.head import head_places_px
from sweep.features.vision.images import HeadCamera, setup_at
from sweep.features.vision.keys import Material, Vision
from sweep.features.vision.lamps import TEST, split_lamps
from sweep.features.vision.materials import ambient_light, phantom, reflectance
from sweep.features.vision.pixel_table import pixel_table
from sweep.features.vision.planes import demosaicked
from sweep.features.vision.scenes import SHUFFLED, Scenes, draw_scenes
from sweep.spectra.builtin.spectra import shipped_groups
from sweep.spectra.color import luminance_per_photon_radiance
from sweep.spectra.spectrum import WavelengthGrid

from ...draws import draws_dn, merged_draws
from .heads import NO_FILTERS, head_setup, vision

FOUR = ["red", "orange", "yellow", "green"]


def brute_force(requested: Vision, scenes: Scenes, at: int) -> np.ndarray:
    """Expected electrons of a scene: radiance on a fine grid, a discrete Fourier transform, pixels, neighbors."""
    setup, tall = head_setup(), 1.5 * (len(requested.lenses) - 1)
    grid, fine, finer, size = setup.camera.grid, 8, 8, 48
    level = list(requested.levels.values())[scenes.level[at]]
    distance_m = requested.distances_m[scenes.distance[at]]
    across = setup_at(setup, requested, distance_m, level).scene.target.object_resolution_px  # type: ignore[union-attr]
    center = head_places_px(requested, setup.camera.mosaic)[int(scenes.place[at] * 16)]
    start = -(size - requested.crop_px) // 2
    points = start - 0.5 + (np.arange(size * fine * finer) + 0.5) / (fine * finer)
    x, y = points[None, :] - center[0], points[:, None] - center[1]
    ambient = ambient_light(grid, level.light)
    luminance = luminance_per_photon_radiance(grid, ambient[None])[0]
    arriving = ambient * level.illuminance_lx / math.pi / luminance
    black, dark = (arriving * reflectance(grid, of) for of in ("black", "dark gray"))  # type: ignore[arg-type]
    ground = arriving * reflectance(grid, requested.backgrounds[scenes.background[at]])
    area = math.pi * 0.1**2
    lit = scenes.state[at] - 1
    lenses = []
    for kind in list(permutations(range(len(requested.lenses))))[scenes.order[at]]:
        seen = black.copy()
        if scenes.phantom[at]:
            sun = phantom(grid, requested.lenses[kind])
            seen += sun * level.phantom_cd / area / luminance_per_photon_radiance(grid, sun[None])[0]
        if kind == lit:
            lamp = setup.lights.photons[scenes.lamp[at]]
            candelas = requested.intensities_cd[scenes.intensity[at]]
            seen += lamp * candelas / area / luminance_per_photon_radiance(grid, lamp[None])[0]
        lenses.append(seen)
    frequency = np.hypot(*np.meshgrid(*[np.fft.fftfreq(size * fine, 2.1 / fine)] * 2))
    electrons = np.zeros((size, size))
    tile = setup.camera.mosaic.indices[np.ix_((np.arange(size) + start) % 2, (np.arange(size) + start) % 2)]
    shapes = [
        (np.abs(x) <= wide * across / 2) & (np.abs(y) <= high * across / 2)
        for wide, high in ((3.0, 3.0 + tall), (1.6, 1.6 + tall))
    ]
    shapes += [x**2 + (y - (1.5 * up - tall / 2) * across) ** 2 <= (across / 2) ** 2 for up in range(len(lenses))]
    covered = [shape.reshape(size * fine, finer, size * fine, finer).mean(axis=(1, 3)) for shape in shapes]
    layers = [black - ground, dark - black, *(lens - dark for lens in lenses)]
    widths_nm = np.full(grid.size, grid.step_nm)
    widths_nm[[0, -1]] /= 2
    for w, wavelength_um in enumerate(grid.nodes_nm * 1e-3):
        scene = ground[w] + sum(share * layer[w] for share, layer in zip(covered, layers, strict=True))
        s = np.minimum(frequency * wavelength_um * 2.0, 1.0)
        otf = 2 / math.pi * (np.arccos(s) - s * np.sqrt(1 - s**2))
        image = np.fft.ifft2(np.fft.fft2(scene) * otf).real
        pixels = image.reshape(size, fine, size, fine).mean(axis=(1, 3))
        electrons += pixels * setup.camera.qe[tile, w] * widths_nm[w] * math.pi / 17 * (2.1e-6) ** 2 * level.exposure_s
    around = sum(np.roll(electrons, shift, axis) for shift in (-1, 1) for axis in (0, 1))
    mixed = 0.99 * electrons + 0.0025 * around
    inner = slice(-start, -start + requested.crop_px)
    return np.asarray(mixed[inner, inner])


@pytest.mark.parametrize(
    ("lenses", "count"),
    [
        (["red", "yellow", "green"], 2),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in ((["red", "orange"], 2), (FOUR, 5))),
    ],
)
def test_scenes_are_those_of_a_brute_force_simulation(lenses: list[str], count: int) -> None:
    """Within 1 % of the brightest pixel: shapes are made of 64 points along a pixel, light of 8."""
    requested, setup = vision(lenses=lenses), head_setup()
    scenes = draw_scenes(requested, split_lamps(setup.lights, requested, (1, 0))[TEST], SHUFFLED, count, (3,))
    found = HeadCamera(setup, NO_FILTERS, requested).expected(scenes)
    for at in range(count):
        wanted = brute_force(requested, scenes, at)
        np.testing.assert_allclose(found[at].reshape(wanted.shape), wanted, atol=0.01 * wanted.max())


@pytest.mark.parametrize("name", get_args(Material))
def test_a_surface_sends_back_a_share_of_the_light(name: Material) -> None:
    """Those of the shipped groups are the mean of their spectra."""
    grid = WavelengthGrid()
    found = reflectance(grid, name)
    assert found.min() > 0
    assert found.max() < 1
    if name in shipped_groups():
        seen = [np.interp(grid.nodes_nm, each.wavelength_nm, each.value) for each in shipped_groups()[name]]
        np.testing.assert_allclose(found, np.mean(seen, axis=0), rtol=1e-9)


def held_shares(pixel: Pixel, electrons: FloatArray) -> FloatArray:
    """Probability of each reading."""
    held = pixel_table(pixel)
    node, share = held.at(electrons)
    below = held.below[node].astype(float) * (1 - share[:, None]) + held.below[node + 1] * share[:, None]
    return np.diff(below, prepend=0.0, axis=1)


CODED = {"captures": "split_pixel", "companding": [(1024, 1024), (16384, 2048), (600_000, 4000)]}


@pytest.mark.parametrize("hdr", [{"captures": "split_pixel"}, {"captures": "staggered", "well_e": 10_000.0}, CODED])
def test_an_hdr_image_has_the_merged_value_s_noise(hdr: dict[str, Any]) -> None:
    """In the dark, at each handover and saturated, as 200,000 draws; readings stand for values within half a bin."""
    pixel = Pixel(**{"pitch_um": 2.8, "offset_dn": 64.0, "prnu": 0.005, "read_noise_e": 2.0} | hdr)
    light = light_of(pixel)
    full_e = [limit / one.dn_per_e for one, limit in zip(pixel.read_as, limits_dn(pixel), strict=True) if limit]
    at = [full / light[k] for full, k in zip(full_e, (0, 0) if len(light) == 2 else (0, 1), strict=True)]
    electrons = np.array([0.0, 3.3, 700.0, *(share * e for e in at for share in (0.9, 0.97, 1.0, 1.1)), 3e6])
    shares, values_dn = held_shares(pixel, electrons), pixel_table(pixel).values_dn
    mean = shares @ values_dn
    variance = shares @ values_dn**2 - mean**2
    n = 200_000
    expected = np.repeat((electrons * light[:, None])[:, None], n, axis=1)
    drawn = merged_draws(expected, light.reshape(-1, 1, 1), pixel, np.random.default_rng(3))
    noise_dn = drawn.std(axis=0)
    noise_dn[-1] = 0.01 * mean[-1]  # saturated: that of the full well's photons, which the bins go by
    assert (np.abs(drawn.mean(axis=0) - mean) < (5 / np.sqrt(n) + 1 / 16) * noise_dn).all()
    np.testing.assert_allclose(variance, drawn.var(axis=0), rtol=0.05, atol=1e-3)


def test_drawn_images_are_as_noisy_as_the_product_draws_them() -> None:
    requested, setup = vision(), head_setup()
    camera = HeadCamera(setup, NO_FILTERS, requested)
    lamps = split_lamps(setup.lights, requested, (1, 0))[TEST]
    one = draw_scenes(requested, lamps, SHUFFLED, 1, (5,))
    many = one.subset(np.zeros(2000, dtype=np.intp))
    many = replace(many, key=np.arange(2000))
    drawn = camera.images(many).reshape(2000, -1)
    again = draws_dn(np.repeat(camera.expected(one), 2000, axis=0), camera.pixel, np.random.default_rng(1))
    apart = (drawn.mean(axis=0) - again.mean(axis=0)) / np.sqrt((drawn.var(axis=0) + again.var(axis=0)) / 2000)
    assert np.abs(apart).max() < 5
    assert (drawn.var(axis=0) / again.var(axis=0)).mean() == pytest.approx(1.0, abs=0.01)
    np.testing.assert_array_equal(camera.images(many.subset(np.arange(3, 5))).reshape(2, -1), drawn[3:5])


def test_demosaicking_keeps_linear_images_and_measured_pixels() -> None:
    """Bilinear for a Bayer tile: exact for light that changes evenly, away from the border."""
    mosaic = Mosaic.from_name("RGGB")
    rows, columns = np.mgrid[0:12, 0:12].astype(float)
    light = 3 + 2 * rows - columns
    found = demosaicked(light, mosaic)
    assert found.shape == (12, 12, 3)
    for plane in np.moveaxis(found, -1, 0):
        np.testing.assert_allclose(plane[2:-2, 2:-2], light[2:-2, 2:-2])
    single = np.zeros((12, 12))
    single[4, 5] = 1  # a green pixel: it has half of the weight where it is, a quarter beside it
    green = demosaicked(single, mosaic)[..., 1]
    np.testing.assert_allclose([green[4, 5], green[4, 4], green[5, 5]], [0.5, 0.25, 0.25])
