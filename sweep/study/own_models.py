"""Metrics and effects of a user's own: read, named, and tried before any work."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ..base.errors import Fault, StudyError, SweepError
from ..base.own_code import Offered, is_in_file, offers
from ..camera.irradiance import scene_irradiance
from ..camera.own_effects import OwnEffect
from ..camera.scene import Scene
from ..camera.setup import Setup
from ..designs.space import Space
from ..metrics.own import OwnMetric, Readings
from ..metrics.quantity import WORST, Asked
from ..metrics.registry import quantities_of
from ..metrics.smooth import smooth_response
from .model import Study
from .own_codes import allowed, code_of, is_from_outside
from .schema import StudySection
from .sources import Sources
from .yaml_tree import Key

_METRICS: Offered = "sweep.metrics"
_EFFECTS: Offered = "sweep.effects"
_Made = TypeVar("_Made")
_OTHERS = ("design_id", "filter_id", "kind", "name", "space", "cfa", "family", "scenario", "objective")
_VERDICTS = ("limit", "gap", "feasible", "violation", "pareto", "plan", "promised_dn", "status")
RESERVED = (*_OTHERS, *_VERDICTS)
"""Columns that are no quantities."""
_SAME = 1e-9


def own_metrics(section: StudySection, sources: Sources) -> tuple[OwnMetric, ...]:
    """The study's own metrics. Raises StudyError where one cannot be had: its name would be unknown elsewhere."""

    def make(name: str) -> OwnMetric:
        metric = OwnMetric(code_of(sources, name, _METRICS))
        for stated in ("name", "unit", "label", "wanted", "digits"):
            getattr(metric, stated)
        return metric

    metrics = _read_own("metrics", section.metrics, _METRICS, make, sources)
    for name in section.metrics:
        whose = "that file" if is_in_file(name) else "an installed package"
        sources.warnings.append(
            f"{name} runs code of {whose}: the tolerance of {section.tolerance_dn:g} DN is of CSDs, and nothing is "
            "promised or proven of this metric; a search takes its gradient by differences"
        )
    return metrics


def own_effects(section: StudySection, sources: Sources) -> tuple[OwnEffect, ...]:
    """The study's own effects. Raises StudyError where one cannot be had."""

    def make(name: str) -> OwnEffect:
        return OwnEffect(code_of(sources, name, _EFFECTS))

    return _read_own("effects", section.effects, _EFFECTS, make, sources)


def _read_own(
    key: str, names: Sequence[str], group: Offered, make: Callable[[str], _Made], sources: Sources
) -> tuple[_Made, ...]:
    listed = isinstance(sources.document.data.get(key), list)
    made = []
    failed = set[str]()
    for index, name in enumerate(names):
        path: tuple[Key, ...] = (key, index) if listed else (key,)
        if not is_from_outside(name, group, ()):
            sources.unknown(path, key.removesuffix("s"), name, offers(group) or ["FILE.py:NAME"])
        elif allowed(sources, path, name):
            try:
                made.append(make(name))
            except SweepError as error:
                if str(error) not in failed:  # several names may be of one file
                    sources.told(path, error)
                failed.add(str(error))
    if len(made) < len(names):
        raise StudyError(sources.faults)
    return tuple(made)


def try_effects(study: Study, sources: Sources) -> None:
    """Apply the study's own effects in each scenario. Raises StudyError where one fails."""
    for name in study.scenarios if study.own_effects else ():
        try:
            scene_irradiance(study.setup(study.spaces[0], name))
        except SweepError as error:
            sources.told(("effects",), error)
            raise StudyError(sources.faults) from None


def check_names(own: Sequence[OwnMetric], asked: Asked, spaces: Sequence[Space], sources: Sources) -> None:
    """Each column has one meaning. `asked`: what the study asks for. Raises StudyError where one has two."""
    if not own:
        return
    every = replace(asked, own=(), states=asked.classes, any_place=True, edge_shift=True, population=True)
    taken = {*quantities_of(replace(every, probabilities=True, vision=True)), *RESERVED}
    taken |= {name for space in spaces for name in space.parameters}
    for metric in own:
        if metric.name in taken:
            problem = "another column has this name; the metric can say `name`"
            sources.add(("metrics",), problem, metric.name, "another name")
            raise StudyError(sources.faults)
        taken.add(metric.name)


def try_metrics(study: Study, sources: Sources) -> None:
    """Compute own metrics of every CFA, of a light that fills the field. Raises StudyError where one fails."""
    setups = {space.cfa: study.setup(space, next(iter(study.scenarios))) for space in study.spaces} if study.own else {}
    searched = None if study.search is None else study.search.space.cfa
    wanted = {*study.objective.weights, *study.constraints}
    lacking: dict[str, list[str]] = {metric.name: [] for metric in study.own}
    for metric in study.own:
        for cfa, setup in setups.items():
            try:
                lacking[metric.name] += [] if _tried(metric, setup) else [cfa]
            except SweepError as error:
                sources.told(("metrics",), error)
                break  # it fails on the others, too
        if searched in lacking[metric.name] and {metric.name, WORST + metric.name} & wanted:
            sources.add(("metrics",), f"{metric.code.name} gives None for {searched}, which is searched", metric.name)
    if sources.faults:
        raise StudyError(sources.faults)


def _tried(metric: OwnMetric, setup: Setup) -> bool:
    """Return whether a CFA has it; it gives the same alone and beside others. Raises SweepError where it does not.

    Its filters are the curves that they replace, and darker ones.
    """
    plain = replace(setup, scene=Scene(), left_out=frozenset()).with_camera(technologies=())
    base = plain.camera.base_qe[None]
    response = smooth_response(plain, np.concatenate([base, 0.9 * base, 0.8 * base]))[:, 0]
    every = metric.parts(Readings.of_setup(setup, response))
    alone = [metric.parts(Readings.of_setup(setup, response[[at]])) for at in range(len(response))]
    some = [values for values in alone if values is not None]
    if every is None:
        return False
    joined = np.concatenate(some) if len(some) == len(every) else np.empty(0)
    if joined.shape != every.shape or not np.allclose(joined, every, rtol=_SAME, atol=_SAME * np.abs(every).max()):
        raise SweepError(Fault(f"{metric.code.name}: a design's number depends on the designs beside it"))
    return True
