"""What single settings cost: one knob at a time, its error in a CSD and its time, everything else as it is."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...base.errors import SweepError
from ...base.types import FloatArray, IndexArray
from ...camera.effects import blur, noise, phase
from ...camera.forward import ForwardModel
from ...camera.linear import LinearModel
from ...camera.methods import REFERENCE, Methods
from ...camera.registry import EFFECTS
from ...camera.view import View
from ...metrics.separation import separations
from ...study import Study

STEPS = (10.0, 5.0, 2.0, 1.0, 0.5)
"""Wavelength steps that are compared, in units of the study's own."""
_FINEST = 0.125
_DRAWS = (10, 30, 100, 300, 1000)
_REPEATS = 5
_PLACES_PER_PIXEL = 8
_SMOOTH = replace(REFERENCE, noise="skip", quantization="skip", saturation="skip", pedestal="skip")
"""The linear effects alone: rounding would hide what a knob of theirs changes."""
Regridded = Callable[[float], Study]


@dataclass(frozen=True)
class Setting:
    """One setting of a knob: the largest error of a CSD against `oracle` (DN), and the time it takes, s."""

    knob: str
    scenario: str
    setting: str
    error_dn: float
    seconds: float
    oracle: str


def knob_measurements(study: Study, regridded: Regridded, most_designs: int) -> list[Callable[[], Iterator[Setting]]]:
    """A measurement for each knob, in the first scenario that has it.

    `regridded` gives the study with another wavelength step, nm.
    """
    names = list(study.scenarios)
    targets = [name for name in names if study.scenarios[name].target is not None]
    anywhere = [name for name in targets if not phase.one_is_enough(_one(study, name)[0])]
    noisy = [name for name in targets or names if study.scenarios[name].noise is not None]
    found: list[Callable[[], Iterator[Setting]]] = [
        partial(_wavelength_step, study, names[0], regridded, most_designs),
        partial(_precision, study, names[0], most_designs),
    ]
    if targets:
        looked_at, spread = "wavelengths at which QE is looked at", "wavelengths of the point spread function"
        found.append(partial(_methods, study, targets[0], "quadrature", looked_at, most_designs))
        found.append(partial(_methods, study, (anywhere or targets)[0], "blur", spread, most_designs))
    found += [partial(_places, study, name) for name in anywhere[:1]]
    found += [partial(_draws, study, name) for name in noisy[:1]]
    return found


def _one(study: Study, scenario: str) -> tuple[View, FloatArray]:
    """View and curves of one design: the first of the study's last space."""
    space = [space for space in study.spaces if space.size][-1]
    return study.view(space, scenario), space.curves(space.points(0, 1), study.grid.size)


def _distances(response: FloatArray, members: dict[str, IndexArray]) -> FloatArray:
    """All CSDs, the smallest over the cases, ndarray[n_pairs, n_designs]."""
    cases = [list(separations(response[:, case], members).values()) for case in range(response.shape[1])]
    return np.asarray(np.min(cases, axis=0), dtype=float)


def _csds(study: Study, scenario: str, methods: Methods, most_designs: int, **how: Any) -> tuple[FloatArray, float]:
    """CSDs of the smooth response of all spaces' first designs, and the time, kernels included."""
    spaces = [space for space in study.spaces if space.size]
    blur.PROFILES.clear()
    started = time.perf_counter()
    found = []
    for space in spaces:
        view = replace(study.view(space, scenario), methods=methods)
        curves = space.curves(space.points(0, min(space.size, most_designs)), study.grid.size)
        found.append(_distances(LinearModel(view, Counter(), **how).smooth(curves), view.members))
    return np.concatenate(found, axis=1), time.perf_counter() - started


def _wavelength_step(study: Study, scenario: str, regridded: Regridded, most_designs: int) -> Iterator[Setting]:
    own = study.grid.step_nm
    try:
        exact = _csds(regridded(_FINEST * own), scenario, _SMOOTH, most_designs)[0]
    except SweepError:  # the study's curves don't go that fine
        return
    for factor in STEPS:
        try:
            found, seconds = _csds(regridded(factor * own), scenario, _SMOOTH, most_designs)
        except SweepError:  # this step does not divide the study's range
            continue
        error = float(np.abs(found - exact).max())
        yield Setting("wavelength step", scenario, f"{factor * own:g} nm", error, seconds, f"{_FINEST * own:g} nm")


def _methods(study: Study, scenario: str, effect: str, knob: str, most_designs: int) -> Iterator[Setting]:
    exact, _ = _csds(study, scenario, _SMOOTH, most_designs)
    for method in EFFECTS[effect].methods:
        found, seconds = _csds(study, scenario, replace(_SMOOTH, **{effect: method}), most_designs)
        yield Setting(knob, scenario, method, float(np.abs(found - exact).max()), seconds, EFFECTS[effect].reference)


def _places(study: Study, scenario: str) -> Iterator[Setting]:
    """Places of the light on the mosaic, of one design, against a grid twice as fine as the finest."""
    view, curves = _one(study, scenario)
    view, members = replace(view, methods=_SMOOTH), view.members
    target = view.scenario.target
    assert target is not None
    rows, columns = view.mosaic.indices.shape
    exact: FloatArray = np.array(np.inf)
    for y in range(rows * _PLACES_PER_PIXEL):
        for x in range(columns * _PLACES_PER_PIXEL):
            at = target.model_copy(update={"phase_px": (x / _PLACES_PER_PIXEL, y / _PLACES_PER_PIXEL)})
            there = replace(view, scenario=view.scenario.model_copy(update={"target": at}))
            exact = np.minimum(exact, _distances(LinearModel(there).smooth(curves), members))
    for method in phase.LATTICES:
        blur.PROFILES.clear()
        started = time.perf_counter()
        imager = LinearModel(replace(view, methods=replace(_SMOOTH, phase=method)))
        found = _distances(imager.smooth(curves), members)
        seconds = time.perf_counter() - started
        oracle = f"every 1/{_PLACES_PER_PIXEL} pixel"
        yield Setting("places on the mosaic", scenario, method, float(np.abs(found - exact).max()), seconds, oracle)


def _draws(study: Study, scenario: str) -> Iterator[Setting]:
    """The mean of Monte Carlo readouts of every pixel against the closed form, for one design and place."""
    view, curves = _one(study, scenario)
    imager = ForwardModel(replace(view, methods=REFERENCE))
    started = time.perf_counter()
    exact = _distances(imager.read_with_noise(curves).mean[:, :1], view.members)
    closed_s = time.perf_counter() - started
    electrons = imager.pixel_electrons(curves)[0, 0]
    for draws in _DRAWS:
        rng = np.random.default_rng((study.section.seed, draws))
        errors = []
        started = time.perf_counter()
        for _ in range(_REPEATS):
            drawn = noise.draws_dn(np.broadcast_to(electrons, (draws, *electrons.shape)), imager.readout.pixel, rng)
            channels = imager.readout.channels_of(drawn.mean(axis=0), 0)
            errors.append(np.abs(_distances(channels[None, None], view.members) - exact).max())
        seconds = (time.perf_counter() - started) / _REPEATS
        error = float(np.sqrt(np.mean(np.square(errors))))
        yield Setting("Monte Carlo draws", scenario, f"{draws} draws", error, seconds, "closed form")
    yield Setting("Monte Carlo draws", scenario, "closed form", 0.0, closed_s, "closed form")


def _precision(study: Study, scenario: str, most_designs: int) -> Iterator[Setting]:
    """The product of curves and scene in single precision against double."""
    exact, double_s = _csds(study, scenario, _SMOOTH, most_designs)
    found, single_s = _csds(study, scenario, _SMOOTH, most_designs, dtype=np.float32)
    error = float(np.abs(found - exact).max())
    yield Setting("precision of the product", scenario, "float32", error, single_s, "float64")
    yield Setting("precision of the product", scenario, "float64", 0.0, double_s, "float64")
