"""Oracles of upper bounds: a MILP for lights on both sides of each other, and a linear program for one side."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import Bounds, LinearConstraint, milp

from sweep.designs.families.free_form import FreeForm
from sweep.metrics.bound import FEASIBLE, Bound, total_violation
from sweep.metrics.evaluate import designed_quantities
from sweep.metrics.separation import separation
from sweep.metrics.smooth import smooth_response
from sweep.search.problem import Problem
from sweep.search.upper_bound import UpperBound, upper_bound_of

TEXT = """\
study: sides
sensor: {files: [{file: qe.csv, columns: {Y: Y, R: R, C: C}}], clear: C}
lights:
  files:
    - {file: lights.csv, quantity: photons, signals: {yellow: [a], red: [b, c]}}
wavelengths: {start_nm: 400, stop_nm: 700, step_nm: 10}
cfas:
  RYNC: {tile: [[R, Y], [N, C]]}
boxes:
  nodes:
    cfa: RYNC
    family: free_form
    channel: N
    base: Y
    options: {nodes: {start_nm: 520, stop_nm: 700, step_nm: 10}}
objective: csd_yellow_red
constraints:
  sensitivity: {min: 0.9}
  slope_per_nm: {max: 0.06}
search: {starts: 4, max_evaluations: 400}
"""


def halved(values: np.ndarray) -> np.ndarray:
    """Values on the wavelengths with half of the first and the last one, whose bins are half as wide."""
    weighted = np.array(values, dtype=float)
    weighted[..., [0, -1]] /= 2
    return weighted


def write_study(folder: Path) -> Path:
    """Yellow at 600 nm between two reds at 560 and 640 nm, seen through a ramp from 520 to 680 nm."""
    wave = np.arange(400, 701)
    qe = {"Y": np.interp(wave, [520, 680], [0.02, 0.82]), "R": 0 * wave + 0.5, "C": 0 * wave + 0.9}
    lights = {name: np.exp(-0.5 * ((wave - nm) / 6) ** 2) for name, nm in (("a", 600), ("b", 560), ("c", 640))}
    for name, columns in (("qe", qe), ("lights", lights)):
        pd.DataFrame({"wavelength_nm": wave, **columns}).to_csv(folder / f"{name}.csv", index=False)
    path = folder / "sides.yaml"
    path.write_text(TEXT)
    return path


def smallest(problem: Problem, curve: np.ndarray, name: str) -> float:
    """A CSD of the smooth response, the smallest over the places of the light."""
    first, second = (problem.setup.members[kind] for kind in problem.pairs[name])
    response = smooth_response(problem.setup, curve[None, None])[0]
    return min(float(separation(place[None], first, second)[0]) for place in response)


def check_attained(problem: Problem, limit: UpperBound) -> None:
    """The filter of the limit meets everything, and reaches what is said."""
    curves = limit.curve[None, None]
    amounts = designed_quantities(problem.setup, curves)
    amounts |= {n: np.array([smallest(problem, limit.curve, n)]) for n in problem.constraints if n in problem.pairs}
    assert total_violation(amounts, problem.constraints, np.zeros(1))[0] <= FEASIBLE
    assert ((limit.curve >= 0) & (limit.curve <= problem.setup.camera.base_qe[0])).all()
    reached = min(w * smallest(problem, limit.curve, name) for name, w in problem.objective.weights.items())
    assert reached == pytest.approx(limit.attained, rel=1e-12)


@dataclass
class Pairs:
    """Pairs of signals: difference per QE of N, squared distance in the other channels, least CSD, least CSD per objective."""

    apart: np.ndarray
    squared: np.ndarray
    least: np.ndarray
    rate: np.ndarray


def pairs_of(problem: Problem) -> Pairs:
    """Every pair whose CSD is an objective or constrained, by probing the response wavelength by wavelength."""
    setup, size, channel = problem.setup, problem.setup.camera.grid.size, problem.setup.camera.modified[0]
    dark = smooth_response(setup, np.zeros((1, 1, size)))[0]
    gain = smooth_response(setup, np.eye(size)[:, None])[..., channel] - dark[..., channel]
    found = []
    for name, kinds in problem.pairs.items():
        weight, bound = problem.objective.weights.get(name), problem.constraints.get(name)
        if weight is None and bound is None:
            continue
        for one in setup.members[kinds[0]]:
            for other in setup.members[kinds[1]]:
                for place in range(len(dark)):
                    rest = np.delete(dark[place, one] - dark[place, other], channel)
                    least, rate = 0.0 if bound is None else bound.min, 0.0 if weight is None else 1 / weight
                    found.append((gain[:, place, one] - gain[:, place, other], rest @ rest, least, rate))
    return Pairs(*(np.array(column) for column in zip(*found, strict=True)))


def is_mixed(problem: Problem, curve: np.ndarray | None) -> bool:
    """Whether pairs of a CSD lie on both sides."""
    apart = pairs_of(problem).apart @ curve
    return bool((apart > 0).any() and (apart < 0).any())


def milp_limit(problem: Problem, t: float) -> float:
    """t and the largest margin above it, by a MILP with a binary per pair; exactly the limit where the other channels do
    not matter, and below t where no filter reaches t.
    """
    pairs, base = pairs_of(problem), problem.setup.camera.base_qe[0]
    needed = np.sqrt(np.maximum(np.maximum(pairs.least, t * pairs.rate) ** 2 - pairs.squared, 0))
    requested = needed > 0
    apart, needed, rate = pairs.apart[requested], needed[requested], pairs.rate[requested, None]
    size, n = base.size, len(apart)
    # Variables N, a binary per pair, the margin. Above: apart @ N >= needed + rate margin - (1 - z) big; else below.
    most = needed + rate[:, 0] * (t + 1)
    above, below = most - np.minimum(apart, 0) @ base, most + np.maximum(apart, 0) @ base
    step, none = np.diff(np.eye(size), axis=0), np.zeros((size - 1, n + 1))
    slope = problem.constraints["slope_per_nm"].max * problem.setup.camera.grid.step_nm
    found = milp(
        np.append(np.zeros(size + n), -1.0),
        constraints=[
            LinearConstraint(np.hstack([apart, -np.diag(above), -rate]), needed - above, np.inf),
            LinearConstraint(np.hstack([-apart, np.diag(below), -rate]), needed, np.inf),
            LinearConstraint(np.hstack([step, none]), -slope, slope),
            LinearConstraint(
                np.concatenate([halved(np.ones(size)), np.zeros(n + 1)]),
                problem.constraints["sensitivity"].min * halved(base).sum(),
                np.inf,
            ),
        ],
        integrality=np.concatenate([np.zeros(size), np.ones(n), [0]]),
        bounds=Bounds(np.concatenate([np.zeros(size + n), [-t - 1]]), np.concatenate([base, np.ones(n), [t + 1]])),
        options={"mip_rel_gap": 0.0},
    )
    assert found.status in (0, 2)  # solved, or proven that not even the margin of -t - 1 is in reach
    return t + float(found.x[-1]) if found.status == 0 else -np.inf


def limit_checked_by_milp(problem: Problem) -> UpperBound:
    """The upper bound of a problem, once it was compared with the MILP."""
    limit = upper_bound_of(problem)
    check_attained(problem, limit)
    assert limit.open_parts == 0
    assert 0 <= limit.proven - limit.attained <= 1e-3
    assert milp_limit(problem, limit.proven + 1e-3) < limit.proven + 1e-3
    return limit


def random_problem(template: Problem, seed: int) -> Problem:
    """3 to 8 lights of each type anywhere, under a random curve; the other channels are flat, or nearly."""
    rng = np.random.default_rng(seed)
    wave = template.setup.camera.grid.nodes_nm
    counts = 3 + rng.binomial(5, 0.2, 2)
    photons = np.concatenate(
        [
            np.exp(-0.5 * ((wave - rng.uniform(*ends, (count, 1))) / rng.uniform(8, 25, (count, 1))) ** 2)
            for count, ends in zip(counts, ((480, 640), (500, 680)), strict=True)
        ]
    )
    photons /= halved(photons).sum(axis=1, keepdims=True) * template.setup.camera.grid.step_nm
    types = ("yellow",) * counts[0] + ("red",) * counts[1]
    lights = replace(template.setup.lights, names=tuple(map(str, range(counts.sum()))), types=types, photons=photons)
    base = np.interp(wave, np.linspace(400, 700, 7), rng.uniform(0.05, 0.85, 7))
    qe = template.setup.camera.qe.copy()
    qe[template.setup.camera.modified[0]] = base
    qe[0] = 0.5 + (seed % 2) * 0.02 * np.interp(wave, [500, 680], [0, 1])
    qe[1] = 0.3
    family = FreeForm(wave, base, np.arange(400.0, 701.0, 20.0))
    return replace(
        template,
        setup=replace(template.setup, lights=lights).with_camera(qe=qe),
        family=family,
        low=np.zeros(family.nodes_nm.size),
        high=np.ones(family.nodes_nm.size),
        constraints={"sensitivity": Bound(min=rng.uniform(0.5, 0.95)), "slope_per_nm": Bound(max=0.06)},
    )
