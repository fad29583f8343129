"""Plans: what they leave out, and that no CSD changes by more than they say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sweep.camera.accuracy import STANDARD, Accuracy
from sweep.camera.effects import EFFECTS, Box
from sweep.camera.model import SceneModel
from sweep.camera.plan import Plan, plan_scene
from sweep.camera.setup import READOUT

from ..cases import thinned
from ..hard.random_scenes import columns as random_columns
from ..hard.random_scenes import random_scene
from ..hard.scenes import DARK, F2, FAR, HARD, NEAR, DesignScene, columns, lights, scene
from ..hard.scenes_alone import ALONE

LATTICE = Accuracy(finest_phase_px=0.0, field_positions=9)
"""The same phases and field positions, whatever is left out."""
TOLERANCES_DN = (0.01, 0.1, 1.0, 10.0, 100.0)
_ARITHMETIC_DN = 1e-9


def inactive_effects(box: Box) -> set[str]:
    return {name for name, effect in EFFECTS.items() if effect.inactive(box) is not None}


def planned(made: DesignScene, tolerance_dn: float, *, for_noise: bool = False) -> Plan:
    return plan_scene(made.name, [made.box], tolerance_dn, LATTICE, for_noise=for_noise)


@pytest.mark.parametrize("tolerance_dn", TOLERANCES_DN)
@pytest.mark.parametrize("made", HARD + ALONE, ids=lambda made: made.name)
def test_a_plan_leaves_out_what_is_inactive_and_the_smallest_bounds_up_to_half_the_tolerance(
    made: DesignScene, tolerance_dn: float
) -> None:
    plan, inactive = planned(made, tolerance_dn), inactive_effects(made.box)
    assert {choice.effect for choice in plan.choices} == {*EFFECTS}
    assert inactive <= plan.left_out
    choices = {choice.effect: choice for choice in plan.choices}
    assert all(choices[name].bound_dn == 0 for name in inactive)
    assert plan.error_bound_dn <= tolerance_dn / 2 * (1 + 1e-12)
    assert all(choice.bound_dn is not None for choice in plan.choices if not choice.computed)
    # What stays has no closed bound, needs more than what the stages before and all smaller bounds leave, or clips.
    for stage in (READOUT, set(EFFECTS) - READOUT):
        bounds = {name: choices[name].bound_dn for name in stage - inactive}
        out = [bounds[name] or 0.0 for name in bounds if name in plan.left_out]
        before = 0.0 if stage is READOUT else sum(choices[name].bound_dn or 0.0 for name in READOUT & plan.left_out)
        for name in bounds.keys() - plan.left_out:
            bound = bounds[name]
            needed = name == "saturation" and {"noise", "quantization"} & {*plan.computed}
            assert bound is None or needed or bound + sum(v for v in out if v <= bound) + before > tolerance_dn / 2


def test_errors_under_noise_need_all_of_the_readout() -> None:
    assert {*planned(ALL_ON, 1e6, for_noise=True).computed} >= READOUT


@pytest.mark.parametrize("made", HARD + ALONE, ids=lambda made: made.name)
def test_omitted_effects_change_no_csd_by_more_than_the_bound(made: DesignScene) -> None:
    exact, done = columns(made, accuracy=LATTICE), set()
    for tolerance_dn in TOLERANCES_DN:
        plan = planned(made, tolerance_dn)
        if plan.left_out in done:
            continue
        done.add(plan.left_out)
        realized = np.abs(columns(made, plan.left_out, LATTICE) - exact).max()
        assert realized <= plan.error_bound_dn * (1 + 1e-9) + _ARITHMETIC_DN, sorted(plan.left_out)


@pytest.mark.parametrize("seed", thinned(range(40), 10))
def test_in_a_random_scene_no_csd_changes_by_more_than_the_bound(seed: int) -> None:
    made = random_scene(seed)
    plan = plan_scene(made.name, [made.box], made.tolerance_dn, LATTICE)
    exact, found = (random_columns(made, left_out, LATTICE) for left_out in (frozenset(), plan.left_out))
    for name, values in exact.items():
        off = np.abs(values - found[name]).max()
        assert off <= plan.error_bound_dn * (1 + 1e-9) + _ARITHMETIC_DN, (seed, name, sorted(plan.left_out))


@pytest.mark.parametrize("made", HARD + ALONE, ids=lambda made: made.name)
def test_an_effect_alone_changes_no_csd_by_more_than_its_bound_and_inactive_ones_none(made: DesignScene) -> None:
    inactive = inactive_effects(made.box)
    difference = np.abs(columns(made, frozenset(inactive), LATTICE) - columns(made, accuracy=LATTICE)).max()
    assert difference <= _ARITHMETIC_DN
    for name, effect in EFFECTS.items():
        if effect.bound_dn is None or name in inactive:
            continue
        # Behind noise or rounding saturation is never left out.
        others = frozenset({"noise", "quantization"}) if name == "saturation" else frozenset()
        bound_dn = effect.bound_dn(made.box, READOUT - inactive - others)
        exact, found = columns(made, others, LATTICE), columns(made, others | {name}, LATTICE)
        assert np.abs(found - exact).max() <= bound_dn * (1 + 1e-9) + _ARITHMETIC_DN, name


SMALL: dict[str, tuple[str, dict[str, Any], dict[str, Any], float | None]] = {
    "angle": ("RYNCy", {"optics": {"f_number": 200.0}}, {}, 1.8),
    "illumination": ("RYNCy", {"off_axis_deg": 0.2}, {}, None),
    "extinction": ("RYNCy", {"target": NEAR, "visibility_m": 1e7}, {}, None),
    "veiling glare": ("RYNCy", {"veiling_glare": {"share": 2e-5, "field_cd_m2": 3000}, "target": NEAR}, {}, None),
    "crosstalk": ("quad", {}, {"crosstalk": 1e-6}, None),
}
"""Scenes with little of an effect, under noise, which dithers the steps of rounding: the tile, the scene, the pixel, the index of its filters."""


@pytest.mark.parametrize("name", list(SMALL))
def test_little_of_an_effect_is_left_out(name: str) -> None:
    cfa, given, pixel, index = SMALL[name]
    made = scene(name, cfa, {"noise": True} | given, DARK | pixel, index=index)
    plan = planned(made, 0.1)
    assert name in plan.left_out - inactive_effects(made.box)
    exact, found = (columns(made, READOUT | out, LATTICE) for out in (frozenset[str](), frozenset({name})))
    bound_dn = next(choice.bound_dn for choice in plan.choices if choice.effect == name)
    assert bound_dn is not None
    assert 0 < np.abs(found - exact).max() <= bound_dn


LIT = {"intensity_cd": 200, "exposure": {"kind": "fixed", "exposure_s": 3e-3}}
ALL_ON = scene(
    "all on",
    "RYNCy",
    LIT
    | {
        "target": FAR | {"phase_px": [0.3, 0.6]},
        "visibility_m": 2000,
        "off_axis_deg": 10,
        "veiling_glare": {"share": 0.02, "field_cd_m2": 100},
        "drive": {"duty": 0.5, "frequency_hz": 900},
        "optics": F2 | {"cra_deg": 12.0},
        "noise": True,
    },
    DARK | {"crosstalk": 0.02},
    index=1.8,
)


def test_a_plan_of_several_boxes_holds_for_each() -> None:
    dim, bright = (scene(str(s), "RYNCy", LIT | {"exposure": {"kind": "fixed", "exposure_s": s}}) for s in (1e-4, 4e-2))
    assert "saturation" in planned(dim, 1.0).left_out
    both = plan_scene("both", [dim.box, bright.box], 1.0, STANDARD)
    assert "saturation" in both.computed
    each = [planned(made, 1.0) for made in (dim, bright)]
    assert set(both.computed) >= set(each[0].computed) | set(each[1].computed)


def test_plans_that_compute_the_same_have_one_key() -> None:
    made = HARD[0]
    one, other = planned(made, 1e-3), planned(made, 2e-3)
    assert one.computed == other.computed
    assert one.key == other.key
    assert planned(made, 10.0).key != one.key
    finer = plan_scene(made.name, [made.box], 1e-3, LATTICE.model_copy(update={"rays": 4}))
    assert finer.key != one.key


@pytest.mark.parametrize("made", [made for made in HARD if not made.setup.all_phases], ids=lambda made: made.name)
def test_no_pixel_is_brighter_than_the_brightest(made: DesignScene) -> None:
    model = SceneModel(replace(made.setup, left_out=frozenset({"quantization", "noise"})))
    electrons = model.pixel_electrons(made.curves)
    assert electrons.shape[3] == len(lights().names)
    assert electrons.max() * made.setup.camera.pixel.dn_per_e <= made.box.brightest_pixel_dn * (1 + 1e-9)
