"""Figures of tasks against definitions of their own: colour-science, brute force, draws, and other code of this package."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.linalg import subspace_angles
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

from sweep.camera.linear import linear_model
from sweep.camera.setup import Setup
from sweep.features.tasks.color import (
    ChannelNoise,
    least_illuminance,
    metamerism_index,
    vora,
)
from sweep.features.tasks.colorimetry import delta_e_2000, lab
from sweep.features.tasks.spectra import SHIPPED, Conditions, StudyTasks, tasks_in
from sweep.features.tasks.task_sets import separation_task, shipped
from sweep.metrics.discrimination import detectability, error_of
from sweep.metrics.evaluate import designed_quantities
from sweep.metrics.quantity import Quantity, RequestedQuantities, asked_of
from sweep.metrics.registry import quantities_of
from sweep.metrics.smooth import SmoothDesign
from sweep.spectra.builtin.groups import spectra_of_group
from sweep.study.load import study_of_keys

from ...late import Late

colour = Late("colour")

KEYS = {
    "study": "tasks",
    "sensor": "ar0820",
    "lights": "tl16",
    "wavelengths": {"start_nm": 400.0, "stop_nm": 700.0, "step_nm": 5.0},
    "cfas": ["RYNCy", "RGGB"],
    "boxes": {"edges": {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": "G"}},
}
X = np.array([[600.0, 12.0, 645.0, 10.0, 0.8], [585.0, 15.0, 655.0, 9.0, 1.0]])
FREE, SPAN = np.arange(5), np.array([30.0, 10.0, 30.0, 10.0, 0.5])
CONDITIONS = Conditions(0.01, 2.0, 1000.0)
CAMERA = "Nikon 5100 (NPL)"


@cache
def scene() -> tuple[Setup, object]:
    """RYNCy with every task, and the family of its stopbands."""
    study = study_of_keys(KEYS, Path())
    space = study.spaces[-1]
    assert space.filter is not None
    made = (
        *(shipped(study.grid, name) for name in SHIPPED),
        separation_task(
            study.grid,
            "own",
            {"a": spectra_of_group(study.grid, "soil"), "b": spectra_of_group(study.grid, "canopy")},
            ["d65"],
        ),
    )
    return replace(study.setup(space, "chart"), features={"tasks": StudyTasks(CONDITIONS, made)}), space.filter.family


def quantities() -> dict[str, Quantity]:
    setup, _ = scene()
    found = quantities_of(RequestedQuantities(setup.lights.classes, features=asked_of(setup.features)))
    return {name: quantity for name, quantity in found.items() if quantity.metric.startswith("task_")}


@cache
def columns() -> dict[str, np.ndarray]:
    setup, family = scene()
    return designed_quantities(setup, family.curves(X))  # type: ignore[attr-defined]


def seen(photons: np.ndarray) -> Iterator[np.ndarray]:
    """Electrons behind each design's QE, written out anew: pi L T A t / (1 + 4 N^2), ndarray[n_spectra, n_channels]."""
    setup, family = scene()
    f_number = setup.scene.optics.f_number
    for curves in family.curves(X):  # type: ignore[attr-defined]
        qe = setup.camera.qe.copy()
        qe[list(setup.camera.modified)] = curves
        light = np.pi * photons / (1 + 4 * f_number**2) * (2.1e-6) ** 2 * CONDITIONS.exposure_s
        yield np.array(
            [[trapezoid(spectrum * channel, dx=setup.camera.grid.step_nm) for channel in qe] for spectrum in light]
        )


def shares() -> np.ndarray:
    """Of RYNCy: every channel has one pixel of four."""
    return np.full(4, 0.25)


SEPARATIONS = [
    (task.columns.name, at, case)
    for task in tasks_in(scene()[0]).tasks
    if task.columns.metric == "separation"
    for at, case in enumerate(task.columns.lights)
]


@pytest.mark.parametrize(("name", "at", "case"), SEPARATIONS)
def test_separations_are_those_of_the_nearest_pair(name: str, at: int, case: str) -> None:
    setup, _ = scene()
    task = tasks_in(setup).by_name[name]
    assert task.photons is not None
    kinds, end = np.asarray(task.types), f"_{case}" if case else ""
    for number, electrons in enumerate(seen(task.photons[at] * 2e18)):
        variance = (electrons + 2.0**2) / (4 * shares())
        noisy = electrons[None], variance[None]
        pairs = [
            tuple(np.flatnonzero(kinds == kind) for kind in pair) for pair in combinations(dict.fromkeys(kinds), 2)
        ]
        found = {
            "csd": min(cdist(electrons[a], electrons[b]).min() * 4095 / 10_000 for a, b in pairs),
            "dprime": min(detectability(*noisy, a, b)[0] for a, b in pairs),
            "error": max(error_of(detectability(*noisy, a, b))[0] for a, b in pairs),
        }
        for what, value in found.items():
            assert columns()[f"{name}_{what}{end}"][number] == pytest.approx(value, rel=1e-7, abs=1e-300)


def test_lab_and_ciede2000_are_those_of_colour_science() -> None:
    rng = np.random.default_rng(2)
    xyz, white = rng.uniform(0, 1, (3000, 3)), np.array([0.95, 1.0, 1.09])
    np.testing.assert_allclose(lab(xyz, white), colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(white)), atol=1e-9)
    one = rng.uniform([0, -100, -100], [100, 100, 100], (20_000, 3))
    other = one + rng.normal(0, [5, 15, 15], one.shape)
    other[:20], one[20:60, 1:], other[40:80, 1:] = one[:20], 0, 0
    np.testing.assert_allclose(delta_e_2000(one, other), colour.delta_E(one, other, method="CIE 2000"), atol=1e-9)


@cache
def camera() -> np.ndarray:
    """Responses of a named camera per photon on the study's grid, ndarray[3, n_wavelengths], peak 0.5."""
    setup, _ = scene()
    sensitivities = colour.MSDS_CAMERA_SENSITIVITIES[CAMERA]
    own = [
        np.interp(setup.camera.grid.nodes_nm, sensitivities.wavelengths, column) for column in sensitivities.values.T
    ]
    per_photon = np.stack(own) / setup.camera.grid.nodes_nm
    return per_photon / per_photon.max() / 2


def test_color_of_a_chart_is_that_of_colour_science() -> None:
    setup, _ = scene()
    chart = tasks_in(setup).by_name["color"].chart
    assert chart is not None
    shape = colour.SpectralShape(400, 700, 5)
    matching = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    patches = [sd.copy().align(shape) for sd in colour.SDS_COLOURCHECKERS["cc_ohta"].values()]
    for at, name in enumerate(("D65", "A", "LED-B3", "HP1")):
        light = colour.SDS_ILLUMINANTS[name].copy().align(shape)
        light.values = light.values * np.append(np.append(0.5, np.ones(light.values.size - 2)), 0.5)  # half bins
        integrated = {"method": "Integration", "cmfs": matching, "illuminant": light}
        xyz = np.array([colour.sd_to_XYZ(sd, **integrated) for sd in patches]) / 100
        np.testing.assert_allclose(chart.xyz[at], xyz, rtol=1e-6)
        white = colour.sd_to_XYZ(colour.sd_ones(shape), **integrated)
        np.testing.assert_allclose(chart.white[at], white / white[1], rtol=1e-6)


def test_the_vora_value_is_that_of_the_angles_between_both_spaces() -> None:
    setup, _ = scene()
    nodes = setup.camera.grid.nodes_nm
    matching = (
        colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(colour.SpectralShape(400, 700, 5)).values
    )
    for responses in (camera(), np.stack([camera()[0], camera()[1], camera()[2], camera()[0] ** 2])):
        cosines = np.cos(subspace_angles((responses * nodes).T, matching))
        told = vora((responses * nodes)[None], matching.T)[0]
        assert told == pytest.approx((cosines**2).sum() / 3, rel=1e-6)
    assert vora(matching.T[None] * 7, matching.T)[0] == pytest.approx(1, rel=1e-6)


def test_the_metamerism_index_has_the_least_mean_difference() -> None:
    """By a minimization of another kind, with the differences of colour-science; the eye's own curves have 100."""
    setup, _ = scene()
    index = tasks_in(setup).by_name["color"].metamerism_chart
    assert index is not None
    xyz, white = index.xyz[0], index.white[0]
    electrons = index.photons[0] @ camera().T * 1e-15
    target = colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(white))

    def mean(matrix: np.ndarray) -> float:
        found = colour.XYZ_to_Lab(electrons @ matrix.reshape(3, 3) * white, colour.XYZ_to_xy(white))
        return float(colour.delta_E(found, target, method="CIE 1976").mean())

    start = np.linalg.lstsq(electrons, xyz / white, rcond=None)[0].ravel()
    found = minimize(
        mean, start, method="Nelder-Mead", options={"maxfev": 20_000, "xatol": 1e-9, "fatol": 1e-10, "adaptive": True}
    )
    found = minimize(mean, found.x, method="BFGS")
    assert metamerism_index(electrons[None], xyz, white)[0] == pytest.approx(100 - 5.5 * found.fun, rel=1e-6)
    assert metamerism_index((xyz @ np.array([[0.9, 0.1, 0.0], [0.3, 1.0, 0.2], [0.0, 0.1, 0.7]]))[None], xyz, white)[
        0
    ] == pytest.approx(100, abs=1e-6)


def test_the_least_illuminance_has_its_luminance_snr() -> None:
    """Of four pixels: photons, and two electrons of read noise of each."""
    gray, noise = np.array([[0.6, 1.1, 0.4]]), ChannelNoise(np.array([0.25, 0.5, 0.25]), 2.0)
    matrix = np.random.default_rng(4).uniform(-1, 2, (1, 3, 3))
    lux = least_illuminance(matrix, gray, noise, 10.0)[0]
    variance = (gray[0] * lux + 4) / [1, 2, 1]
    row = matrix[0, :, 1]
    assert row @ gray[0] * lux / np.sqrt(row**2 @ variance) == pytest.approx(10, rel=1e-12)


def test_color_figures_are_those_of_their_chart() -> None:
    """From electrons written out anew, with the least-squares solution of stacked noise rows, and colour-science."""
    setup, _ = scene()
    chart = tasks_in(setup).by_name["color"].chart
    assert chart is not None
    for at, case in enumerate(("d65", "a", "led", "hps")):
        target = colour.XYZ_to_Lab(chart.xyz[at], colour.XYZ_to_xy(chart.white[at]))
        grays = list(seen(chart.gray[at][None] * 1000))
        for number, electrons in enumerate(seen(chart.photons[at] * 1000)):
            root = 116 / 3 * chart.xyz[at][:, 1] ** (-2 / 3)
            variance = (electrons + 4) / (4 * shares())
            rows = np.concatenate(
                [electrons * root[:, None], np.diag(np.sqrt((variance * root[:, None] ** 2).sum(axis=0)))]
            )
            right = np.concatenate([chart.xyz[at] / chart.white[at] * root[:, None], np.zeros((4, 3))])
            matrix = np.linalg.lstsq(rows, right, rcond=None)[0]
            found = colour.XYZ_to_Lab(electrons @ matrix * chart.white[at], colour.XYZ_to_xy(chart.white[at]))
            errors = colour.delta_E(found, target, method="CIE 2000")
            for what, value in (("mean", errors.mean()), ("95", np.percentile(errors, 95)), ("max", errors.max())):
                assert columns()[f"color_delta_e_{what}_{case}"][number] == pytest.approx(value, rel=1e-6)
            gray = grays[number][0]
            snr = matrix[:, 1] @ gray / np.sqrt(matrix[:, 1] ** 2 @ ((gray + 4) / (4 * shares())))
            assert columns()[f"color_snr_{case}"][number] == pytest.approx(snr, rel=1e-6)


@pytest.mark.parametrize("name", list(quantities()))
def test_a_figure_has_the_derivative_of_its_rows(name: str) -> None:
    """Central differences of the rows with two steps, extrapolated (Richardson), to 1e-6."""
    quantity, (setup, family) = quantities()[name], scene()
    imager = linear_model(setup)

    def rows(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert quantity.smooth is not None
        found = quantity.smooth(SmoothDesign(imager, family, x, FREE, SPAN))  # type: ignore[arg-type]
        return found.values, found.by_u

    x = X[0]
    values, by_u = rows(x)
    made = values.max() if quantity.direction == "less" else values.min()
    assert made == pytest.approx(columns()[name][0], rel=1e-9)
    for at, span in enumerate(SPAN):
        slopes = []
        for step in (4e-4, 8e-4):
            moved = np.eye(5)[at] * span * step
            slopes.append((rows(x + moved)[0] - rows(x - moved)[0]) / (2 * step))
        slope = (4 * slopes[0] - slopes[1]) / 3
        allowed = 1e-6 * max(np.abs(slope).max(), np.abs(values).max() * 1e-3)
        if quantity.metric in ("task_csd", "task_dprime"):
            allowed = max(allowed, 1e-9)  # under sodium light of one line all is one color, and a distance is rounding
        np.testing.assert_allclose(by_u[:, at], slope, rtol=1e-6, atol=allowed)
