"""Any sampling phase: lattice and refinement against all phases of a fine lattice; phases that see the same."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest

from sweep.camera.accuracy import STANDARD
from sweep.camera.axis import Axis, Search
from sweep.camera.model import SceneModel
from sweep.camera.phases import (
    axis_of,
    different_phases,
    lattice_px,
    read_at,
    scene_phases,
)
from sweep.camera.setup import READOUT, Setup
from sweep.metrics.evaluate import evaluate
from sweep.metrics.quantity import BEST_PHASE
from sweep.metrics.separation import csd_name, separations

from ..hard.scenes import DARK, F2, FAR, HARD, DesignScene, scene, target
from ..hard.scenes_alone import ALONE

STEPS_PER_PX = 32
_MOST_PX = 7.0
"""Larger lights of the hard scenes take too long at every phase."""


def any_phase(name: str, cfa: str, how: str, readout: str, across_px: float, f_number: float) -> DesignScene:
    """A small light anywhere; the linear readout without any effect of the readout, the noisy one with all."""
    light = target(0.2 / 2 / math.tan(math.radians(across_px * 30 / 3840) / 2), 30, phase_px="any", readout=readout)
    given: dict[str, object] = {"target": light, "optics": {"f_number": f_number}, "noise": how == "noisy"}
    if how == "saturated":
        given |= {"intensity_cd": 200, "exposure": {"kind": "fixed", "exposure_s": 2e-2 * (f_number / 2) ** 2}}
    return scene(name, cfa, given, DARK | {"crosstalk": 0.02} if how == "noisy" else None)


def _scenes() -> list[tuple[DesignScene, str]]:
    """Hard scenes of small lights, and some of each readout and tile."""
    found = []
    for made in HARD + ALONE:
        light = made.setup.scene.target
        if made.setup.all_phases and light is not None and light.object_resolution_px < _MOST_PX:
            found.append((made, "quantized" if made.setup.scene.noise is None else "noisy"))
    sizes, numbers = cycle((0.7, 1.0, 1.5, 2.2, 3.0, 4.0)), cycle((1.4, 2.0, 4.0))
    tiles = cycle([("RGGB", "mean"), ("RCCC", "center"), ("RYNCy", "mean"), ("3x3", "center"), ("1x3", "mean")])
    for how in ("linear", "quantized", "saturated", "noisy") * 3:
        (cfa, readout), size, f_number = next(tiles), next(sizes), next(numbers)
        found.append((any_phase(f"{cfa}, {readout}, {how}, {size} px", cfa, how, readout, size, f_number), how))
    return found


SCENES = _scenes()


def setup_of(made: DesignScene, how: str) -> Setup:
    left_out = READOUT if how == "linear" else frozenset()
    return replace(made.setup, left_out=left_out, accuracy=STANDARD)


def brute_force(made: DesignScene, how: str) -> dict[str, tuple[float, float]]:
    """Smallest and largest over a fine lattice of the smallest CSD over the moments."""
    setup = setup_of(made, how)
    light = setup.scene.target
    phases = read_at(light, lattice_px(setup.camera.mosaic, STEPS_PER_PX))
    if light.readout == "mean":
        phases = different_phases(setup, phases)[0]
    model = SceneModel(setup)
    response = model.at([*model.views(phases)]).read(made.curves)[0][0]
    ends = {}
    for pair, distances in separations(response, setup.members).items():
        each = distances.reshape(len(phases), -1).min(axis=1)
        ends[csd_name(pair)] = (float(each.min()), float(each.max()))
    return ends


def allowed_dn(made: DesignScene, how: str) -> float:
    """Whole numbers without noise step between phases."""
    return 0.05 if how in ("linear", "noisy") else math.sqrt(len(made.setup.camera.mosaic.channels))


def missed_dn(made: DesignScene, how: str) -> tuple[float, float]:
    """By how much the smallest CSDs are above, and the largest ones below, those of all phases, at most."""
    found = evaluate(SceneModel(setup_of(made, how)), made.curves)
    above = below = -math.inf
    for name, (smallest, largest) in brute_force(made, how).items():
        above = max(above, float(found[name][0]) - smallest)
        below = max(below, largest - float(found[BEST_PHASE + name][0]))
    return above, below


@pytest.mark.parametrize(("made", "how"), SCENES, ids=[made.name for made, _ in SCENES])
def test_no_phase_of_a_fine_lattice_is_worse_or_better_than_the_refined_ones(made: DesignScene, how: str) -> None:
    above, below = missed_dn(made, how)
    assert above <= allowed_dn(made, how)
    assert below <= allowed_dn(made, how)


MIRRORED = {"RGGB": 15, "RYNCy": 25, "1x3": 36, "3x3": 78}
"""Lattice phases that see different things when each channel's mean is read."""


@pytest.mark.parametrize("readout", ["mean", "center"])
@pytest.mark.parametrize("name", list(MIRRORED))
def test_mirrored_phases_have_equal_readouts(name: str, readout: str) -> None:
    given = {"target": FAR | {"phase_px": "any", "readout": readout}, "optics": F2, "noise": True}
    made = scene("mirrored", name, given, DARK | {"crosstalk": 0.05})
    every = scene_phases(made.setup)
    few, which = different_phases(made.setup, every)
    assert len(few) == (MIRRORED[name] if readout == "mean" else len(every))
    model = SceneModel(made.setup)
    assert model.n_cases == len(few)
    own, whole = (model.at([*model.views(phases)]).read_with_noise(made.curves) for phases in (few, every))
    np.testing.assert_allclose(own.mean[:, which], whole.mean, rtol=0, atol=1e-9)
    np.testing.assert_allclose(own.variance[:, which], whole.variance, rtol=1e-9)


def test_halfway_between_pixels_a_center_is_read_at_each_of_them() -> None:
    light = scene("light", "RGGB", {"target": FAR | {"phase_px": "any", "readout": "center"}}).setup.scene.target
    read = read_at(light, np.array([[0.25, 0.75], [0.5, 1.0], [1.5, 0.5]]))
    found = sorted(tuple(center) + tuple(pixel) for center, pixel in zip(read.center_px, read.nearest_px, strict=True))
    at_half = [(0.5, 1.0, 0, 1), (0.5, 1.0, 1, 1)]
    assert found == [(0.25, 0.75, 0, 1), *at_half, *((1.5, 0.5, x, y) for x in (1, 2) for y in (0, 1))]


def test_named_and_missing_lights_have_one_phase() -> None:
    named = scene("named", "RGGB", {"target": FAR | {"phase_px": [1e6 + 0.5, -1.75]}}).setup
    np.testing.assert_array_equal(scene_phases(named).center_px, [[0.5, 0.25]])
    np.testing.assert_array_equal(scene_phases(named).nearest_px, [[0, 0]])
    assert len(scene_phases(scene("patch", "RGGB", {}).setup)) == 1


def refined(axis: Axis, value: Callable[[np.ndarray], np.ndarray]) -> float:
    """The smallest value that a search finds."""
    return float(Search(axis, lambda places, _: value(places)[None], value(axis.places)[None]).run()[0][0, 0])


@pytest.mark.parametrize("finest_phase_px", [1 / 8, 1 / 64])
def test_finer_steps_find_no_worse_an_extreme_of_a_smooth_function(finest_phase_px: float) -> None:
    """A function with one minimum over the tile: within the curvature times the square of a step."""
    made = scene("any", "RGGB", {"target": FAR | {"phase_px": "any", "readout": "center"}})
    setup = replace(made.setup, accuracy=STANDARD.model_copy(update={"finest_phase_px": finest_phase_px}))

    def value(centers_px: np.ndarray) -> np.ndarray:
        return 1000 * ((np.mod(centers_px - [0.83, 1.37] + 1, 2) - 1) ** 2).sum(axis=1)[None]

    assert 0 <= refined(axis_of(setup, finer=True), value) <= 1000 * finest_phase_px**2 / 2 * (1 + 1e-9)


def test_a_kink_is_found_as_exactly_as_a_smooth_extreme() -> None:
    """A function that rises by 3000 DN a pixel on all sides of its minimum."""
    made = scene("any", "quad", {"target": FAR | {"phase_px": "any", "readout": "center"}, "noise": True})
    setup = replace(made.setup, accuracy=STANDARD)

    def value(centers_px: np.ndarray) -> np.ndarray:
        return 3000 * np.abs(np.mod(centers_px - [0.8337, 1.3713] + 2, 4) - 2).max(axis=1)[None]

    assert refined(axis_of(setup, finer=True), value) < 0.2
