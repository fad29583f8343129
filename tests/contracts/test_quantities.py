"""Every registered quantity against a definition of its own, written here; one without a definition is found."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.spatial.distance import cdist
from scipy.stats import norm

from sweep.camera.accuracy import Accuracy
from sweep.camera.linear import linear_model
from sweep.camera.model import SceneModel, scene_model
from sweep.camera.scene import FixedExposure
from sweep.camera.setup import Setup
from sweep.metrics.evaluate import evaluate
from sweep.metrics.quantity import WORST_CASE, Quantity, RequestedQuantities
from sweep.metrics.registry import quantities_of
from sweep.metrics.smooth import Rows, SmoothDesign

from ..hard.scenes import FAMILY, scene, target
from ..margin import squared_dprime
from ..metrics.brightness_scan import smallest

X = np.array([[600.0, 8.0, 640.0, 9.0, 0.8], [585.0, 12.0, 655.0, 7.0, 1.0], [612.0, 6.0, 630.0, 20.0, 0.4]])
FREE = np.arange(5)
SPAN = np.array([30.0, 10.0, 30.0, 10.0, 0.5])


class Made:
    """Designs of a scene, computed."""

    def __init__(self, setup: Setup, states: tuple[str, ...] = ()) -> None:
        self.setup, self.family, self.states = setup, FAMILY, states
        self.curves = FAMILY.curves(X)
        imager = SceneModel(setup)
        self.found = evaluate(imager, self.curves, states, family=FAMILY, points=X)
        self.read, self.exposure_s = imager.read(self.curves)
        self.noisy = imager.read_with_noise(self.curves) if states else None

    def pairs(self, a: str, b: str) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
        """Of every design, the first and only case: means and variances of both types."""
        assert self.noisy is not None
        members = self.setup.members
        for mean, variance in zip(self.noisy.mean[:, 0], self.noisy.variance[:, 0], strict=True):
            yield mean[members[a]], variance[members[a]], mean[members[b]], variance[members[b]]


def readings(made: Made, quantity: Quantity) -> np.ndarray:
    """With a place for each channel, or for each pixel of the tile."""
    return made.read[..., made.setup.camera.mosaic.indices.ravel()] if quantity.per_pixel else made.read


def csd(made: Made, quantity: Quantity) -> list[float]:
    first, second = (made.setup.members[name] for name in quantity.pair or ())
    return [min(cdist(case[first], case[second]).min() for case in design) for design in readings(made, quantity)]


def best_phase(made: Made, quantity: Quantity) -> list[float]:
    first, second = (made.setup.members[name] for name in quantity.pair or ())
    return [max(cdist(case[first], case[second]).min() for case in design) for design in made.read]


def unlit(made: Made, design: int, quantity: Quantity) -> np.ndarray:
    """Response of a design to lamps of next to no light, [n_channels] or by pixel."""
    dark = {"photon_radiance": 1.0, "exposure": FixedExposure(kind="fixed", exposure_s=made.exposure_s[design])}
    setup = replace(made.setup, scene=made.setup.scene.model_copy(update=dark))
    response = linear_model(setup).smooth(made.curves[design : design + 1])[0, 0, 0]
    return response[made.setup.camera.mosaic.indices.ravel()] if quantity.per_pixel else response


def of_any_brightness(first: np.ndarray, second: np.ndarray) -> float:
    """Least distance of two points if one of both may be at any multiple, by least squares."""
    ends = []
    for a in first:
        for b in second:
            for fixed, scaled in ((a, b), (b, a)):
                factor = max(np.linalg.lstsq(scaled[:, None], fixed)[0][0], 0.0)
                ends.append(np.linalg.norm(fixed - factor * scaled))
    return min(ends)


def chromatic(made: Made, quantity: Quantity) -> list[float]:
    first, second = (made.setup.members[name] for name in quantity.pair or ())
    lamps = [design - unlit(made, at, quantity) for at, design in enumerate(readings(made, quantity))]
    return [min(of_any_brightness(case[first], case[second]) for case in design) for design in lamps]


def chromatic_in_noise(made: Made, quantity: Quantity) -> list[float]:
    """The least d' of a reading and one of a real lamp of any brightness, by a scan."""
    first, second = (made.setup.members[name] for name in quantity.pair or ())
    model = scene_model(made.setup.over_brightness)
    cases = [
        [case for lamps in model.lamps(made.curves[at : at + 1]) for case in lamps.of_cases()]
        for at in range(len(made.curves))
    ]
    return [smallest(of_design, first, second, noise=True) for of_design in cases]


def chromatic_error(made: Made, quantity: Quantity) -> list[float]:
    """Of Gaussians at that distance, and no less than of equal brightness."""
    return list(np.maximum(norm.sf(np.array(chromatic_in_noise(made, quantity)) / 2), gaussian_error(made, quantity)))


def sensitivity(made: Made, _: Quantity) -> list[float]:
    base = made.setup.camera.qe[made.setup.camera.modified[0]]
    return [trapezoid(curve[0]) / trapezoid(base) for curve in made.curves]


def cfa_sensitivity(made: Made, _: Quantity) -> list[float]:
    tile = made.setup.camera.mosaic.indices.ravel()
    found = []
    for curve in made.curves:
        qe = made.setup.camera.qe.copy()
        qe[made.setup.camera.modified[0]] = curve[0]
        found.append(np.mean([trapezoid(qe[channel]) for channel in tile]) / trapezoid(made.setup.camera.clear_qe))
    return found


def slope(made: Made, _: Quantity) -> list[float]:
    step = made.setup.camera.grid.step_nm
    return [max(abs(b - a) / step for a, b in pairwise(curve[0])) for curve in made.curves]


def least(made: Made, _: Quantity) -> list[float]:
    base = made.setup.camera.qe[made.setup.camera.modified[0]]
    return [float((curve[0][base > 0] / base[base > 0]).min()) for curve in made.curves]


def exposure(made: Made, _: Quantity) -> list[float]:
    return list(made.exposure_s)


def narrowest_edge(_: Made, __: Quantity) -> list[float]:
    return [min(x[1], x[3]) for x in X]


def narrowest_band(_: Made, __: Quantity) -> list[float]:
    return [x[2] - x[0] for x in X]


def detectability(made: Made, quantity: Quantity) -> list[float]:
    found = []
    for m, v, n, w in made.pairs(*(quantity.pair or ("", ""))):
        found.append(np.sqrt(squared_dprime(m[:, None] - n, v[:, None], w).min()))
    return found


def gaussian_error(made: Made, quantity: Quantity) -> list[float]:
    """The best plane between two Gaussians at which both err equally often."""
    return list(norm.sf(np.array(detectability(made, quantity)) / 2))


def each_error(made: Made, metric: str) -> np.ndarray:
    return np.array([made.found[q.name] for q in QUANTITIES.values() if q.metric == metric])


def largest_error(made: Made, _: Quantity) -> list[float]:
    return list(each_error(made, "error").max(axis=0))


DEFINITIONS: dict[str, tuple[Callable[[Made, Quantity], list[float]], float]] = {
    "csd": (csd, 1e-12),
    "best_phase_csd": (best_phase, 1e-12),
    "chromatic_csd": (chromatic, 1e-9),
    "pixel_csd": (csd, 1e-12),
    "chromatic_pixel_csd": (chromatic, 1e-9),
    "chromatic_dprime": (chromatic_in_noise, 1e-5),
    "chromatic_error": (chromatic_error, 0.1),  # those of equal brightness: exact sums over digital numbers
    "sensitivity": (sensitivity, 1e-12),
    "cfa_sensitivity": (cfa_sensitivity, 1e-12),
    "slope_per_nm": (slope, 1e-12),
    "min_transmission": (least, 1e-12),
    "exposure_s": (exposure, 1e-12),
    "edge_width_nm": (narrowest_edge, 1e-12),
    "band_width_nm": (narrowest_band, 1e-12),
    "dprime": (detectability, 1e-9),
    "error": (gaussian_error, 0.1),  # exact sums over digital numbers: `test_confusion`
    "state_error": (largest_error, 1e-12),
}
"""Metric -> what it is, written from its definition; and the relative difference that is allowed."""
DIM = {"noise": True, "exposure": {"kind": "white_patch", "level": 0.3}}
DIM_PIXEL = {"read_noise_e": 12, "offset_dn": 200, "prnu": 0.02}
NOISY = {"noise": True, "photon_radiance": 2e14, "exposure": {"kind": "fixed", "exposure_s": 2e-3}}
MADE = {
    "lattice": Made(
        replace(
            scene("lattice", "RYNCy", {"target": target(100, 60, phase_px="any"), "optics": {"f_number": 4.0}}).setup,
            accuracy=Accuracy(phases_per_px=4, finest_phase_px=0),
        )
    ),
    "noise": Made(scene("noise", "RYNCy", NOISY).setup, ("yellow", "red")),
    "dithered": Made(scene("dithered", "RYNCy", DIM, DIM_PIXEL).setup, ("yellow", "red")),
}
ASKED = RequestedQuantities(MADE["noise"].setup.lights.classes, ("yellow", "red"), any_place=True)
QUANTITIES = quantities_of(ASKED)
NAMES = [name for name in QUANTITIES if "green" not in name and "orange" not in name]


def test_every_quantity_has_a_definition() -> None:
    assert {quantity.metric for quantity in QUANTITIES.values()} <= DEFINITIONS.keys()


@pytest.mark.parametrize("name", NAMES)
def test_a_quantity_equals_its_definition(name: str) -> None:
    quantity = QUANTITIES[name]
    definition, allowed = DEFINITIONS[quantity.metric]
    seen = [made for made in MADE.values() if name in made.found]
    assert seen, "no scene has it"
    for made in seen:
        np.testing.assert_allclose(made.found[name], definition(made, quantity), rtol=allowed)


OF_NOISE = [name for name in NAMES if QUANTITIES[name].states and QUANTITIES[name].goal]
DITHERED = Made(
    scene("dithered", "RYNCy", {"noise": True}, {"read_noise_e": 12, "offset_dn": 200, "prnu": 0.02}).setup,
    ("yellow", "red"),
)
"""Its noise hides the steps of rounding, and no signal comes near an end: the closed form of the noise is exact."""


@pytest.mark.parametrize("name", [name for name in NAMES if QUANTITIES[name].smooth is not None])
def test_smooth_rows_are_the_quantity_with_its_derivative(name: str) -> None:
    quantity, made = QUANTITIES[name], DITHERED if name in OF_NOISE else MADE["lattice"]
    linear = linear_model(made.setup)

    def rows(x: np.ndarray) -> Rows:
        assert quantity.smooth is not None
        return quantity.smooth(SmoothDesign(linear, FAMILY, x, FREE, SPAN))

    values = [quantity.value(rows(x)) for x in X]
    if name not in OF_NOISE:
        found = evaluate(SceneModel(linear.setup), made.curves, family=FAMILY, points=X)
        np.testing.assert_allclose(values, found[name], rtol=1e-12)
    elif not name.startswith("state"):
        # Of the contrast to noise the search takes the least of all pairs, here that of the nearest one.
        np.testing.assert_allclose(values, DEFINITIONS[quantity.metric][0](made, quantity), rtol=1e-6)
    for x in X:
        for at, span in enumerate(SPAN):
            step = np.eye(5)[at] * span * 1e-5
            slope_ = (rows(x + step).values - rows(x - step).values) / 2e-5
            np.testing.assert_allclose(rows(x).by_u[:, at], slope_, rtol=1e-5, atol=1e-5 * np.abs(slope_).max() + 1e-9)


@pytest.mark.parametrize("name", [name for name in NAMES if QUANTITIES[name].linear is not None])
def test_linear_rows_are_the_quantity(name: str) -> None:
    quantity, made = QUANTITIES[name], MADE["lattice"]
    assert quantity.linear is not None
    linear = quantity.linear(made.setup)
    for curve, value in zip(made.curves, made.found[name], strict=True):
        rows = (linear.rows @ curve[0] + linear.constant) / linear.scale
        assert (rows.max() if quantity.direction == "less" else rows.min()) == pytest.approx(value, rel=1e-12)


def test_searchable_quantities_have_a_worst_case() -> None:
    shifted = quantities_of(replace(ASKED, edge_shift=True))
    goals = {name for name, quantity in QUANTITIES.items() if quantity.goal}
    worst = {quantity.of for quantity in shifted.values() if quantity.extreme == WORST_CASE}
    assert worst == {name for name in goals if not QUANTITIES[name].nominal}
    assert all(QUANTITIES[name].smooth is not None for name in goals)
    assert all((QUANTITIES[name].scale == "log10") == (QUANTITIES[name].direction == "less") for name in goals)
