"""Plans: no error is larger than promised, over all effects and scenes; what is skipped is not computed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sweep.base.errors import SweepError
from sweep.camera.effects.base import Stage
from sweep.camera.forget import forget_scenes
from sweep.camera.imager import Imager
from sweep.camera.methods import REFERENCE, Methods
from sweep.camera.plan.plan import Plan
from sweep.camera.plan.planner import Planner
from sweep.camera.registry import EFFECTS
from sweep.metrics.evaluate import evaluate
from sweep.study import load_study

from ..conftest import STUDIES
from ..hard.scenes import F2, FAR, HARD, Scene, asks_for_any_place, columns, scene
from ..hard.scenes_alone import ALONE as SCENES_ALONE

_ARITHMETIC_DN = 1e-9
"""Rounding of double precision itself."""
_SEEN_DN = 1e-3
_ALL_PLACES, _ALL_PLACES_DN = "within 0.01 DN", 0.02
"""All places are looked at so closely; two distances are then off by so much."""


@dataclass(frozen=True)
class Row:
    """What switching one effect from its reference to a method changes in any promised column of a scene."""

    scene: str
    base: str
    effect: str
    method: str
    promised: float
    realized: float


SCENES = (*HARD, *SCENES_ALONE)
READOUT = tuple(name for name, effect in EFFECTS.items() if effect.stage is Stage.READOUT)
ALONE = "reference"
"""Everything on but the one effect."""
STRAIGHT = "straight"
BASES = {
    ALONE: REFERENCE,
    "unrounded": replace(REFERENCE, quantization="skip"),
    "no noise": replace(REFERENCE, noise="skip"),
    STRAIGHT: replace(REFERENCE, noise="skip", quantization="skip", saturation="skip"),
}
"""From where methods are switched; over all places, which takes long, from the first and the last."""
NOT_ALONE = {"sampling": STRAIGHT, "saturation": "unrounded"}
"""Effects that no plan switches alone (without pixels nothing is read one by one; rounding clips, too), and from where
they are seen."""
SEEN_FROM = NOT_ALONE | {"phase": STRAIGHT}
"""From where effects are seen that are not seen from the reference: a lattice of places, behind no rounding."""


def contract(made: Scene) -> list[Row]:
    """Every method of every effect, switched alone from every base from which a plan may switch it."""
    planner, noisy = Planner([made.box]), made.view.scenario.noise is not None
    columns_by = cache(lambda methods: columns(made, methods))  # from several bases the same methods are reached
    found = []
    bases = BASES
    if asks_for_any_place(made):
        bases = {name: replace(BASES[name], phase=_ALL_PLACES) for name in (ALONE, STRAIGHT)}
    for name, before in bases.items():
        if (name == "unrounded" and noisy) or (name == "no noise" and not noisy):
            continue
        reference = columns_by(before)
        for effect, own in EFFECTS.items():
            exact = planner._exact[effect] is not None
            for method in own.methods[:1] if exact else own.methods[:-1]:
                after = replace(before, **{effect: method})
                # Behind rounding nothing small is promised; what readout is left out, is left out in order.
                stepped = before.quantization == "round" and not noisy and effect not in READOUT and not exact
                late = effect in READOUT and any(getattr(before, e) == "skip" for e in READOUT[READOUT.index(effect) :])
                if after == before or stepped or late or not planner._allowed(effect, after):
                    continue
                if effect != "sampling" and not planner._allowed("sampling", after):
                    continue
                promised = 0.0 if exact else planner.promise(effect, before, after)
                if not exact and effect not in (*READOUT, "phase") and before.saturation == "clip":
                    # Over all places, what a readout that is not straight adds is part of the promise of `phase`.
                    promised += planner._left_over(after) if planner.promise("phase", after, after) else 0.0
                realized = float(np.abs(columns_by(after) - reference).max())
                found.append(Row(made.name, name, effect, method, promised, realized))
    return found


NAMED = [made for made in SCENES if not asks_for_any_place(made)]
SEEN_BESIDE = ("luminous", "saturated, pedestal", "well below the ADC, RGGB, a fraction of a pedestal")
ALONE_OR_BESIDE = {*SEEN_BESIDE, *(made.name for made in SCENES_ALONE)}
MEASURED = {
    "few": [made for made in NAMED if made.name in ALONE_OR_BESIDE],
    "all": NAMED,
    "any place": [made for made in SCENES if asks_for_any_place(made)],
}
"""Scenes whose contracts are looked at together: a few in which every method is seen, all that name a place, and those
that ask for any, which take minutes."""
few_and_all = pytest.mark.parametrize("which", ["few", pytest.param("all", marks=[pytest.mark.slow, pytest.mark.long])])


@cache
def contracts(which: str) -> tuple[Row, ...]:
    return tuple(row for made in MEASURED[which] for row in contract(made))


def unseen(rows: Iterable[Row], effects: Mapping[str, Any]) -> dict[tuple[str, str], list[str]]:
    """Methods that fewer than three scenes see when they are switched alone from the reference, with those scenes."""
    seen: dict[tuple[str, str], list[str]] = {
        (name, method): [] for name, effect in effects.items() for method in effect.methods[:-1]
    }
    for row in rows:
        if row.effect in effects and row.base == SEEN_FROM.get(row.effect, ALONE) and row.realized > _SEEN_DN:
            seen[row.effect, row.method].append(row.scene)
    return {method: scenes for method, scenes in seen.items() if len(scenes) < 3}


def test_the_table_of_methods_is_that_of_the_effects() -> None:
    assert asdict(REFERENCE) == {name: effect.methods[-1] for name, effect in EFFECTS.items()}
    for name, effect in EFFECTS.items():
        for method in effect.methods:
            assert asdict(replace(REFERENCE, **{name: method})) == asdict(REFERENCE) | {name: method}


def test_unknown_effects_and_methods_are_refused() -> None:
    allowed = "; allowed: skip, every 10 nm, every 5 nm, every 2 nm, every wavelength; did you mean 'skip'"
    with pytest.raises(SweepError, match=r"unknown method of blur \(got 'skp'\)" + allowed):
        Methods(blur="skp")
    with pytest.raises(SweepError, match=r"unknown method of noise \(got 'grid'\)"):
        replace(REFERENCE, noise="grid")
    with pytest.raises(SweepError, match=r"unknown effect \(got 'flickr'\); allowed: noise, .*did you mean 'flicker'"):
        Methods(flickr="skip")


def test_there_are_enough_hard_scenes() -> None:
    assert len(SCENES) >= 40
    assert len({made.name for made in SCENES}) == len(SCENES)


def broken(rows: Iterable[Row], off_dn: float = _ARITHMETIC_DN) -> list[Row]:
    return [row for row in rows if not row.realized <= row.promised * (1 + 1e-9) + off_dn]


@few_and_all
def test_no_method_changes_more_than_it_promises(which: str) -> None:
    assert broken(contracts(which)) == []


@pytest.mark.slow
@pytest.mark.long
def test_no_method_changes_more_than_it_promises_where_any_place_counts() -> None:
    """And every way to look at places is seen, but for the one that the others are compared with here."""
    rows = contracts("any place")
    methods = EFFECTS["phase"].methods
    assert broken(rows, _ALL_PLACES_DN) == []
    ways = {"phase": SimpleNamespace(methods=methods[: methods.index(_ALL_PLACES) + 1])}
    assert unseen(rows, ways) == {}


@few_and_all
def test_promises_are_not_uselessly_wide(which: str) -> None:
    ratios = [row.promised / row.realized for row in contracts(which) if row.realized > _SEEN_DN]
    assert len(ratios) > 200
    assert np.median(ratios) <= 10


OF_PLACES = ("phase", "field")
"""Effects that only scenes of any place see; of the sensor: `tests/camera/test_sensor_places.py`."""
OTHERS = {name: effect for name, effect in EFFECTS.items() if name not in OF_PLACES}


def test_every_method_is_seen() -> None:
    assert unseen(contracts("few"), OTHERS) == {}


def test_an_effect_that_no_scene_sees_is_found() -> None:
    planted = {"vignetting": SimpleNamespace(methods=("skip", "polynomial", "traced"))}
    assert unseen(contracts("few"), {**OTHERS, **planted}) == {
        ("vignetting", "skip"): [],
        ("vignetting", "polynomial"): [],
    }
    weak = [replace(row, realized=_SEEN_DN) if row.effect == "blur" else row for row in contracts("few")]
    assert list(unseen(weak, OTHERS)) == [("blur", method) for method in EFFECTS["blur"].methods[:-1]]
    elsewhere = [row for row in contracts("few") if row.base != ALONE]
    assert {effect for effect, _ in unseen(elsewhere, OTHERS)} == set(OTHERS) - set(NOT_ALONE)


def test_no_plan_switches_alone_what_is_not_seen_alone() -> None:
    for made in SCENES:
        planner = Planner([made.box])
        for effect in NOT_ALONE:
            if planner._exact[effect] is None:
                for method in EFFECTS[effect].methods[:-1]:
                    assert not planner._allowed(effect, replace(REFERENCE, **{effect: method}))


def computed(plan: Plan) -> set[str]:
    return set(plan.computed)


def counted(made: Scene, methods: Methods) -> Counter[str]:
    imager = Imager(replace(made.view, methods=methods))
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


@pytest.mark.slow
def test_a_tighter_tolerance_costs_more_and_is_kept() -> None:
    study = load_study(STUDIES / "distance.yaml", None, 5.0)
    spaces = [space for space in study.spaces if space.name in ("RGGB", "best stopband")]
    names = ("near", "far")

    def run(plans: dict[str, Plan]) -> tuple[np.ndarray, int]:
        planned, found, work = replace(study, plans=plans), [], 0
        forget_scenes()
        for name in names:
            for space in spaces:
                imager = Imager(planned.view(space, name))
                columns = evaluate(imager, space.curves(space.points(0, 1), study.grid.size))
                found += [values[0] for column, values in columns.items() if column.startswith("csd_")]
                work += sum(imager.work.values())
        return np.array(found), work

    exact, whole = run({})
    works, keys = [], []
    for tolerance in (100.0, 10.0, 1.0, 0.1, 0.01):
        plans = {name: study.plan(name, tolerance, always=True) for name in names}
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
        realized = np.abs(columns(other, plan.methods) - columns(other, REFERENCE)).max()
        assert realized <= plan.promised_dn
