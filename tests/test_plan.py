"""Plans: no error is larger than promised, over all effects and scenes; what is skipped is not computed."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, replace
from functools import cache

import joblib
import numpy as np
import pytest

from sweep.effects import blur
from sweep.errors import SweepError
from sweep.evaluate import evaluate
from sweep.imaging import Imager
from sweep.metrics import CSD
from sweep.plan import Plan, Planner
from sweep.promises import EFFECTS, READOUT
from sweep.setup import METHODS, REFERENCE, Methods
from sweep.study import load_study

from .conftest import STUDIES
from .hard_scenes import F2, FAR, HARD, Scene, scene

_ARITHMETIC_DN = 1e-9
"""Rounding of double precision itself."""


def csds(made: Scene, methods: Methods) -> np.ndarray:
    columns = evaluate(Imager(replace(made.setup, methods=methods)), made.curves)
    return np.array([values[0] for name, values in columns.items() if name.startswith(CSD)])


def contract(made: Scene) -> list[tuple[str, str, float, float]]:
    """(effect, method, promised, realized) of every method of every effect, switched alone from two starting points."""
    planner = Planner([made.box])
    exact = {e: EFFECTS[e].METHODS[0] for e in EFFECTS if planner._exact[e] is not None}
    whole = replace(REFERENCE, **exact)
    if not made.setup.scenario.noise:  # behind rounding nothing small is promised
        whole = replace(whole, quantization="skip")
    straight = replace(whole, noise="skip", quantization="skip", saturation="skip")
    found = []
    for before in (whole, straight):
        reference = csds(made, before)
        for effect, module in EFFECTS.items():
            for method in module.METHODS[:-1]:
                after = replace(before, **{effect: method})
                if after == before or (before == straight and effect in READOUT):
                    continue
                if effect == "saturation" and made.setup.scenario.noise:  # goes with noise, which is switched first
                    continue
                if not planner._allowed("sampling", after):
                    continue
                realized = float(np.abs(csds(made, after) - reference).max())
                found.append((effect, method, planner.promise(effect, before, after), realized))
    return found


@cache
def all_contracts() -> list[tuple[str, str, str, float, float]]:
    each = joblib.Parallel(n_jobs=2)(joblib.delayed(contract)(made) for made in HARD)
    return [(made.name, *row) for made, rows in zip(HARD, each, strict=True) for row in rows]


def test_the_table_of_methods_is_that_of_the_effects() -> None:
    assert [(effect, module.METHODS) for effect, module in EFFECTS.items()] == list(METHODS.items())
    assert asdict(REFERENCE) == {effect: methods[-1] for effect, methods in METHODS.items()}
    for effect, methods in METHODS.items():
        for method in methods:
            assert asdict(replace(REFERENCE, **{effect: method})) == asdict(REFERENCE) | {effect: method}


def test_unknown_effects_and_methods_are_refused() -> None:
    allowed = "; allowed: skip, every 10 nm, every 5 nm, every 2 nm, every wavelength; did you mean 'skip'"
    with pytest.raises(SweepError, match=r"unknown method of blur \(got 'skp'\)" + allowed):
        Methods(blur="skp")
    with pytest.raises(SweepError, match=r"unknown method of noise \(got 'grid'\)"):
        replace(REFERENCE, noise="grid")
    with pytest.raises(SweepError, match=r"unknown effect \(got 'flickr'\); allowed: noise, .*did you mean 'flicker'"):
        Methods(flickr="skip")


def test_there_are_enough_hard_scenes() -> None:
    assert len(HARD) >= 40
    assert len({made.name for made in HARD}) == len(HARD)


def test_no_method_changes_more_than_it_promises() -> None:
    broken = [row for row in all_contracts() if row[4] > row[3] * (1 + 1e-9) + _ARITHMETIC_DN]
    assert not broken
    assert {(effect, method) for _, effect, method, *_ in all_contracts()} >= {
        (effect, method) for effect, module in EFFECTS.items() for method in module.METHODS[:-1] if effect != "demosaic"
    } - {("blur", m) for m in blur.METHODS} - {("saturation", "skip")}


def test_promises_are_not_uselessly_wide() -> None:
    ratios = [promised / realized for *_, promised, realized in all_contracts() if realized > 1e-3]
    assert len(ratios) > 200
    assert np.median(ratios) <= 10


def computed(plan: Plan) -> set[str]:
    return set(plan.computed)


def counted(made: Scene, methods: Methods) -> Counter[str]:
    imager = Imager(replace(made.setup, methods=methods))
    evaluate(imager, made.curves)
    return imager.work


def test_the_papers_scene_needs_nothing_but_response_and_quantization() -> None:
    study = load_study(STUDIES / "stopband.yaml")
    plan = study.plan("chart")
    assert computed(plan) == {"quadrature", "quantization"}
    assert plan.promised_dn == 0
    assert plan.methods.quadrature == "grid"
    made = scene("paper", "RYNCy", {})
    assert set(counted(made, Planner([made.box]).plan("paper", 0.1).methods)) == {"response", "quantization"}


def test_a_far_scene_needs_blur_sampling_and_phase() -> None:
    given = {"target": FAR | {"phase_px": "any"}, "optics": F2, "noise": True}
    made = scene("far", "RYNCy", given, {"read_noise_e": 2.0, "offset_dn": 64.0})
    plan = Planner([made.box]).plan("far", 0.1)
    assert {"blur", "sampling", "phase"} <= computed(plan)
    assert not {"saturation", "noise", "extinction", "flicker", "illumination"} & computed(plan)
    work = counted(made, plan.methods)
    assert work["blur"] > 0
    assert work["sampling"] > 0
    assert not {"saturation", "noise", "quantization", "flicker"} & set(work)


def test_a_saturated_scene_needs_the_clip() -> None:
    made = next(s for s in HARD if s.name == "red saturates")
    plan = Planner([made.box]).plan("red saturates", 5.0)
    assert plan.methods.saturation == "clip"
    work = counted(made, plan.methods)
    assert work["saturation"] > 0
    assert not {"blur", "sampling", "noise"} & set(work)


def test_a_skipped_effect_costs_nothing() -> None:
    made = scene("far", "RYNCy", {"target": FAR, "optics": F2})
    sharp = counted(made, replace(REFERENCE, blur="skip", quantization="skip", saturation="skip"))
    ideal = counted(made, replace(REFERENCE, blur="skip", sampling="skip", quantization="skip", saturation="skip"))
    whole = counted(made, REFERENCE)
    assert "blur" not in sharp
    assert not {"blur", "sampling", "quantization", "saturation"} & set(ideal)
    assert ideal["response"] < whole["response"]


def test_a_tighter_tolerance_costs_more_and_is_kept() -> None:
    study = load_study(STUDIES / "distance.yaml")
    spaces = [space for space in study.spaces if space.cfa in ("RGGB", "RYNCy")]
    names = ("near", "far")

    def run(plans: dict[str, Plan]) -> tuple[np.ndarray, int]:
        planned, found, work = replace(study, plans=plans), [], 0
        for name in names:
            for space in spaces:
                imager = Imager(planned.setup(space, name))
                columns = evaluate(imager, space.curves(space.points(0, 1), study.grid.size))
                found += [values[0] for column, values in columns.items() if column.startswith(CSD)]
                work += sum(imager.work.values())
        return np.array(found), work

    exact, whole = run({})
    works, keys = [], []
    for tolerance in (100.0, 10.0, 1.0, 0.1, 0.01):
        plans = {name: study.plan(name, tolerance) for name in names}
        found, work = run(plans)
        assert np.abs(found - exact).max() <= max(plan.promised_dn for plan in plans.values()) <= tolerance
        works.append(work)
        keys.append(tuple(plan.key for plan in plans.values()))
    assert works == sorted(works)
    assert works[-1] < whole
    assert len(set(keys)) == 5


def test_a_plan_names_its_alternatives() -> None:
    made = scene("far", "RYNCy", {"target": FAR, "optics": F2})
    plan = Planner([made.box]).plan("far", 10.0)
    rejected = {(effect, method): promised for effect, method, promised in plan.rejected}
    assert rejected["sampling", "skip"] > 10
    assert plan.methods == Planner([made.box]).plan("far", 10.0).methods
    assert plan.key != Planner([made.box]).plan("far", 100.0).key


@pytest.mark.parametrize("wide", [False, True])
def test_a_plan_holds_for_every_design_of_its_box(wide: bool) -> None:
    made = scene("box", "RYNCy", {"target": FAR, "optics": F2}, wide=wide)
    plan = Planner([made.box]).plan("box", 30.0)
    others = [scene("one", "RYNCy", {"target": FAR, "optics": F2}, seed=seed) for seed in range(2, 12)]
    for other in others if wide else [made]:
        realized = np.abs(csds(other, plan.methods) - csds(other, REFERENCE)).max()
        assert realized <= plan.promised_dn
