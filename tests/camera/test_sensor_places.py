"""All places of the sensor: proofs against dense scans of image heights, which know nothing of what lies between."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sweep.camera.bent_chords import Steepest, edge_of_cone
from sweep.camera.effects.image_height import ImageHeight
from sweep.camera.imager import Imager
from sweep.camera.methods import REFERENCE
from sweep.camera.plan.at_once import counted_s, looking_s
from sweep.camera.plan.planner import Planner
from sweep.camera.plan.work import DesignCount
from sweep.camera.rays import Cone
from sweep.camera.scenario import Scenario
from sweep.camera.seen import SeenFilters
from sweep.camera.sensor_places import SensorPlaces
from sweep.curves.lights import class_pairs
from sweep.designs.families.stopband import Stopband
from sweep.metrics.evaluate import evaluate
from sweep.metrics.separation import csd_name, separations
from sweep.metrics.smooth import smooth_csd, smooth_response

from ..cases import thinned
from ..hard.scenes import FAR, FINE, FIXED, SENSOR, Scene, scene

WAYS = ImageHeight.methods[1:]


def everywhere(given: dict[str, Any], field: dict[str, Any], f_number: float = 1.6, index: float = 1.8) -> Scene:
    scenes = given | {"optics": {"f_number": f_number}, "field": field | {"places": "any"}}
    return scene("everywhere", "RYNCy", scenes, {"dark_e_per_s": 50.0, "crosstalk": 0.05}, grid=FINE, index=index)


CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "patch": ({"background_cd_m2": 200.0, "exposure": FIXED}, {"cra_max_deg": 30.0}),
    "dim corner": ({"off_axis_deg": 8.0}, {"heights": [0.0, 0.3, 0.55, 1.0], "cra_deg": [0.0, 22.0, 25.0, 18.0]}),
    "target": ({"target": FAR, "off_axis_deg": 25.0, "visibility_m": 900.0}, {"cra_max_deg": 25.0}),
    "pulsed": (
        {"drive": {"duty": 0.4, "frequency_hz": 90}, "intensity_cd": 200.0, "exposure": {**FIXED, "exposure_s": 0.004}},
        {"cra_deg": [0.0, 15.0, 30.0]},
    ),
}


def designs(count: int, seed: int) -> np.ndarray:
    """Stopbands with edges from 2 nm, anywhere among the lights, ndarray[count, 1, n_wavelengths]."""
    rng, yellow, green = np.random.default_rng(seed), *(fine_qe(name) for name in ("Y", "G"))
    x = np.column_stack([rng.uniform(570, 640, count), rng.uniform(2, 20, count), rng.uniform(640, 690, count)])
    x = np.column_stack([x, rng.uniform(2, 20, count), rng.uniform(0.5, 1, count)])
    return Stopband(FINE.nodes_nm, yellow, green).curves(x)


def fine_qe(name: str) -> np.ndarray:
    return np.interp(FINE.nodes_nm, np.linspace(400, 700, 61), SENSOR.qe[name])


def at_height(made: Scene, height: float) -> Scene:
    """The scene at one place, written anew from what the study says."""
    scenario = made.view.scenario
    assert scenario.field is not None
    cra_deg = float(np.interp(height, *scenario.field.knots))
    off_axis = math.degrees(math.atan(height * math.tan(math.radians(scenario.off_axis_deg))))
    given = scenario.model_dump(exclude={"field"}) | {"off_axis_deg": off_axis}
    given["optics"] = given["optics"] | {"cra_deg": cra_deg}
    return replace(made, view=replace(made.view, scenario=Scenario.model_validate(given)))


@pytest.mark.parametrize(
    ("f_number", "start_deg", "end_deg", "index"),
    [
        (1.6, 0.0, 2.5, 1.8),
        (1.6, 18.0, 18.4, 1.8),
        (1.2, 30.0, 24.0, 1.5),
        (8.0, 10.0, 10.2, 2.0),
        (0.8, 35.0, 36.0, 1.6),
    ],
)
def test_means_over_a_cone_that_turns_are_near_their_chord(
    f_number: float, start_deg: float, end_deg: float, index: float
) -> None:
    """Of filters that bend as they like; and the bound is not uselessly wide for a stopband."""
    made = scene("cone", "RYNCy", {"optics": {"f_number": f_number}}, grid=FINE, index=index)
    wave, channel, base = FINE.nodes_nm, made.view.modified[0], made.view.base_qe[0]
    rng = np.random.default_rng(5)
    teeth = rng.integers(0, 2, (4, wave.size)).astype(float)
    band = 1 - np.clip((wave - 610) / 6, 0, 1) * np.clip((656 - wave) / 6, 0, 1)
    filters = np.concatenate([teeth, rng.uniform(size=(4, wave.size)), band[None]])

    def seen(cra_deg: float) -> np.ndarray:
        optics = made.view.scenario.optics.model_copy(update={"cra_deg": cra_deg})
        view = replace(made.view, scenario=made.view.scenario.model_copy(update={"optics": optics}))
        return SeenFilters(view, "cone").curves((base * filters)[:, None], [channel])[:, 0] / base

    cone = Cone(math.asin(0.5 / f_number), math.radians(start_deg))
    edge = edge_of_cone(wave, wave, index, cone, math.radians(end_deg))
    bounds = np.stack([edge.off_chord(wave, Steepest(wave, t), float(np.ptp(t)) / 2) for t in filters])
    first, last, off = seen(start_deg), seen(end_deg), np.zeros_like(bounds)
    for share in np.linspace(0, 1, 12)[1:-1]:
        chord = (1 - share) * first + share * last
        off = np.maximum(off, np.abs(seen(start_deg + share * (end_deg - start_deg)) - chord))
    assert (off <= bounds * (1 + 1e-9) + 1e-13).all()
    assert bounds[-1].max() <= 12 * off[-1].max()


def test_the_steepest_slope_in_a_range() -> None:
    rng = np.random.default_rng(1)
    knots, values = np.cumsum(rng.uniform(0.5, 2, 40)), rng.uniform(size=40)
    steepest = Steepest(knots, values)
    slopes = [0.0, *np.abs(np.diff(values) / np.diff(knots)), 0.0]
    first = rng.integers(0, 41, 300)
    last = first + rng.integers(0, 41 - first)
    expected = [max(slopes[a : b + 1]) for a, b in zip(first, last, strict=True)]
    np.testing.assert_array_equal(steepest.among(first, last), expected)


@pytest.mark.parametrize("case", thinned(["dim corner", "patch", "target", "pulsed"], 4))
def test_no_place_is_worse_than_the_worst_that_is_found(case: str) -> None:
    """Against 61 heights, each a scene of its own; and the worst is what the camera has at the height that is told."""
    made = everywhere(*CASES[case])
    pairs = class_pairs(made.view.lights.classes)
    curves = designs(3, 7)
    scan = {pair: np.full(len(curves), np.inf) for pair in pairs}
    for height in np.linspace(0, 1, 61):
        for moment in np.moveaxis(smooth_response(at_height(made, float(height)).view, curves), 1, 0):
            for pair, distances in separations(moment, made.view.members).items():
                scan[pair] = np.minimum(scan[pair], distances)
    places = SensorPlaces(made.view, 0.02, Counter())
    between = 0
    for index, curve in enumerate(curves):
        for pair, worst in places.worst(curve).items():
            assert worst is not None
            assert worst.distance_dn <= scan[pair][index] + 0.02
            there = at_height(made, worst.height).view
            assert smooth_csd(there, curve[None], pair)[0] == pytest.approx(worst.distance_dn, abs=1e-6)
            between += 0 < worst.height < 1
    assert between > 0 or case == "pulsed"  # not only the middle and the corner are the worst


@pytest.mark.parametrize("noise", thinned([True, False]))
def test_columns_keep_what_the_plan_promises(noise: bool) -> None:
    """Each way to look at all places, behind rounding, too; closer ways look at more of them."""
    made = everywhere({"noise": noise, "off_axis_deg": 20.0}, {"cra_max_deg": 30.0})
    curves, planner = designs(2, 11), Planner([made.box])
    names = [csd_name(pair) for pair in class_pairs(made.view.lights.classes)]
    found, looked_at = {}, []
    for way in WAYS:
        imager = Imager(replace(made.view, methods=replace(REFERENCE, field=way)))
        found[way] = evaluate(imager, curves)
        looked_at.append(imager.work["places of the sensor"])
    assert looked_at == sorted(looked_at)
    assert looked_at[0] < looked_at[-1]
    scan = [evaluate(Imager(at_height(made, float(h)).view), curves) for h in np.linspace(0, 1, 15)]
    for way in WAYS:
        promised = planner.promise("field", REFERENCE, replace(REFERENCE, field=way))
        for name in names:
            assert (found[way][name] <= np.min([each[name] for each in scan], axis=0) + promised).all()
            assert (np.abs(found[way][name] - found[WAYS[-1]][name]) <= promised).all()


def test_a_plan_says_how_closely_all_places_are_looked_at() -> None:
    made = everywhere({"noise": True, "off_axis_deg": 20.0}, {"cra_max_deg": 30.0})
    planner = Planner([made.box])
    wide, tight = planner.plan("", 20.0), planner.plan("", 0.5)
    assert wide.methods.field == "within 10 DN"
    assert 10 <= wide.promised_dn <= 20
    # Behind a readout that is not straight, something stays open however closely is looked.
    assert tight.methods.field == "within 0.1 DN"
    # What stays open is looked for, however little is saved.
    views = [(made.view, DesignCount(1))]
    assert looking_s(views, counted_s(views)) > 0
    assert tight.methods.angle == "cone"
    assert not planner._allowed("angle", replace(tight.methods, angle="skip"))
    assert planner.promise("field", REFERENCE, replace(REFERENCE, field="named places")) == math.inf


def test_where_nothing_moves_all_places_see_the_same() -> None:
    made = everywhere({}, {"cra_max_deg": 30.0})
    still = replace(made.view, technologies=())
    imager = Imager(still)
    found = evaluate(imager, made.curves)
    assert imager.work["places of the sensor"] == 0
    view = at_height(made, 0.0).view
    named = evaluate(Imager(replace(view, technologies=())), made.curves)
    assert all(found[name] == named[name] for name in found)
    assert Planner([replace(made.box, view=still)]).plan("", 1.0).methods.field == "named places"
