"""Tiles of a study: how many there are (Burnside), the spaces that they become, and faults."""

from __future__ import annotations

from math import comb
from pathlib import Path

import numpy as np
import pytest

from sweep.camera.mosaic import Mosaic
from sweep.features.tiles.written import distinct_tiles, written

from ...build import load, one_line

SIX = ("R", "G", "B", "C", "Y", "Cy")
HEAD = "study: t\nsensor: ar0820\nlights: tl16\n"
BOX = "boxes: {stopband: {cfa: tiles, to: G, box: {left_width_nm: [5, 55], right_width_nm: [5, 55]}}}\n"


def test_tiles_are_as_many_as_burnside_says() -> None:
    """Fixed by a shift along rows, columns or both: n^2 each."""
    for n in (3, 6, 7):
        assert len(distinct_tiles([f"X{i}" for i in range(n)])) == (n**4 + 3 * n**2) // 4


def test_on_a_patch_only_the_counts_make_a_tile(tmp_path: Path) -> None:
    study = load(
        tmp_path, f"{HEAD}cfas: {{RGGB: , tiles: 2x2, of: [{', '.join(SIX)}], modified: 1}}\n{BOX}search: {{}}\n"
    )
    assert study.search is not None
    assert len(study.search.tiles) == comb(8, 3) * 6 == 336
    assert len(study.mosaics) == 1 + comb(8, 3)
    for space in study.search.tiles:
        assert space.filter is not None
        (base,) = space.filter.bases.values()
        low, high = (np.array([end(axis) for axis in space.axes], dtype=float) for end in (min, max))
        assert (space.filter.family.upper(low, high)[0] <= study.sensor.qe[base] + 1e-12).all()


def test_for_lamps_of_some_pixels_the_places_make_a_tile() -> None:
    cfas = {"cfas": {"tiles": "2x2", "of": list(SIX)}}
    assert len(written(cfas)["cfas"]) == comb(9, 4) == 126
    for near in (
        {"scenarios": {"s": {"target": {"distance_m": 50}}}},
        {"pixel": {"crosstalk": 0.1}},
        {"scenarios": {"s": {"each": {"pixel.crosstalk": [0, 0.1]}}}},
    ):
        assert len(written(cfas | near)["cfas"]) == 351


def test_a_list_of_patterns_has_each_of_its_pixels_modified(tmp_path: Path) -> None:
    study = load(tmp_path, f"{HEAD}cfas: {{tiles: [RYYCy, QuadRGGB], modified: 1}}\n{BOX}search: {{}}\n")
    assert study.search is not None
    assert [space.name for space in study.search.tiles] == [
        "stopband NYYCy(R)",
        "stopband RNYCy(Y)",
        "stopband RYYN(Cy)",
        "stopband QuadRGGB with R modified(R)",
        "stopband QuadRGGB with G modified(G)",
        "stopband QuadRGGB with B modified(B)",
    ]


@pytest.mark.parametrize(
    ("name", "counts"), [("QuadRGGB", (4, 8, 4)), ("RGBW4x4", (8, 4, 2, 2)), ("RGBIR", (2, 8, 2, 4))]
)
def test_tiles_of_sixteen_pixels_have_names(name: str, counts: tuple[int, ...]) -> None:
    mosaic = Mosaic.from_name(name)
    assert (mosaic.indices.shape, tuple(mosaic.counts)) == ((4, 4), counts)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("cfas: {tiles: 3x3, of: [R]}", "cfas.tiles: no such tiles (got '3x3')"),
        ("cfas: {tiles: 2x2, of: [R, N], modified: 1}", "cfas.of: the name of the modified channel"),
        ("cfas: {tiles: 2x2, of: [R, G], modified: 2}", "cfas.modified: pixels of each tile"),
        ("cfas: {tiles: 2x2, of: [R, G], modified: 1}", "cfas.modified: no box says which filter"),
        (f"cfas: {{tiles: 2x2, of: [R, G]}}\n{BOX}", "boxes.stopband.cfa: of tiles with a modified pixel"),
        (f"cfas: {{tiles: 2x2, of: [R], modified: 1}}\n{BOX.replace('to: G', 'to: G, base: Y')}", "boxes.stopband.base: each pixel"),
        (f"cfas: {{tiles: 2x2, of: [R, G], modified: 1}}\n{BOX}search: {{algorithm: COBYLA}}", "search.algorithm: of a search over tiles"),
    ],
)  # fmt: skip
def test_wrong_tiles_are_one_line(tmp_path: Path, text: str, said: str) -> None:
    with one_line(said):
        load(tmp_path, f"{HEAD}{text}\n")
