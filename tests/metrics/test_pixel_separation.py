"""Separations that count every pixel, against a tile in which each pixel is a channel of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sweep.camera.model import scene_model
from sweep.designs.space import Space
from sweep.metrics.evaluate import evaluate
from sweep.metrics.objective import Objective
from sweep.metrics.smooth import smooth_response
from sweep.search.problem import Problem, starting_points
from sweep.search.upper_bound import upper_bound_of
from sweep.study import Study

from ..build import load
from ..search.problems import best_of, csd_of, rows_at

TEXT = """\
study: pixels
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2, offset_dn: 168}
scenarios:
  rounded: {background_cd_m2: 50}
  full: {intensity_cd: 200, exposure: {kind: fixed, exposure_s: 0.004}, noise: true, optics: {f_number: 2}}
cfas:
  RGGB:
  apart: {tile: [[R, Ga], [Gb, B]], curves: {Ga: G, Gb: G}}
  quad: {tile: [[R, R, G, G], [R, R, G, G], [G, G, B, B], [G, G, B, B]]}
  searched: TILE
sweeps:
  edges:
    cfa: searched
    channel: N
    base: BASE
    to: 0.1
    grid: {left_nm: [600, 620], left_width_nm: 6, right_nm: [650, 670], right_width_nm: 6}
objective: OBJECTIVE
constraints: {sensitivity: {min: 0.9}}
search: {space: edges}
"""


TWICE, APART = "{tile: [[Y, N], [Y, Cy]]}", "{tile: [[Ya, N], [Yb, Cy]], curves: {Ya: Y, Yb: Y}}"
NAMED_TWICE = "{tile: [[R, N], [N, B]]}"


def loaded(folder: Path, tile: str, objective: str, base: str = "G") -> Study:
    return load(folder, TEXT.replace("TILE", tile).replace("OBJECTIVE", objective).replace("BASE", base))


def problem(folder: Path, *how: str) -> Problem:
    """The search of one objective in one tile, at the rounded scene."""
    study = loaded(folder, *how)
    assert study.search is not None
    return study.problem(study.search)


@pytest.mark.parametrize("scenario", ["rounded", "full"])
def test_columns_are_those_of_a_tile_whose_pixels_have_names(tmp_path: Path, scenario: str) -> None:
    study = loaded(tmp_path, NAMED_TWICE, "pixel_csd_yellow_red")
    of = {}
    for cfa in ("RGGB", "apart", "quad"):
        setup = study.setup(Space("reference", cfa, cfa), scenario)
        of[cfa] = evaluate(scene_model(setup), np.empty((1, 0, study.grid.size)))
    for pair in ("green_yellow", "yellow_red"):
        for kind in ("csd", "chromatic_csd"):
            name = f"{'chromatic_' * (kind != 'csd')}pixel_csd_{pair}"
            expected = of["apart"][f"{kind}_{pair}"]
            for cfa in of:
                np.testing.assert_allclose(of[cfa][name], expected, rtol=1e-6, err_msg=f"{cfa} {name}")
    assert of["RGGB"]["csd_yellow_red"] <= of["RGGB"]["pixel_csd_yellow_red"] * (1 + 1e-9)


@pytest.mark.parametrize("kind", ["csd", "chromatic_csd"])
def test_search_and_bound_are_those_of_a_tile_whose_pixels_have_names(tmp_path: Path, kind: str) -> None:
    pixel = f"{'chromatic_' * (kind != 'csd')}pixel_csd_yellow_red"
    by_pixel, apart = problem(tmp_path, TWICE, pixel, "Y"), problem(tmp_path, APART, f"{kind}_yellow_red", "Y")
    point = starting_points(by_pixel, 2, 1)[1]
    for mine, its in zip(rows_at(by_pixel, point), rows_at(apart, point), strict=True):
        np.testing.assert_allclose(np.sort(mine, axis=0), np.sort(its, axis=0), rtol=1e-9, atol=1e-6)
    mine, its = upper_bound_of(by_pixel), upper_bound_of(apart)
    assert mine.proven == pytest.approx(its.proven, abs=2e-3)
    assert mine.attained == pytest.approx(its.attained, abs=2e-3)


def test_no_search_exceeds_the_bound_of_two_equal_pixels(tmp_path: Path) -> None:
    by_pixel = problem(tmp_path, NAMED_TWICE, "pixel_csd_yellow_red")
    limit, best = upper_bound_of(by_pixel), best_of(by_pixel, 4, 100)
    assert limit.curve is not None
    assert best is not None
    assert best.objective <= limit.proven
    response = smooth_response(by_pixel.setup, limit.curve[None, None])[0, 0]
    members, roots = by_pixel.setup.members, np.array([1.0, np.sqrt(2.0), 1.0])
    apart = (response[members["yellow"], None] - response[members["red"]][None]) * roots
    assert limit.attained == pytest.approx(np.sqrt((apart**2).sum(axis=-1).min()), rel=1e-9)
    once = Objective(minimum={"csd_yellow_red": 1.0})
    assert (
        csd_of(by_pixel.setup, limit.curve[None, None])[0]
        <= upper_bound_of(replace(by_pixel, objective=once)).proven + 1e-3
    )
