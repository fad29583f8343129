"""Any sampling phase: lattice and refinement against all phases of a fine lattice; phases that see the same."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import cycle, product

import pytest

from sweep.camera.accuracy import STANDARD
from sweep.camera.forward import ForwardModel
from sweep.camera.phases import different_phases, lattice_px, read_at
from sweep.metrics.evaluate import evaluate
from sweep.metrics.quantity import BEST_PLACE
from sweep.metrics.separation import csd_name, separations

from ..hard.scenes import DARK, HARD, DesignScene, scene, target
from ..hard.scenes_alone import ALONE

STEPS_PER_PX = 32
READOUTS = ("linear", "quantized", "saturated", "noisy")
_SIZES_PX = (0.7, 1.0, 1.5, 2.2, 3.0, 4.0)
_F_NUMBERS = (1.4, 2.0, 4.0)
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
    """34 scenes, each with its readout."""
    found = []
    for made in HARD + ALONE:
        light = made.view.scenario.target
        if made.view.all_phases and light is not None and light.object_resolution_px < _MOST_PX:
            found.append((made, "quantized" if made.view.scenario.noise is None else "noisy"))
    sizes, numbers = cycle(_SIZES_PX), cycle(_F_NUMBERS)
    every = product(READOUTS, ("RGGB", "RCCC", "RYNCy", "3x3", "1x3"), ("mean", "center"))
    for at, (how, cfa, readout) in enumerate(every):
        size, f_number = next(sizes), next(numbers)
        if at % 8 not in (3, 6, 7) and len(found) < 34:
            found.append((any_phase(f"{cfa}, {readout}, {how}, {size} px", cfa, how, readout, size, f_number), how))
    return found


SCENES = _scenes()


def view_of(made: DesignScene, how: str):  # type: ignore[no-untyped-def]
    left_out = frozenset({"noise", "quantization", "saturation"}) if how == "linear" else frozenset()
    return replace(made.view, left_out=left_out, accuracy=STANDARD)


def brute_force(made: DesignScene, how: str) -> dict[str, tuple[float, float]]:
    """Smallest and largest over a fine lattice of the smallest CSD over the moments."""
    view = view_of(made, how)
    light = view.scenario.target
    assert light is not None
    phases = read_at(light, lattice_px(view.mosaic, STEPS_PER_PX))
    if light.readout == "mean":
        phases = different_phases(view, phases)[0]
    response = ForwardModel(view, phases, once=True).read(made.curves)[0][0]
    ends = {}
    for pair, distances in separations(response, view.members).items():
        each = distances.reshape(len(phases), -1).min(axis=1)
        ends[csd_name(pair)] = (float(each.min()), float(each.max()))
    return ends


def allowed_dn(made: DesignScene, how: str) -> float:
    """Whole numbers without noise step between phases."""
    return 0.05 if how in ("linear", "noisy") else math.sqrt(len(made.view.mosaic.channels))


def missed_dn(made: DesignScene, how: str) -> tuple[float, float]:
    """By how much the smallest CSDs are above, and the largest ones below, those of all phases, at most."""
    columns = evaluate(ForwardModel(view_of(made, how)), made.curves)
    above = below = -math.inf
    for name, (smallest, largest) in brute_force(made, how).items():
        above = max(above, float(columns[name][0]) - smallest)
        below = max(below, largest - float(columns[BEST_PLACE + name][0]))
    return above, below


def test_scenes_are_of_each_tile_readout_and_kind() -> None:
    assert len(SCENES) == 34
    assert {how for _, how in SCENES} == {*READOUTS}
    assert {made.view.mosaic.name for made, _ in SCENES} >= {"RGGB", "RCCC", "RYNCy", "3x3", "1x3"}
    saturated = [made for made, how in SCENES if how == "saturated"]
    assert all(
        made.box.brightest_pixel_dn / made.view.pixel.dn_per_e > made.view.pixel.saturation_e for made in saturated
    )


@pytest.mark.slow
@pytest.mark.parametrize(("made", "how"), SCENES, ids=[made.name for made, _ in SCENES])
def test_no_phase_of_a_fine_lattice_is_worse_or_better_than_the_refined_ones(made: DesignScene, how: str) -> None:
    above, below = missed_dn(made, how)
    assert above <= allowed_dn(made, how)
    assert below <= allowed_dn(made, how)
