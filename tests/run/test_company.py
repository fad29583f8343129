"""A design's numbers are the same, within rounding, alone, in any block, beside any other design, on both routes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sweep.camera.camera import Camera
from sweep.camera.model import SceneModel
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.camera.setup import Setup
from sweep.designs.block import CurveBlock, edges_of
from sweep.designs.families.dual import Dual
from sweep.designs.products import row_products
from sweep.designs.space import Filter, Space
from sweep.metrics.evaluate import evaluate

from ..blocks import SPACE, VIEWS, setup_of
from ..cases import thinned
from ..hard.scenes import DARK, F2, FAMILY, FAR, FIXED, GRID, SENSOR, lights
from ..rounding import assert_within_rounding, brightest_dn

# Crossed edges among them, which lift N above Y, so that it sets the exposure.
AXES = ((590.0, 603.0, 690.0), (5.0, 20.0), (410.0, 640.0, 655.0), (0.0, 6.0, 30.0), (0.5, 0.8, 1.0))
MIXED = Space("sweep", "edges", "RYNCy", Filter(FAMILY, {"N": "Y"}, "G"), AXES)
MORE = {
    "noise, far": setup_of({"noise": True, "target": FAR, "optics": F2}, DARK | {"prnu": 0.01}),
    "background, pixel by pixel": setup_of(
        {"background_cd_m2": 300, "intensity_cd": 200, "exposure": FIXED, "target": FAR, "optics": F2},
        {"crosstalk": 0.1},
    ),
}
STATES = ("green", "yellow", "red")


def assert_same(found: dict[str, Any], which: Any, alone: dict[str, Any], setup: Setup, magnitude_dn: float) -> None:
    assert list(found) == list(alone)
    for name, values in alone.items():
        assert_within_rounding(name, found[name][which], values, setup, magnitude_dn)


SOME = [*((name, True) for name in (*VIEWS, *MORE) if name not in ("pulsed", "noise")), ("chart", False)]
"""Scenes, and whether blocks know their edges, of which `make test` sees some parts; the others take seconds."""


@pytest.mark.parametrize(
    ("name", "separable", "step"),
    [
        *((name, separable, 11) for name, separable in SOME),
        *(
            pytest.param(name, separable, 1, marks=pytest.mark.slow)
            for name in (*VIEWS, *MORE)
            for separable in (True, False)
        ),
    ],
)
def test_a_design_alone_is_the_one_of_its_block_within_rounding(name: str, separable: bool, step: int) -> None:
    setup = (VIEWS | MORE)[name]
    states = STATES if setup.computes("quantization") and setup.computes("noise") else ()
    imager = SceneModel(setup)
    space = MIXED if setup.scene.target is None else SPACE
    block = edges_of(space, 0, space.size)
    assert block is not None
    curves = block.curves()
    whole = evaluate(imager, block if separable else curves, states)
    magnitude_dn = brightest_dn(setup, curves)
    rng = np.random.default_rng(5)
    parts = [np.array([at]) for at in range(0, space.size, 1 if setup.scene.target is None else 5)]
    parts += [np.arange(start, start + n) for n in (2, 3, 15, 16, 17, 31) for start in rng.integers(0, 40, 2)]
    for part in parts[::step]:
        some = edges_of(space, int(part[0]), int(part[-1]) + 1) if separable else CurveBlock(curves[part])
        assert some is not None
        assert_same(whole, part, evaluate(imager, some, states), setup, magnitude_dn)


@pytest.mark.parametrize("separable", [True, False])
def test_a_bad_design_changes_no_other_beyond_rounding(separable: bool) -> None:
    imager = SceneModel(VIEWS["saturated" if separable else "chart"])  # one exposure for all; one that the design sets
    fine = edges_of(SPACE, 0, SPACE.size)
    assert fine is not None
    bad = np.array([0, 17, 30])
    others = np.delete(np.arange(SPACE.size), bad)
    if separable:
        depth = fine.depth.copy()
        depth[bad] = np.nan
        spoiled: Any = replace(fine, depth=depth)
    else:
        spoiled = fine.curves()
        spoiled[bad] = np.nan
    whole, found = (evaluate(imager, block) for block in (fine if separable else fine.curves(), spoiled))
    alone = {name: values[others] for name, values in whole.items()}
    assert_same(found, others, alone, imager.setup, brightest_dn(imager.setup, fine.curves()))
    assert np.isnan(found["csd_yellow_red"][bad]).all()


@pytest.mark.parametrize(
    "scenario", [{}, {"target": FAR, "optics": F2}, {"background_cd_m2": 300, "intensity_cd": 200, "exposure": FIXED}]
)
def test_two_modified_channels_within_rounding(scenario: dict[str, Any]) -> None:
    mosaic = Mosaic.from_rows("RAACy", [["R", "Na"], ["Nb", "Cy"]])
    qe = SENSOR.mosaic_qe(mosaic, {"Na": "Y", "Nb": "Y"})
    modified = tuple(mosaic.channels.index(name) for name in ("Na", "Nb"))
    setup = Setup(Camera(GRID, mosaic, qe, modified, SENSOR.qe["C"], Pixel()), lights(), Scene.model_validate(scenario))
    family = Dual(GRID.nodes_nm, SENSOR.qe["Y"], SENSOR.qe["C"])
    space = Space("sweep", "dual", "RAACy", Filter(family, {"Na": "Y", "Nb": "Y"}, "C"), AXES)
    curves = space.curves(space.points(0, 40), GRID.size)
    imager = SceneModel(setup)
    whole, magnitude_dn = evaluate(imager, curves), brightest_dn(setup, curves)
    for at in range(0, 40, 3):
        assert_same(whole, slice(at, at + 1), evaluate(imager, curves[at : at + 1]), setup, magnitude_dn)


@pytest.mark.parametrize(("k", "m"), thinned([(7, 3), (1, 1), (61, 51), (301, 1), (301, 51), (301, 2000), (602, 102)]))
def test_products_of_rows(k: int, m: int) -> None:
    """Every row is multiplied by the same call, so that its bits are those that it has alone."""
    rng = np.random.default_rng(k + m)
    rows, matrix = rng.random((150, k)), rng.random((k, m))
    whole = row_products(rows, matrix)
    # An error of at most k roundings of a sum of positive numbers.
    exact = rows.astype(np.longdouble) @ matrix.astype(np.longdouble)
    assert (np.abs(whole - exact) <= k * np.finfo(float).eps * exact).all()
    np.testing.assert_array_equal(row_products(np.asfortranarray(rows), matrix), whole)
    for at in range(len(rows)):
        np.testing.assert_array_equal(row_products(rows[at : at + 1], matrix)[0], whole[at])
    for n in (0, 2, 15, 16, 17, 40, 149):
        np.testing.assert_array_equal(row_products(rows[:n], matrix), whole[:n])
        np.testing.assert_array_equal(row_products(rows[1 : 1 + n : 2], matrix), whole[1 : 1 + n : 2])
