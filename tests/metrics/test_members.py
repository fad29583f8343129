"""Worst cases over a population of lights: beside spectra that are shifted one by one, and a search for the worst."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.optimize import minimize

from sweep.metrics.members import population_model
from sweep.spectra.population import Population
from sweep.study import load_study

from ..cases import thinned
from ..conftest import STUDIES

STUDY = load_study(STUDIES / "stopband.yaml")
assert STUDY.search is not None
PROBLEM = STUDY.problem(STUDY.search)
WAVE = STUDY.grid.nodes_nm
ENDS = np.array([WAVE[0] - 1, *WAVE, WAVE[-1] + 1])
"""A grid of 1 nm, at whose ends a spectrum falls to nothing."""
DESIGNS = np.array([[612.8, 6.0, 651.1, 6.3, 1.0], [617.0, 6.1, 655.0, 6.2, 1.0], [600.0, 20.0, 660.0, 10.0, 1.0]])
STREET = {"temperature_c": [-40, 85], "self_heating_k": 20}
POPULATIONS = {
    "drift": STREET,
    "independent": {**STREET, "temperatures": "independent"},
    "bins": {**STREET, "binning_nm": 2, "drift_nm_per_k": {"yellow": 0.13, "us_03_red": 0.02}},
    "aged": {"binning_nm": {"red": 0.7}, "ageing_nm": {"yellow": [-0.3, 1.9]}, "width": [0.9, 1, 1.2]},
}


def population(name: str) -> Population:
    return Population.model_validate(POPULATIONS[name])


@cache
def worst(name: str) -> np.ndarray:
    lights = replace(STUDY.lights, population=population(name))
    curves = PROBLEM.family.curves(DESIGNS)
    return population_model(replace(PROBLEM.setup, lights=lights)).worst(curves, [("yellow", "red")])["csd_yellow_red"]


HALVED = np.ones(WAVE.size)
HALVED[[0, -1]] = 0.5
"""Each end of the range has half a bin."""


def responses(spectra: np.ndarray) -> np.ndarray:
    """DN of spectra, [n_designs, n, n_channels], from the white patch: RYNCy's brightest plain channel sets it."""
    qe, grid = STUDY.sensor.qe, STUDY.grid
    dn = 0.95 * 4095 * STUDY.lights.photon_ratio * grid.span_nm / max(trapezoid(qe[name]) for name in ("R", "Y", "Cy"))
    plain = np.stack([qe[name] for name in ("R", "Y", "Cy")])
    curves = [np.vstack([plain, curve]) for curve in PROBLEM.family.curves(DESIGNS)]
    return np.stack([(spectra * HALVED) @ each.T for each in curves]) * dn


def shifted(photons: np.ndarray, nm: float, width: float = 1.0) -> np.ndarray:
    if width != 1:
        middle = (WAVE * photons).sum() / photons.sum()
        wide = np.interp(middle + (WAVE - middle) / width, WAVE, photons, left=0, right=0)
        photons = wide * photons.sum() / wide.sum()
    return np.interp(WAVE - nm, ENDS, np.concatenate([[0.0], photons, [0.0]]), left=0, right=0)


def ends(value: object, name: str, kind: str, default: object) -> object:
    return value.get(name, value.get(kind, default)) if isinstance(value, dict) else value


def one_shift(given: dict[str, object], signal: int, warmer: float, own: float) -> float:
    """Of a signal, nm; `own`: from 0 to 1, between the ends of what it has for itself."""
    name, kind = STUDY.lights.names[signal], STUDY.lights.types[signal]
    drift = ends(given.get("drift_nm_per_k", 0.1), name, kind, 0.1)
    binning = ends(given.get("binning_nm", 0.0), name, kind, 0.0)
    low, high = ends(given.get("ageing_nm", [0.0, 0.0]), name, kind, [0.0, 0.0])  # type: ignore[misc]
    return drift * warmer + low - binning + own * (high - low + 2 * binning)  # type: ignore[operator, no-any-return]


def warmths(given: dict[str, object], u: np.ndarray) -> np.ndarray:
    low, high = (-65.0, 80.0) if "temperature_c" in given else (0.0, 0.0)
    both = u if given.get("temperatures") == "independent" else np.repeat(u[..., :1], 2, axis=-1)
    return low + both * (high - low)


def distance(name: str, signals: tuple[int, int], widths: tuple[float, float], u: np.ndarray) -> np.ndarray:
    """Of two members, each design; `u`: warmth of both, and what both have for themselves, 0 to 1."""
    given, warm = POPULATIONS[name], warmths(POPULATIONS[name], u[:2])
    spectra = [
        shifted(STUDY.lights.photons[s], one_shift(given, s, warm[k], u[2 + k]), widths[k])
        for k, s in enumerate(signals)
    ]
    found = responses(np.stack(spectra))
    return np.linalg.norm(found[:, 0] - found[:, 1], axis=1)


def drawn(name: str, n: int) -> tuple[np.ndarray, list[tuple[int, int]], list[tuple[float, float]], np.ndarray]:
    """Distances of random members, [n_designs, n], with what was drawn."""
    rng, members = np.random.default_rng(5), STUDY.lights.members
    factors = POPULATIONS[name].get("width", [1.0])
    signals = [(int(rng.choice(members["yellow"])), int(rng.choice(members["red"]))) for _ in range(n)]
    widths = [tuple(map(float, rng.choice(factors, 2))) for _ in range(n)]  # type: ignore[arg-type]
    u = rng.random((n, 4))
    u[: n // 2] = np.round(u[: n // 2])  # half of them at the ends
    found = np.stack([distance(name, s, w, v) for s, w, v in zip(signals, widths, u, strict=True)], axis=1)  # type: ignore[arg-type]
    return found, signals, widths, u  # type: ignore[return-value]


@pytest.mark.parametrize("name", thinned(POPULATIONS))
def test_neither_random_members_nor_a_local_search_are_nearer(name: str) -> None:
    found, signals, widths, u = drawn(name, 600)
    assert (found >= worst(name)[:, None] - 1e-9).all()
    for design in range(len(DESIGNS)):
        for at in np.argsort(found[design])[:2]:
            start = minimize(
                lambda v, at=at, design=design: distance(name, signals[at], widths[at], v)[design],
                u[at],
                bounds=[(0, 1)] * 4,
                method="Nelder-Mead",
                options={"xatol": 1e-7, "fatol": 1e-7, "maxiter": 200},
            )
            assert start.fun >= worst(name)[design] - 1e-9


@pytest.mark.parametrize("name", thinned(POPULATIONS))
def test_the_nearest_members_are_members_and_so_far_apart(name: str) -> None:
    """What it says the nearest two are, computed from their shifts."""
    lights = replace(STUDY.lights, population=population(name))
    seen = population_model(replace(PROBLEM.setup, lights=lights))
    response = seen.linear.smooth(PROBLEM.family.curves(DESIGNS))[:, 0]
    widths = POPULATIONS[name].get("width", [1.0])
    for design in range(len(DESIGNS)):
        near = seen.nearest(response[design], ("yellow", "red"))
        one, other, _ = np.unravel_index(int(near.squared.argmin()), near.squared.shape)
        assert near.squared.min() == pytest.approx(worst(name)[design] ** 2, rel=1e-12)
        rows, spectra = (int(near.first[one]), int(near.second[other])), []
        for side, row in enumerate(rows):
            signal = seen.members.signal(row)
            nm = seen.members.shift_nm(int(near.steps[one, other, 0, side]), float(near.shares[one, other, 0, side]))
            low, high = (one_shift(POPULATIONS[name], signal, warm, own) for warm, own in ends_of(name))
            assert low - 1e-9 <= nm <= high + 1e-9
            factor = widths[row // seen.members.n_steps % len(widths)]  # type: ignore[index, arg-type]
            spectra.append(shifted(STUDY.lights.photons[signal], nm, factor))
        found = responses(np.stack(spectra))[design]
        assert np.linalg.norm(found[0] - found[1]) == pytest.approx(worst(name)[design], rel=1e-9)


def ends_of(name: str) -> tuple[tuple[float, float], tuple[float, float]]:
    low, high = warmths(POPULATIONS[name], np.array([0.0, 0.0]))[0], warmths(POPULATIONS[name], np.ones(2))[0]
    return (float(low), 0.0), (float(high), 1.0)
