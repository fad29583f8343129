"""Any place of a light: against a search of the continuum through the scene at one named place."""

from __future__ import annotations

import resource
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from sweep.camera import places
from sweep.camera.between import Between, Deviation, of_channels
from sweep.camera.compiled_distances import CellDistances, distances
from sweep.camera.effects import phase
from sweep.camera.forget import forget_scenes
from sweep.camera.imager import Imager
from sweep.camera.kernel import kept_kernel, make_kernel
from sweep.camera.methods import REFERENCE, Methods
from sweep.camera.mosaic import Mosaic
from sweep.camera.place_cells import kept_cells
from sweep.camera.place_kernels import PlaceKernels
from sweep.camera.plan.plan import Plan
from sweep.camera.plan.planner import Planner
from sweep.camera.view import View
from sweep.metrics.evaluate import evaluate
from sweep.metrics.quantity import BEST_PLACE
from sweep.report.plans import plan_lines

from ..hard.random_scenes import random_scene
from ..hard.scenes import DARK, F2, FAR, NEAR, TILES, Scene, scene, target
from ..rounding import assert_within_rounding, brightest_dn

CSDS = ("csd_yellow_red", "csd_green_yellow")
LATTICE = replace(REFERENCE, phase="half pixel")


def at_place(made: Scene, x: float, y: float, methods: Methods = REFERENCE) -> dict[str, float]:
    """CellDistances with the light at one named place."""
    given = made.view.scenario
    assert given.target is not None
    there = given.model_copy(update={"target": given.target.model_copy(update={"phase_px": (x, y)})})
    columns = evaluate(Imager(replace(made.view, scenario=there, methods=methods)), made.curves)
    return {name: float(values[0]) for name, values in columns.items() if name.startswith("csd_")}


@dataclass(frozen=True)
class Planned:
    """What the lines of plans ask of a study."""

    plans: dict[str, Plan]


def searched(
    made: Scene, names: tuple[str, ...], per_pixel: int, methods: Methods = REFERENCE
) -> Mapping[str, tuple[float, float]]:
    """Smallest and largest distance over the tile: a grid that shares no place with a quarter pixel's, and a descent
    without derivatives from its best places."""
    rows, columns = made.view.mosaic.indices.shape
    x, y = np.meshgrid(
        (np.arange(columns * per_pixel) + 0.37) / per_pixel, (np.arange(rows * per_pixel) + 0.37) / per_pixel
    )
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    values = [at_place(made, *place, methods) for place in places]
    found = {}
    for name in names:
        ends = []
        for sign in (1.0, -1.0):
            signed = np.array([sign * value[name] for value in values])
            best = float(signed.min())
            for start in places[np.argsort(signed)[:2]]:
                step = 0.4 / per_pixel
                simplex = start + step * np.array([[0, 0], [1, 0], [0, 1]])
                ended = minimize(
                    lambda p, sign=sign, name=name: sign * at_place(made, p[0], p[1], methods)[name],
                    start,
                    method="Nelder-Mead",
                    options={"initial_simplex": simplex, "maxfev": 40, "xatol": 1e-4, "fatol": 1e-5},
                )
                best = min(best, float(ended.fun))
            ends.append(sign * best)
        found[name] = (ends[0], ends[1])
    return found


def planned(made: Scene, tolerance_dn: float) -> tuple[Plan, dict[str, float]]:
    plan = Planner([made.box]).plan(made.name, tolerance_dn)
    columns = evaluate(Imager(replace(made.view, methods=plan.methods)), made.curves)
    return plan, {name: float(values[0]) for name, values in columns.items()}


def broken(made: Scene, tolerance_dn: float, per_pixel: int, names: tuple[str, ...] = CSDS) -> list[Any]:
    """What is further from the continuum than promised."""
    plan, row = planned(made, tolerance_dn)
    found = searched(made, names, per_pixel)
    wrong = []
    for name, (smallest, largest) in found.items():
        for column, exact in ((name, smallest), (BEST_PLACE + name, largest)):
            if not abs(row[column] - exact) <= plan.promised_dn * (1 + 1e-9) + 2e-4:  # what a descent leaves
                wrong.append((made.name, column, row[column], exact, plan.promised_dn))
    return wrong


SMALL = {"target": target(300, 60, phase_px="any"), "optics": {"f_number": 1.4}, "noise": True}


@pytest.mark.slow
def test_the_worst_place_between_the_quarters_of_a_pixel() -> None:
    made = scene("small", "RGGB", SMALL, DARK)
    plan, row = planned(made, 0.1)
    assert plan.kept
    assert not broken(made, 0.1, 8)
    lattice = evaluate(Imager(replace(made.view, methods=replace(REFERENCE, phase="quarter pixel"))), made.curves)
    assert row["csd_green_yellow"] < lattice["csd_green_yellow"][0] - 1  # what a lattice misses


@pytest.mark.slow
@pytest.mark.parametrize("name", ["RYNCy", "1x3", "center", "out of focus", "large pixels apart"])
def test_any_place_is_the_continuum(name: str) -> None:
    made = {
        "RYNCy": scene("RYNCy", "RYNCy", SMALL | {"optics": F2}, DARK | {"crosstalk": 0.05}),
        "1x3": scene("1x3", "1x3", SMALL | {"optics": F2}, DARK),
        "center": scene("center", "RYNCy", SMALL | {"target": FAR | {"phase_px": "any", "readout": "center"}}, DARK),
        "out of focus": scene("focus", "RGGB", SMALL | {"optics": F2 | {"focus_m": 3.0}}, DARK),
        "large pixels apart": scene("apart", "RGGB", SMALL | {"optics": F2}, DARK | {"fill_factor": 0.3}),
    }[name]
    assert not broken(made, 0.5, 6)


def any_place(seed: int) -> Scene:
    """A random scene with the light at any place and a readout under noise."""
    tried = seed
    while True:
        made = random_scene(tried)
        given = made.view.scenario
        if given.target is not None and made.view.mosaic.indices.size <= 4:
            anywhere = given.target.model_copy(update={"phase_px": "any"})
            # At one place of the sensor: the best place is over those of a field, too, which the oracle does not look at.
            view = replace(made.view, scenario=given.model_copy(update={"target": anywhere, "field": None}))
            return Scene(f"any {tried}", view, made.curves[0][:1], replace(made.box, view=view))
        tried += 1000


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_random_scenes_keep_their_promise_over_the_continuum(seed: int) -> None:
    assert not broken(any_place(seed), float(10 ** np.random.default_rng(seed).uniform(-1, 1.5)), 4, CSDS[:1])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4, 34))
def test_thirty_random_scenes_keep_their_promise_over_the_continuum(seed: int) -> None:
    assert not broken(any_place(seed), float(10 ** np.random.default_rng(seed).uniform(-1, 1.5)), 6)


def test_a_sharp_image_at_any_place() -> None:
    made = scene("sharp", "RGGB", SMALL | {"noise": False})
    methods = replace(REFERENCE, blur="skip", quantization="skip", saturation="skip", phase="within 1 DN")
    row = evaluate(Imager(replace(made.view, methods=methods)), made.curves)
    smallest, largest = searched(made, CSDS[:1], 5, methods)[CSDS[0]]
    assert row[CSDS[0]][0] == pytest.approx(smallest, abs=1 + 1e-3)
    assert row[BEST_PLACE + CSDS[0]][0] == pytest.approx(largest, abs=1 + 1e-3)


def test_a_plan_that_cannot_keep_the_tolerance_says_so() -> None:
    """Whole numbers without noise jump from place to place: no more is promised than what rounding moves."""
    made = scene("rounded", "RYNCy", {"target": FAR | {"phase_px": "any"}, "optics": F2})
    plan, _ = planned(made, 0.1)
    assert not plan.kept
    # The worst place of the response before rounding, and its readout: the square root of four channels each.
    assert plan.promised_dn == pytest.approx(4, abs=0.1)
    assert "cannot be promised" in "".join(plan_lines(Planned({"rounded": plan}), explain=False))  # type: ignore[arg-type]
    # A named place is computed exactly.
    named = scene("named", "RYNCy", {"target": FAR, "optics": F2})
    assert planned(named, 0.1)[0].promised_dn == 0


def kernel_at(view: View, methods: Methods, nodes_nm: np.ndarray, cases: phase.Cases) -> np.ndarray:
    light = make_kernel(view, methods, nodes_nm, by_pixel=False, work=Counter(), cases=cases).light
    return np.broadcast_to(light, (*light.shape[:3], nodes_nm.size))


@pytest.mark.parametrize("blurred", ["every wavelength", "skip"])
def test_kernels_by_the_edges_of_pixels_are_those_by_their_areas(blurred: str) -> None:
    """Two ways to the light of a pixel: Gauss's theorem with few functions, and a rule over its area per wavelength."""
    rng, nodes = np.random.default_rng(3), np.linspace(400, 700, 61)
    for made in (
        scene("a", "RGGB", SMALL, {"crosstalk": 0.1}),
        scene("b", "3x3", SMALL | {"optics": F2 | {"focus_m": 3.0}}, {"fill_factor": 0.5}),
        scene("c", "quad", {"target": FAR | {"phase_px": "any", "readout": "center"}, "optics": F2}),
        scene("d", "1x3", {"target": NEAR | {"phase_px": "any"}, "optics": F2}, {"crosstalk": 0.02}),
        scene("e", "RGGB", SMALL | {"optics": {"f_number": 60}}, {"crosstalk": 0.1}),
        scene("f", "RGGB", {"target": NEAR | {"phase_px": "any"}, "optics": {"f_number": 400}}, {"fill_factor": 0.7}),
    ):
        places = rng.uniform(-1, 3, (5, 2))
        cases, methods = phase.Cases(places, np.floor(places + 0.5)), replace(REFERENCE, blur=blurred)
        quick = PlaceKernels(made.view, methods, nodes)
        found = quick.at(cases, Counter())[0] @ quick.shares
        # The area's rule reads a cubic spline, which is off by 1e-7 of a uniform field.
        np.testing.assert_allclose(found, kernel_at(made.view, methods, nodes, cases), rtol=0, atol=3e-8)
        assert len(quick.shares) < nodes.size
        # The same by a table of the light of all pixels, as for thousands of places.
        table = PlaceKernels(made.view, methods, nodes, many=True)
        for one, other in zip(table.at(cases, Counter()), quick.at(cases, Counter()), strict=True):
            np.testing.assert_allclose(one, other, rtol=0, atol=2e-10)
        # A light that moves by a tile sees the same.
        size = np.array(made.view.mosaic.indices.shape[::-1])
        moved = phase.Cases(cases.places_px + 3 * size, cases.home_px + 3 * size)
        np.testing.assert_allclose(quick.at(moved, Counter())[0] @ quick.shares, found, rtol=0, atol=1e-10)


def bounded(between: Between, cells: phase.Cells, sums: np.ndarray, values: np.ndarray) -> Deviation:
    """Of a CFA's own channels. `sums`: of their weights at the nodes, ndarray[n_cells, 9, n_channels]; `values`: of its
    kernel there, ndarray[n_cells, 9, ...].
    """
    low, high = between.ranges(values.reshape(-1, *values.shape[2:]), np.eye(values.shape[-1]))
    low, high = (ends.reshape(*values.shape[:2], *ends.shape[1:]) for ends in (low, high))
    known = between.bounds(cells.centers, cells.half, cells.homes, sums, low.min(axis=1), high.max(axis=1))
    n_cells, every = len(values), np.arange(values.shape[2])
    return of_channels(known, between.uneven, np.arange(n_cells), np.tile(every, (n_cells, 1)), every)


@pytest.mark.parametrize("name", ["RGGB", "RCCC", "RYNCy", "1x3", "3x3"])
def test_what_cfas_share_gives_the_kernels_of_each(name: str) -> None:
    """Kernels of mirrored, moved and turned places, put together from classes of pixels, and their bounds, against
    those that are made for the CFA at the place itself.
    """
    made = scene(name, name, SMALL | {"optics": F2}, DARK | {"crosstalk": 0.05})
    view = replace(made.view, methods=REFERENCE)
    kept, nodes = kept_cells(view), view.grid.nodes_nm
    direct, between = PlaceKernels(view, REFERENCE, nodes), Between(view, REFERENCE, nodes)
    rows, columns = view.mosaic.indices.shape
    centers = np.random.default_rng(2).integers(0, 32, (40, 2)) / 32 * [columns, rows] + 1 / 64
    cells = phase.Cells(centers, np.floor(centers + 0.5), 1 / 64)
    found = kept.of_cells(cells, Counter())
    own, sums = direct.at(cells.nodes, Counter())
    own = own @ direct.shares
    at_nodes = (found.kernels @ kept.functions)[found.nodes].reshape(own.shape)
    np.testing.assert_allclose(at_nodes, own, rtol=0, atol=1e-9)
    bound = bounded(between, cells, sums.reshape(40, 9, -1), own.reshape(40, 9, *own.shape[1:]))
    np.testing.assert_allclose(found.deviation.moves, bound.moves, rtol=1e-9)
    some = bound.kernel > 0
    assert (found.deviation.kernel[~some] == 0).all()
    assert np.median(found.deviation.kernel[some] / bound.kernel[some]) < 1.5


def test_the_cfas_and_exposures_of_a_scene_share_places() -> None:
    """Kernels at places are made once for all CFAs of 2 x 2 pixels, and whatever the exposure and the noise."""
    forget_scenes()
    counts = []
    for name, level in (("RGGB", 0.9), ("RCCC", 0.9), ("RGGB", 0.5)):
        given = SMALL | {"optics": F2, "exposure": {"kind": "white_patch", "level": level}}
        work: Counter[str] = Counter()
        cells = kept_cells(scene(name, name, given, DARK).view)
        cells.of_cells(phase.whole(Mosaic.from_name("RYNCy")), work)
        counts.append(work["places"])
    assert counts == [6, 0, 0]  # of the 25 nodes of 4 cells of a pixel, those in an eighth of it


def test_a_straight_extreme_is_that_of_a_light_at_its_place() -> None:
    """Up to what the search leaves of its tolerance for its own kernels; its figure is that of the row."""
    made = scene("straight", "RYNCy", SMALL | {"optics": F2}, DARK | {"crosstalk": 0.05})
    methods = replace(REFERENCE, quantization="skip", saturation="skip", noise="skip", phase="within 0.1 DN")
    imager = Imager(replace(made.view, methods=methods))
    row = evaluate(imager, made.curves)
    assert imager.anywhere is not None
    exposure_s = float(imager.light.exposure_s(made.curves)[0])
    found = imager.anywhere.extremes(imager.light.light_dn(made.curves[0], exposure_s))
    for (one, other), extremes in found.items():
        name = f"csd_{one}_{other}"
        assert extremes is not None
        there = at_place(made, *extremes.at_smallest[0], methods)[name]
        assert row[name][0] == extremes.smallest == pytest.approx(there, abs=places.OWN_DN)
        assert row[BEST_PLACE + name][0] == extremes.largest
    assert "electrons" not in vars(imager)  # no place is read out besides


def interpolated(at: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The biquadratic function through values at nine nodes, ndarray[n, 9, ...], at places from -1 to 1."""
    along = [np.stack([t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2], axis=1) for t in at.T]
    shares = np.einsum("nr,nc->nrc", along[1], along[0]).reshape(len(at), 9)
    return np.einsum("nj,nj...->n...", shares, values)


def sizes_of(values: np.ndarray, half: float) -> np.ndarray:
    """How far the function through the nodes may be from its mean there, its largest slope and its largest second
    derivative, at points of a fine grid and a little more: ndarray[3, n, n_channels, n_channels].
    """
    t = np.linspace(-1, 1, 41)
    grid = np.stack([v.ravel() for v in np.meshgrid(t, t)], axis=1)
    there = np.stack([interpolated(np.tile(at, (len(values), 1)), values) for at in grid], axis=1)
    there = there.reshape(len(values), t.size, t.size, *values.shape[2:])
    off = np.abs(there - values.mean(axis=1)[:, None, None]).max(axis=(1, 2))
    slopes, bends = (
        np.maximum(*(np.abs(np.diff(there, n=n, axis=axis)).max(axis=(1, 2)) for axis in (1, 2))) / (t[1] - t[0]) ** n
        for n in (1, 2)
    )
    slopes = slopes + bends * (t[1] - t[0])
    return 1.01 * np.stack([off.max(axis=-1), slopes.max(axis=-1) / half, bends.max(axis=-1) / half**2])


def test_what_lies_between_the_nodes_is_within_its_bound() -> None:
    """The kernel at random places of cells against the biquadratic function through its values at the nodes."""
    rng = np.random.default_rng(5)
    for made in (
        scene("a", "RGGB", SMALL, {"crosstalk": 0.1}),
        scene("b", "3x3", SMALL | {"optics": F2}, {"fill_factor": 0.5}),
        scene("c", "quad", {"target": FAR | {"phase_px": "any", "readout": "center"}, "optics": F2}),
        scene("d", "RYNCy", {"target": NEAR | {"phase_px": "any"}, "optics": F2}),
    ):
        view, nodes = made.view, np.linspace(400, 700, 7)
        for blurred in ("every wavelength", "skip"):
            methods = replace(REFERENCE, blur=blurred, noise="skip", quantization="skip", saturation="skip")
            between, direct = Between(view, methods, nodes), PlaceKernels(view, methods, nodes)
            kernel = partial(kernel_at, view, methods, nodes)
            cells = phase.whole(view.mosaic)
            ratios = []
            for half in (1 / 4, 1 / 16, 1 / 64):
                some = rng.integers(len(cells.centers), size=6)
                inside = rng.uniform(-1, 1, (6, 2)) * (1 / 4 - half)
                few = phase.Cells(cells.centers[some] + inside, cells.homes[some], half)
                values = kernel(few.nodes).reshape(6, 9, *kernel(few.nodes).shape[1:])
                bound = bounded(between, few, direct.at(few.nodes, Counter())[1].reshape(6, 9, -1), values)
                most = bound.kernel[..., :1] + bound.kernel[..., 1:].max(axis=3, initial=0.0, keepdims=True)
                most = most + np.einsum("nus,snuc->nuc", bound.moves, sizes_of(values, half))[..., None]
                for _ in range(4):
                    at = rng.uniform(-1, 1, (6, 2))
                    there = kernel(phase.Cases(few.centers + half * at, few.homes))
                    off = np.abs(there - interpolated(at, values))
                    assert (off <= most + 1e-7).all()
                    if half < 1 / 4:
                        ratios += list(most[..., 0].max(axis=(1, 2)) / off.max(axis=(1, 2, 3)))
            assert np.median(ratios) < 60


@pytest.mark.parametrize("n_pairs", [1, 3, 40])
def test_distances_in_a_cell_are_within_their_bounds(n_pairs: int) -> None:
    """Differences that are parabolas along either axis, and a little more, at places of a fine grid."""
    rng = np.random.default_rng(n_pairs)
    t = np.linspace(-1, 1, 33)
    grid = np.stack([v.ravel() for v in np.meshgrid(t, t)], axis=1)
    n_cells, n_channels, rest = 20, 3, 0.01
    middle = rng.normal(size=(n_cells, 1, n_channels, 2 * n_pairs)) * 3
    seen = middle + rng.normal(size=(n_cells, 9, n_channels, 2 * n_pairs)) * rng.choice([0.1, 1.0], (n_cells, 1, 1, 1))
    pairs = np.arange(n_pairs), n_pairs + np.arange(n_pairs)
    away = seen[..., pairs[0]] - seen[..., pairs[1]]
    found = CellDistances(np.empty((n_cells, n_pairs)), np.empty(n_cells), np.empty((n_cells, 9)))
    left = np.full((n_cells, n_channels, n_pairs), rest)
    at = np.arange(n_cells * 9).reshape(n_cells, 9)
    moves = np.zeros((n_cells, n_channels, 3))
    distances(seen.reshape(-1, n_channels, 2 * n_pairs), at, pairs, left, moves, 0.1, (np.inf, -np.inf), found)
    there = np.stack([interpolated(np.tile(place, (n_cells, 1)), away) for place in grid])  # [places, cells, ...]
    # What is left of each channel may be anything up to `rest`.
    shortest = np.sqrt((np.maximum(np.abs(there) - rest, 0) ** 2).sum(axis=2))
    longest = np.sqrt(((np.abs(there) + rest) ** 2).sum(axis=2))
    np.testing.assert_allclose(found.nodes, np.sqrt((away**2).sum(axis=2)).min(axis=2), rtol=1e-12)
    low, most = shortest.min(axis=0), longest.min(axis=2).max(axis=0)
    assert (found.low <= low + 1e-12).all()
    assert (found.nearest >= most - 1e-12).all()
    if n_pairs < 10:  # patches that are divided are told to a part of what varies in them
        varies = np.ptp(longest, axis=0)
        assert np.median((low - found.low) / varies) < 0.1
        assert np.median((found.nearest - most) / varies.max(axis=1)) < 0.1


@pytest.mark.parametrize("name", list(TILES))
def test_a_part_of_the_tile_stands_for_all(name: str) -> None:
    """A place and its image in the part that is searched have the same distances."""
    made = scene(name, name, SMALL | {"optics": F2, "noise": False})
    methods = replace(REFERENCE, quantization="skip", saturation="skip", blur="skip")
    cells = phase.whole(made.view.mosaic)
    size = np.array(made.view.mosaic.indices.shape[::-1])
    low, high = phase.domain_px(made.view.mosaic)
    assert (high - low <= size).all()
    for place in np.random.default_rng(1).uniform(0, size, (20, 2)):
        image = low + np.mod(place - low, size)
        image = np.where(image > high, 2 * high - image, image)
        if not (np.abs(cells.centers - image).max(axis=1) <= cells.half).any():  # beyond the diagonal
            image = image[::-1]
        assert (np.abs(cells.centers - image).max(axis=1) <= cells.half + 1e-12).any()
        values = [at_place(made, *at, methods) for at in (place, image)]
        assert values[0] == pytest.approx(values[1], rel=1e-9)


@pytest.mark.slow
def test_the_best_place_of_a_pulsed_light_is_the_best_of_the_worst_moments() -> None:
    pulsed = {
        "target": FAR | {"phase_px": "any"},
        "optics": F2,
        "noise": True,
        "drive": {"duty": 0.5, "frequency_hz": 100},
        "exposure": {"kind": "fixed", "exposure_s": 0.012},
        "photon_radiance": 1e17,
    }
    made = scene("pulsed", "RYNCy", pulsed, DARK)
    assert planned(made, 5.0)[0].kept
    assert not broken(made, 5.0, 3, CSDS[:1])
    # In a moment that is not the worst, more light separates more.
    straight = replace(REFERENCE, phase="quarter pixel", noise="skip", quantization="skip", saturation="skip")
    row = evaluate(Imager(replace(made.view, methods=straight)), made.curves)
    drive = made.view.scenario.drive
    assert drive is not None
    # 1.2 periods hold 0.5 of light, and of the rest 0 to 0.2.
    steady = {**pulsed, "drive": None}
    even = evaluate(Imager(replace(scene("steady", "RYNCy", steady, DARK).view, methods=straight)), made.curves)
    for name in CSDS:
        assert row[BEST_PLACE + name][0] == pytest.approx(even[BEST_PLACE + name][0] * 0.5 / 0.6, rel=1e-9)
        assert row[name][0] == pytest.approx(even[name][0] * 0.5 / 0.6, rel=1e-9)


def test_a_search_of_places_looks_at_few() -> None:
    made = scene("small", "RGGB", SMALL, DARK)
    counts = []
    for within in ("within 10 DN", "within 1 DN", "within 0.1 DN", "within 0.01 DN"):
        imager = Imager(replace(made.view, methods=replace(REFERENCE, phase=within, blur="every 10 nm")))
        evaluate(imager, made.curves)
        counts.append(imager.work["places"])
        again = imager.work["places"]
        evaluate(imager, made.curves)
        assert imager.work["places"] == again  # kernels are kept
    assert counts == sorted(counts)
    assert counts[-1] < 8000  # a lattice as fine as the finest cells has more than a hundred thousand


STUDY = """\
study: large
sensor: ar0820
lights: tl16
wavelengths: {{step_nm: 5}}
scenarios: {{road: {{target: {{distance_m: {distance}, fov_deg: 60, phase_px: any}}, noise: {noise}}}}}
cfas:
  wide: {{tile: [{tile}]}}
"""
_RUN = """\
import resource, sys
from pathlib import Path
resource.setrlimit(resource.RLIMIT_AS, ({most}, {most}))
from sweep.base.errors import SweepError
from sweep.study import load_study
from sweep.camera.imager import AllApart
from sweep.metrics.evaluate import evaluate
try:
    study = load_study(Path(sys.argv[1]))
except SweepError as error:
    sys.exit(str(error))
space = study.spaces[0]
if sys.argv[2] == "plan":
    print(study.plan("road").promised_dn)
else:
    imager = AllApart(study.view(space, "road"))
    print(len(imager.read(space.curves(space.points(0, 1), study.grid.size))[0][0]))
"""


def under_limit(tmp_path: Any, text: str, what: str) -> subprocess.CompletedProcess[str]:
    """A study in a process of its own that may use 4 GiB of addresses, half of which libraries reserve."""
    path = tmp_path / "large.yaml"
    path.write_text(text)
    program = _RUN.format(most=4 * 2**30)
    arguments = [sys.executable, "-c", program, str(path), what]
    return subprocess.run(arguments, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.slow
def test_a_tile_with_too_many_places_is_refused(tmp_path: Any) -> None:
    tile = ", ".join(["[" + ", ".join("RGGB"[(2 * (r % 2) + c % 2)] for c in range(16)) + "]" for r in range(16)])
    ended = under_limit(tmp_path, STUDY.format(distance=250, noise="true", tile=tile), "plan")
    assert ended.returncode == 1, ended.stderr
    assert "a tile of 256 pixels has too many places (CFA wide) (got '4,096'); allowed: at most 1,024" in ended.stderr


@pytest.mark.slow
def test_the_pixels_of_a_large_light_at_any_place_fit_into_memory(tmp_path: Any) -> None:
    text = STUDY.format(distance=9, noise="true", tile="[R, G], [G, B]")
    ended = under_limit(tmp_path, text, "read")
    assert ended.returncode == 0, ended.stderr
    assert int(ended.stdout) == 64
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < 3 * 2**20  # KiB


def test_cfas_of_one_tile_share_kernels_and_others_do_not() -> None:
    """What each channel gets through each filter depends on where the channels are, not on their curves."""
    asked = {"target": FAR | {"phase_px": "any"}, "optics": F2}
    views = [scene("", name, asked).view for name in ("RGGB", "RCCC", "RGGB")]
    views[2] = replace(views[2], qe=views[2].qe[::-1].copy())
    kernels = [kept_kernel(replace(view, methods=LATTICE), by_pixel=False, work=Counter()) for view in views]
    assert kernels[0] is kernels[2]
    assert kernels[0].light.shape[1:3] == (3, 3)
    assert kernels[1].light.shape[1:3] == (2, 2)
    fresh = make_kernel(views[2], LATTICE, views[2].grid.nodes_nm, by_pixel=False, work=Counter())
    np.testing.assert_array_equal(kernels[0].light, fresh.light)


def test_cells_block_by_block_give_the_same_extremes_within_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cell by cell, in blocks in which some pairs of types have none, the sums of all at once in another order."""
    made = scene("", "RGGB", {"target": FAR | {"phase_px": "any"}, "optics": F2})
    straight = dict.fromkeys(("noise", "quantization", "saturation"), "skip")
    view = replace(made.view, methods=replace(REFERENCE, phase="within 1 DN", blur="every 10 nm", **straight))
    found = []
    for at_once in (places._AT_ONCE, 1):
        monkeypatch.setattr(places, "_AT_ONCE", at_once)
        found.append(evaluate(Imager(view), made.curves))
    # A sum over the functions of which images are made, too; the sum of their absolute values is below full scale.
    magnitude_dn, parts = brightest_dn(view, made.curves), len(view.qe) * len(kept_cells(view).functions)
    for name, values in found[0].items():
        assert_within_rounding(name, found[1][name], values, view, magnitude_dn, more=parts)
