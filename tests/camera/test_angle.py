"""Light at an angle against sums over rays that share no code with it; what no technology moves stays as it is."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sweep.camera.angular import AngularResponse, cone_of, gauss_rays
from sweep.camera.linear import linear_model
from sweep.camera.model import SceneModel
from sweep.camera.plan import plan_scene
from sweep.camera.scene import Scene
from sweep.camera.sensor_field import SensorField
from sweep.camera.setup import Setup
from sweep.designs.block import edges_of
from sweep.designs.technology import Technology
from sweep.metrics.evaluate import evaluate
from sweep.spectra.spectrum import WavelengthGrid
from sweep.study import load_study

from ..conftest import STUDIES
from ..hard.scenes import FAR, FINE, DesignScene, csd_columns, scene

SPACE = next(space for space in load_study(STUDIES / "stopband.yaml").spaces if space.kind == "sweep")
SPACE = replace(SPACE, axes=((600.0, 615.0), (6.0, 20.0), (650.0,), (8.0,), (0.7, 1.0)))

_CONES = ((1.6, 0.0), (1.6, 7.0), (1.6, 20.0), (4.0, 20.0), (0.8, 38.0), (1.0, 30.0))
"""f-numbers and chief ray angles, degrees: within the cone, at its edge, outside it."""


def bare(wavelength_nm: np.ndarray, transmission: np.ndarray, angle_rad: np.ndarray, index: float) -> np.ndarray:
    """T(l / k) by Smith's formula, linear between the wavelengths; angles along the first axis."""
    k = np.sqrt(1 - (np.sin(angle_rad) / index) ** 2)
    return np.interp(wavelength_nm / k[..., None], wavelength_nm, transmission)


def over_pupil(wave: float, knots: np.ndarray, values: np.ndarray, half: float, chief: float, index: float) -> float:
    """Mean of T at one wavelength over the pupil as the sensor sees it, an ellipse.

    Along the radius of each azimuth, with Gauss-Legendre points between the radii at which the ray meets a knot of T.
    """
    node, weight = np.polynomial.legendre.leggauss(12)
    across, along, middle = math.sin(half), math.sin(half) * math.cos(chief), math.cos(half) * math.sin(chief)
    total, n = 0.0, 2000
    met = (1 - (wave / knots[knots > wave]) ** 2) * index**2  # squared sines at which the ray meets a knot
    for azimuth in (np.arange(n) + 0.5) * math.pi / n:
        # (middle + along r cos)^2 + (across r sin)^2 = met
        c, s = along * math.cos(azimuth), across * math.sin(azimuth)
        a, b = c * c + s * s, 2 * middle * c
        inside = b * b - 4 * a * (middle**2 - met)
        root = np.sqrt(inside[inside > 0])
        radii = np.concatenate([(-b - root) / (2 * a), (-b + root) / (2 * a)])
        edges = np.unique(np.concatenate([[0.0, 1.0], radii[(radii > 0) & (radii < 1)]]))
        width = np.diff(edges)[:, None] / 2
        r = edges[:-1, None] + width * (1 + node)
        k = np.sqrt(1 - ((middle + c * r) ** 2 + (s * r) ** 2) / index**2)
        total += float((np.interp(wave / k, knots, values) * 2 * r * weight * width).sum()) / n
    return total


@pytest.mark.parametrize(("f_number", "cra_deg"), _CONES[::2])
def test_the_mean_over_a_cone_is_that_over_the_pupil(f_number: float, cra_deg: float) -> None:
    grid = WavelengthGrid(start_nm=500, stop_nm=700, step_nm=10)
    made = scene("cone", "RYNCy", {"optics": {"f_number": f_number, "cra_deg": cra_deg}}, grid=grid, index=1.7)
    channel, wave = made.setup.camera.modified[0], grid.nodes_nm
    base = made.setup.camera.base_qe[0]
    transmission = np.random.default_rng(3).uniform(size=wave.size)
    seen = AngularResponse(made.setup).curves((base * transmission)[None], [channel])[0] / base
    half = math.asin(0.5 / f_number)
    for at in (2, 11):
        exact = over_pupil(wave[at], wave, transmission, half, math.radians(cra_deg), 1.7)
        assert seen[at] == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize(("f_number", "cra_deg"), _CONES[1:4])
def test_few_rays_stand_for_the_cone(f_number: float, cra_deg: float) -> None:
    """Moments of the squared sine, which a Gauss rule has exactly, against rays spread evenly over the pupil."""
    cone = cone_of(scene("cone", "RYNCy", {"optics": {"f_number": f_number, "cra_deg": cra_deg}}).setup.scene)
    half, chief = cone.half_rad, cone.chief_rad
    radius, azimuth = np.meshgrid((np.arange(4000) + 0.5) / 4000, (np.arange(64) + 0.5) * math.pi / 32)
    p = math.cos(half) * math.sin(chief) + math.sin(half) * math.cos(chief) * radius * np.cos(azimuth)
    sine_squared = p**2 + (math.sin(half) * radius * np.sin(azimuth)) ** 2
    for count in (4, 16):
        at, weight = gauss_rays(cone, count)
        assert at.size == count
        assert weight.min() > 0
        for power in range(5):
            exact = float((sine_squared**power * radius).sum() / radius.sum())
            assert float(weight @ at**power) == pytest.approx(exact, rel=1e-6)


def moved(given: dict[str, Any], f_number: float = 1.6, cra_deg: float = 20.0) -> DesignScene:
    optics = {"optics": {"f_number": f_number, "cra_deg": cra_deg}}
    return scene("angle", "RYNCy", given | optics, {"dark_e_per_s": 50.0}, grid=FINE, index=1.8)


def with_rays(setup: Setup, count: int | None) -> Setup:
    return replace(setup, accuracy=setup.accuracy.model_copy(update={"rays": count}))


@pytest.mark.parametrize("count", [1, 4])
def test_digital_numbers_are_means_over_rays(count: int) -> None:
    """Each ray's filter put in as a design that does not move: digital numbers are the weighted sum."""
    made = moved({"target": FAR, "background_cd_m2": 200.0, "visibility_m": 900.0, "off_axis_deg": 20.0})
    setup = with_rays(made.setup, count)
    sine_squared, weights = gauss_rays(cone_of(setup.scene), count)
    base, wave = setup.camera.base_qe[0], setup.camera.grid.nodes_nm
    filters = bare(wave, made.curves[0, 0] / base, np.arcsin(np.sqrt(sine_squared)), 1.8) * base
    still = linear_model(setup.with_camera(technologies=()))
    expected = np.einsum("r,rxsc->xsc", weights, still.smooth(filters[:, None]))
    np.testing.assert_allclose(linear_model(setup).smooth(made.curves)[0], expected, rtol=1e-13, atol=1e-9)


def test_only_interference_filters_move_with_the_angle() -> None:
    made = moved({})
    pigment = made.setup.with_camera(technologies=(Technology(),) * len(made.setup.camera.mosaic.channels))
    unsaid = made.setup.with_camera(technologies=())
    for setup in (pigment, unsaid):
        (angle,) = (
            choice
            for choice in plan_scene("", [replace(made.box, setup=setup)], 1e-9, setup.accuracy).choices
            if choice.effect == "angle"
        )
        assert (angle.computed, angle.bound_dn) == (False, 0.0)
        found = SceneModel(with_rays(setup, 4)).read(made.curves)[0]
        np.testing.assert_array_equal(found, SceneModel(unsaid).read(made.curves)[0])


def test_a_plain_curve_of_interference_moves_on_the_clear_one() -> None:
    made = moved({})
    clear, wave = made.setup.camera.clear_qe, made.setup.camera.grid.nodes_nm
    camera = made.setup.camera
    moving = (camera.technologies[camera.modified[0]],) * len(camera.mosaic.channels)
    one_ray = replace(made.setup, accuracy=made.setup.accuracy.model_copy(update={"rays": 1}))
    setup = one_ray.with_camera(technologies=moving)
    channel = setup.camera.fixed[0]
    own = np.minimum(setup.camera.qe[channel], clear)
    seen = AngularResponse(setup).curves(own[None], [channel])[0]
    sine_squared, _ = gauss_rays(cone_of(setup.scene), 1)
    expected = clear * bare(wave, own / clear, np.arcsin(np.sqrt(sine_squared)), 1.8)[0]
    np.testing.assert_allclose(seen, expected, rtol=1e-12)


@pytest.mark.parametrize("noisy", [{}, {"target": FAR, "noise": True}], ids=["patch", "noisy target"])
def test_a_field_is_the_worst_of_its_places(noisy: dict[str, Any]) -> None:
    """Chief ray angle and field angle follow one image height, and the worst place counts in every column."""
    given: dict[str, Any] = noisy | {"background_cd_m2": 200.0, "off_axis_deg": 35.0}
    angles = [0.0, 8.0, 20.0]
    setup = moved(given, cra_deg=0.0).setup
    field = setup.scene.model_copy(update={"field": SensorField(cra_deg=tuple(angles))})
    block = edges_of(SPACE, 0, SPACE.size)
    curves = block.curves()
    each = []
    for height, cra_deg in zip((0.0, 0.5, 1.0), angles, strict=True):
        off_axis_deg = math.degrees(math.atan(height * math.tan(math.radians(35.0))))
        own = Scene.model_validate(
            given | {"optics": {"f_number": 1.6, "cra_deg": cra_deg}, "off_axis_deg": off_axis_deg}
        )
        each.append(evaluate(SceneModel(replace(setup, scene=own)), curves))
    model = SceneModel(replace(setup, scene=field))
    names = csd_columns(setup)
    for designs in (curves, block):
        found = evaluate(model, designs)
        for name in names:
            worst = np.min([place[name] for place in each], axis=0)
            np.testing.assert_allclose(found[name], worst, atol=1e-9)
    every = setup.scene.model_copy(update={"field": SensorField(cra_deg=tuple(angles), places="any")})
    anywhere = evaluate(SceneModel(replace(setup, scene=every)), curves[:2])[names[0]]
    assert (anywhere <= np.min([place[names[0]][:2] for place in each], axis=0) + 1e-9).all()
    assert any((np.argmin([place[name] for place in each], axis=0) == 2).any() for name in names)


def test_derivatives_at_every_place_of_a_field() -> None:
    fixed = {"exposure": {"kind": "fixed", "exposure_s": 1e-3}, "background_cd_m2": 200.0, "off_axis_deg": 35.0}
    made = moved(fixed, cra_deg=0.0)
    field = made.setup.scene.model_copy(update={"field": SensorField(cra_max_deg=20.0, places=3)})
    model = linear_model(replace(made.setup, scene=field))
    zero, own = model.smooth(np.zeros_like(made.curves))[0], model.smooth(made.curves)[0]
    assert len(own) == 3
    scale = np.abs(own).max()
    np.testing.assert_allclose(
        model.smooth_with_gradient(made.curves[0], made.curves)[1][0], own - zero, atol=1e-12 * scale
    )
