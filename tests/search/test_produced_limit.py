"""The limit over what production does to a filter: rows of the program, a program of its own, the figures that are told."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import trapezoid

from sweep.designs.tolerance import NONE, ProductionError, Tolerance
from sweep.metrics.bound import Bound
from sweep.metrics.objective import Objective
from sweep.metrics.smooth import smooth_csd
from sweep.search.perturbed import all_ways, perturbed_filters
from sweep.search.problem import starting_points
from sweep.search.upper_bound import UpperBound, _relaxed, reason_without_bound, upper_bound_of

from .problems import PROBLEM, STUDY, YELLOW_RED

BASE, TARGET, WAVE = STUDY.sensor.qe["Y"], STUDY.sensor.qe["G"], STUDY.grid.nodes_nm
SHIFTS = (-2, -1, 0, 1, 2)
MOVED = replace(PROBLEM, tolerance=Tolerance(2.0), objective=Objective(minimum={"worst_csd_yellow_red": 1.0}))
"""The search for the largest worst case over what production does to the edges."""


@cache
def limit() -> UpperBound:
    return upper_bound_of(MOVED)


def test_a_bound_on_the_designed_sensitivity_does_not_hold_for_perturbed_filters() -> None:
    """Beside a darker Y a filter of at most 0.9 leaves the exposure to others; one that production moves may not."""
    qe = MOVED.setup.camera.qe.copy()
    qe[MOVED.setup.camera.mosaic.channels.index("Y")] *= 0.95
    setup = MOVED.setup.with_camera(qe=qe)
    moved = replace(MOVED, setup=setup, constraints={"sensitivity": Bound(max=0.9)})
    assert reason_without_bound(moved) == "the modified channel could set the exposure"
    assert reason_without_bound(replace(moved, objective=Objective(minimum={"csd_yellow_red": 1.0}))) is None


def test_the_stricter_of_two_bounds_on_one_quantity_stays() -> None:
    constraints = {"chromatic_csd_yellow_red": Bound(min=90.0), "worst_chromatic_csd_yellow_red": Bound(min=70.0)}
    asked = replace(MOVED, constraints=constraints)
    assert _relaxed(asked)[0].constraints == {"chromatic_csd_yellow_red": Bound(min=90.0)}


def test_a_way_is_the_family_as_production_has_it() -> None:
    """Of random stopbands: the curve where it is known, and sums over it between the ends that rows have."""
    rng, family = np.random.default_rng(5), MOVED.family
    points = MOVED.from_unit(starting_points(MOVED, 64, 1))
    curves = family.curves(points)[:, 0]
    apart = rng.normal(size=(7, BASE.size))
    ways = perturbed_filters(MOVED)
    assert all_ways(MOVED)
    for way, shift in zip(ways, (0, -2, -1, 1, 2), strict=True):
        came_out = family.perturbed(ProductionError(shift)).curves(points)[:, 0]
        assert way.known.sum() >= 295
        distances = way.distances(apart)
        rows, added = distances.rows, distances.added
        for curve, out in zip(curves, came_out, strict=True):
            np.testing.assert_allclose(way.curve(curve)[way.known], out[way.known], rtol=1e-12, atol=1e-14)
            assert (apart @ out <= rows @ curve + added[:, 0] + 1e-9).all()
            assert (-(apart @ out) <= -(rows @ curve) + added[:, 1] + 1e-9).all()


def test_nonlinear_constraints_are_left_out_and_reported() -> None:
    """Moves by part of a step, films that are too thick, a field of all places."""
    assert not all_ways(replace(MOVED, tolerance=Tolerance(1.5)))
    assert len(perturbed_filters(replace(MOVED, tolerance=Tolerance(1.5)))) == 1
    found = upper_bound_of(replace(MOVED, tolerance=Tolerance(1.0)))
    assert found.left_out == ("some edge shifts",)  # half a nanometer is no whole step
    assert found.proven > limit().proven
    assert limit().left_out == ()
    thick = upper_bound_of(replace(MOVED, tolerance=Tolerance(2.0, 0.003)))
    assert thick.left_out == ("edge shifts",)
    assert thick.proven == pytest.approx(upper_bound_of(replace(MOVED, tolerance=NONE)).proven, abs=1e-3)


def moved(curve: np.ndarray, shift: int) -> np.ndarray:
    """A filter of RYNCy whose shape between Y and G stands so many nanometers, the steps of the grid, farther."""
    shape = np.interp(WAVE - shift, WAVE, (curve - BASE) / (TARGET - BASE))
    return BASE + (TARGET - BASE) * shape


def apart(curve: np.ndarray) -> np.ndarray:
    """By how much each yellow light is above each red one in N, DN, in closed form; ndarray[n_yellow * n_red]."""
    qe, lights, grid = STUDY.sensor.qe, STUDY.lights, STUDY.grid
    brightest = max(trapezoid(qe[name]) for name in ("R", "Y", "Cy"))
    dn = 0.95 * 4095 * lights.photon_ratio * grid.span_nm / brightest
    yellow, red = (trapezoid(lights.photons[lights.members[kind]] * curve) * dn for kind in YELLOW_RED)
    return (yellow[:, None] - red).ravel()


def others() -> np.ndarray:
    """Squared distance of each pair in the other channels, DN^2."""
    return sum(apart(STUDY.sensor.qe[name]) ** 2 for name in ("R", "Y", "Cy"))


def test_its_filter_has_it_however_it_comes_out() -> None:
    found = limit()
    assert 0 <= found.proven - found.attained <= 0.02
    least = min(np.sqrt(apart(moved(found.curve, shift)) ** 2 + others()).min() for shift in SHIFTS)
    assert least == pytest.approx(found.attained, abs=0.01)


def test_its_filter_keeps_the_bounds_of_the_study_on_worst_cases() -> None:
    """A program that knows some members of a worst case has filters that lack a little of it."""
    bounds = {**MOVED.constraints, "worst_csd_yellow_red": Bound(min=256)}
    requested = replace(MOVED, constraints=bounds, objective=Objective(minimum={"csd_yellow_red": 1.0}))
    found = upper_bound_of(requested)
    came_out = np.stack([way.curve(found.curve) for way in perturbed_filters(requested)])[:, None]
    each = smooth_csd(requested.setup, came_out, YELLOW_RED)
    assert each.min() >= 256 * (1 - 1e-9)
    assert each[0] == pytest.approx(found.attained, rel=1e-12)
    assert 0 <= found.proven - found.attained <= 0.02
