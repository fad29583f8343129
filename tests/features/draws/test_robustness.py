"""Yields beside draws of their own, and what breaks a design beside its worst case there."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.integrate import trapezoid
from scipy.optimize import brentq

from sweep.features.draws import ROBUSTNESS
from sweep.features.draws.robustness import Candidate, drawn_dn
from sweep.metrics.members import population_model
from sweep.metrics.share import share_interval
from sweep.study import Study

from ...build import load, ran

TEXT = """\
study: street
sensor: ar0820
lights: tl16
cfas: [RGGB, RYYCy, RYNCy]
population: {temperature_c: [-40, 85], self_heating_k: 20, binning_nm: {yellow: 2, red: 1}, wanted_dn: WANTED, draws: DRAWS}
production: PRODUCTION
designs:
  mine: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 613, left_width_nm: 6, right_nm: 651, right_width_nm: 6}}
objective: worst_csd_yellow_red
"""
THICK = "{edge_shift_nm: 2, thickness: 0.008}"
WANTED, EDGES = 200.0, (613.0, 6.0, 651.0, 6.0)


def street(folder: Path, draws: int = 20_000, production: str = "{edge_shift_nm: 2}") -> Study:
    text = TEXT.replace("DRAWS", str(draws)).replace("WANTED", str(WANTED))
    return load(folder, text.replace("PRODUCTION", production))


def quintic(t: np.ndarray | float) -> np.ndarray | float:
    return t * t * t * (t * (t * 6 - 15) + 10)


def rise(wave: np.ndarray, center: np.ndarray | float, width: np.ndarray | float) -> np.ndarray:
    """An edge of so much between 10 and 90 %."""
    tenth = brentq(lambda t: quintic(t) - 0.1, 0, 0.5)
    return np.asarray(quintic(np.clip((wave - center) / width * (1 - 2 * tenth) + 0.5, 0, 1)))


def brute_force(study: Study, n: int, seed: int, thickness: float = 0.0) -> np.ndarray:
    """DN of n random lamps and cameras: each with its own spectra and its own filter."""
    rng, lights, grid = np.random.default_rng(seed), study.lights, study.grid
    wave, qe = grid.nodes_nm, study.sensor.qe
    plain = np.stack([qe[name] for name in ("R", "Y", "Cy")])
    dn = 0.95 * 4095 * lights.photon_ratio * grid.span_nm / trapezoid(plain).max()
    moved = np.lib.stride_tricks.sliding_window_view(np.pad(lights.photons, ((0, 0), (20, 20))), wave.size, axis=1)
    found = []
    for size in np.full(n // 500, 500):
        warm = rng.uniform(-40, 85, size) + rng.uniform(0, 20, size) - 25
        edge = rng.uniform(-2, 2, size)[:, None]
        film = 1 + rng.uniform(-thickness, thickness, size)[:, None]
        left, right = (rise(wave - edge, film * EDGES[at], film * EDGES[at + 1]) for at in (0, 2))
        filters = qe["Y"] + (qe["G"] - qe["Y"]) * (left - right)
        points = []
        for kind, binning in (("yellow", 2.0), ("red", 1.0)):
            nm = 0.1 * warm + rng.uniform(-binning, binning, size)
            signal, below = rng.choice(lights.members[kind], size), np.floor(nm).astype(int)
            share = (nm - below)[:, None]
            spectra = (1 - share) * moved[signal, 20 - below] + share * moved[signal, 19 - below]
            points.append(np.column_stack([trapezoid(spectra[:, None] * plain), trapezoid(spectra * filters)]) * dn)
        found.append(np.linalg.norm(points[0] - points[1], axis=1))
    return np.concatenate(found)


def candidate(study: Study) -> Candidate:
    space = next(space for space in study.spaces if space.name == "mine")
    return Candidate(study.setup(space, "chart"), space, space.points(0, 1), study.tolerance)


@pytest.mark.parametrize(
    ("production", "thickness"),
    [("{edge_shift_nm: 2}", 0.0), pytest.param(THICK, 0.008, marks=pytest.mark.slow)],
)
def test_a_yield_is_that_of_draws_of_their_own(tmp_path: Path, production: str, thickness: float) -> None:
    study = street(tmp_path, production=production)
    drawn = drawn_dn(candidate(study), ("yellow", "red"), study.section.seed)
    own = brute_force(study, 20_000, 9, thickness)
    for wanted in (WANTED, 230.0):
        ends = [share_interval(int((values >= wanted).sum()), values.size) for values in (drawn, own)]
        assert 0.01 < (own >= wanted).mean() < 0.99
        assert max(low for low, _ in ends) <= min(high for _, high in ends), ends


def test_a_worst_case_is_over_edges_and_films_together(tmp_path: Path) -> None:
    """Beside the corners of both tolerances, with the filter's edges moved by hand."""
    study = street(tmp_path, production=THICK)
    design, pair = candidate(study), ("yellow", "red")
    seen, found = population_model(design.setup), []
    for edge in (-2.0, 2.0):
        for film in (0.992, 1.008):
            own = design.point * np.array([film, film, film, film, 1.0]) + np.array([edge, 0, edge, 0, 0])
            found.append(seen.worst(design.space.curves(own, study.grid.size), [pair])["csd_yellow_red"][0])
    worst, off = design.worst(pair, 1.0)
    assert worst == pytest.approx(min(found), abs=1e-9)
    assert (off.shift_nm, off.thickness) == list(product((-2.0, 2.0), (-0.008, 0.008)))[int(np.argmin(found))]


def test_the_interval_of_a_share() -> None:
    """Wilson's: the shares p with |k/n - p| <= 1.96 sqrt(p (1 - p) / n)."""
    for kept, n in ((0, 50), (3, 20), (500, 1000), (20, 20)):
        for end in share_interval(kept, n):
            if 1e-9 < end < 1 - 1e-9:
                assert abs(kept / n - end) == pytest.approx(1.959964 * np.sqrt(end * (1 - end) / n), rel=1e-6)


@pytest.mark.slow
def test_a_break_is_where_the_worst_cases_cross(tmp_path: Path) -> None:
    study = street(tmp_path, 1000)
    ran(study, tmp_path / "out", 2)
    plain, _, mine = pq.read_table(tmp_path / "out" / ROBUSTNESS).to_pylist()
    assert plain["breaks_at"] is None
    at, pair = mine["breaks_at"], ("yellow", "red")
    rggb = Candidate(study.setup(study.spaces[0], "chart"), study.spaces[0], np.empty((1, 0)), study.tolerance)
    here, before = (candidate(study).worst(pair, x)[0] - rggb.worst(pair, x)[0] for x in (at, at - 0.25 / 2**6))
    assert here < 0 <= before
    assert mine["breaks_dn"] == pytest.approx(candidate(study).worst(pair, at)[0])
    assert -9.5 * at <= mine["breaks_first_nm"] <= 11 * at
