"""Time of a scene's designs in a process of its own, and their CSDs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np
from threadpoolctl import threadpool_limits

from ..base.errors import Fault, SweepError
from ..base.types import FloatArray, IndexArray
from ..camera.accuracy import Accuracy
from ..camera.forward import ForwardModel
from ..camera.setup import Setup
from ..curves.lights import class_pairs
from ..designs.block import Block, CurveBlock, edges_of_some
from ..designs.space import Space
from ..metrics.evaluate import evaluate
from ..metrics.quantity import BEST_PLACE
from ..metrics.separation import csd_name
from ..results.identity import CHUNK

MANY = 10_000
"""Designs of a large sweep."""
_SHORT_S = 0.1
"""The large sweep is measured where the compared designs take less; what takes longer is not repeated."""
_REPEATS = 3
_DENSE_AXES = 4
_WARM = Accuracy(phases_per_px=1, finest_phase_px=0.25, field_positions=2, pwm_moments=2)
_WARM_DESIGNS = 512
_OTHER_F_NUMBER = 1.1


@dataclass(frozen=True)
class Measured:
    """CSDs, ndarray[n_csds, n_designs], of the designs that fitted into the time, in the order of `spread`.

    `first_s`: time of the first one, the scene's kernels included, s; `following_s`: of each following one, NaN without
    any; `many_s`: of all of a large sweep, None where that was not measured.
    """

    csds: FloatArray
    first_s: float
    following_s: float
    many_s: float | None


def spread(n: int) -> IndexArray:
    """Numbers 0 to n - 1 in an order of which every beginning is spread over the whole range, ndarray[n]; 0 first."""
    golden = (math.sqrt(5) - 1) / 2
    return np.argsort(np.arange(n) * golden % 1.0, kind="stable")


def denser(space: Space) -> Space | None:
    """A grid of at least 10,000 designs between the ends of a space's first axes; None where nothing varies."""
    varied = [at for at, axis in enumerate(space.axes) if max(axis) > min(axis)][:_DENSE_AXES]
    if not varied:
        return None
    count = math.ceil(MANY ** (1 / len(varied)) - 1e-9)
    axes = [
        tuple(np.linspace(min(axis), max(axis), count).tolist()) if at in varied else axis[:1]
        for at, axis in enumerate(space.axes)
    ]
    return replace(space, axes=tuple(axes), gridded=True, rows=None)


def in_new_process(setup: Setup, space: Space, numbers: IndexArray, dense: Space | None, seconds: float) -> Measured:
    """Measure designs of a setup in a process of its own, with one thread; raises SweepError when that is killed.

    Parameters
    ----------
    setup : Setup
        Scene and accuracy.
    space : Space
        Designs.
    numbers : ndarray[n_designs]
        Which of them.
    dense : Space or None
        A denser grid, of which 10,000 designs are measured where the others take less than 0.1 s.
    seconds : float
        Time for the designs that follow the first one, s; those that do not fit in are left out.
    """
    try:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            return pool.submit(_measure, setup, space, numbers, dense, seconds).result()
    except BrokenProcessPool:
        raise SweepError(Fault("the process of a measurement was killed", key="accuracy")) from None


def _measure(setup: Setup, space: Space, numbers: IndexArray, dense: Space | None, seconds: float) -> Measured:
    """CSDs and times of a setup with one thread, in a process that has computed nothing but what warms it up."""
    with threadpool_limits(1):
        _warm_up(setup, space)
        started = time.perf_counter()
        model = ForwardModel(setup)
        csds = [_csds(model, _block(setup, space, numbers[:1]))]
        first_s = time.perf_counter() - started
        rest = numbers[1:]
        if len(rest) * first_s > seconds:  # as many as fit: the first one took longer than one that follows
            rest = _that_fit(model, space, rest, seconds)
        rest_s, many_s = 0.0, None
        if rest.size:
            values, rest_s = _repeated(lambda: _csds(model, _block(setup, space, rest)))
            csds.append(values)
        if dense is not None and rest.size == len(numbers) - 1 and first_s + rest_s < _SHORT_S:
            many_s = first_s + _sweep_s(model, dense)
    return Measured(np.concatenate(csds, axis=1), first_s, rest_s / rest.size if rest.size else math.nan, many_s)


def _repeated(compute: Callable[[], FloatArray]) -> tuple[FloatArray, float]:
    """Result of a computation, and its time, s: the shortest of three, the only one of a long computation."""
    times: list[float] = []
    while len(times) < _REPEATS and sum(times) < _SHORT_S:
        started = time.perf_counter()
        values = compute()
        times.append(time.perf_counter() - started)
    return values, min(times)


def _that_fit(model: ForwardModel, space: Space, numbers: IndexArray, seconds: float) -> IndexArray:
    """Designs, one at least, that are computed in some seconds, going by the time of the first one."""
    started = time.perf_counter()
    _csds(model, _block(model.setup, space, numbers[:1]))
    return numbers[: max(1, int(seconds / (time.perf_counter() - started)))]


def _sweep_s(model: ForwardModel, dense: Space) -> float:
    """Time of all but one of 10,000 designs spread over a dense grid, a chunk of a run at a time, s."""
    numbers = np.arange(1, MANY) * dense.size // MANY
    started = time.perf_counter()
    for start in range(0, len(numbers), CHUNK):
        evaluate(model, _block(model.setup, dense, numbers[start : start + CHUNK]))
    return time.perf_counter() - started


def _warm_up(setup: Setup, space: Space) -> None:
    """Load what a measurement imports and its machine code: a chart, and the scene itself behind another lens."""
    one = replace(space, axes=tuple(axis[:1] for axis in space.axes), gridded=True, rows=None)
    scene = setup.scene
    optics = scene.optics.model_copy(update={"f_number": _OTHER_F_NUMBER * scene.optics.f_number})
    elsewhere = scene.model_copy(update={"optics": optics})
    chart = elsewhere.model_copy(update={"target": None, "field": None})
    for other, n_designs in ((chart, _WARM_DESIGNS), (elsewhere, 2)):
        warm = replace(setup, scene=other, accuracy=_WARM)
        evaluate(ForwardModel(warm), _block(warm, one, np.zeros(n_designs, dtype=np.intp)))


def _block(setup: Setup, space: Space, numbers: IndexArray) -> Block:
    """Designs of a space by their edges where it is separable, as a run takes them; else by their curves."""
    by_edges = edges_of_some(space, numbers)
    return CurveBlock(space.curves(space.points_of(numbers), setup.camera.grid.size)) if by_edges is None else by_edges


def _csds(model: ForwardModel, block: Block) -> FloatArray:
    """All CSDs, those of the best place too where all count, ndarray[n_csds, n_designs]."""
    columns = evaluate(model, block)
    names: Iterable[str] = [csd_name(pair) for pair in class_pairs(model.setup.lights.classes)]
    if model.setup.all_phases:
        names = [*names, *(BEST_PLACE + name for name in names)]
    return np.stack([columns[name] for name in names])
