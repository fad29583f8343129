"""Metrics of a user's own: read, named, and tried on plain CFAs before any work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.errors import Fault, StudyError, SweepError
from ..base.own_code import Offered, is_in_file, offers
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

_GROUP: Offered = "sweep.metrics"
_OTHERS = ("design_id", "filter_id", "kind", "name", "space", "cfa", "family", "scenario", "objective")
_VERDICTS = ("limit", "gap", "feasible", "violation", "pareto", "plan", "promised_dn", "status")
RESERVED = (*_OTHERS, *_VERDICTS)
"""Columns that are no quantities."""
_SAME = 1e-9


def own_metrics(section: StudySection, sources: Sources) -> tuple[OwnMetric, ...]:
    """The study's own metrics. Raises StudyError where one cannot be had: what names it would be unknown."""
    given = sources.document.data.get("metrics")
    found, failed = [], set[str]()
    for index, name in enumerate(section.metrics):
        path: tuple[Key, ...] = ("metrics", index) if isinstance(given, list) else ("metrics",)
        if not is_from_outside(name, _GROUP, ()):
            sources.unknown(path, "metric", name, offers(_GROUP) or ["FILE.py:NAME"])
        elif allowed(sources, path, name):
            try:
                metric = OwnMetric(code_of(sources, name, _GROUP))
                _check(metric)
                found.append(metric)
            except SweepError as error:
                if str(error) not in failed:  # several metrics may be of one file
                    sources.told(path, error)
                failed.add(str(error))
                continue
            whose = "that file" if is_in_file(name) else "an installed package"
            sources.warnings.append(
                f"{name} runs code of {whose}: the tolerance of {section.tolerance_dn:g} DN is of CSDs, and nothing is "
                "promised or proven of this metric; a search takes its gradient by differences"
            )
    if len(found) < len(section.metrics):
        raise StudyError(sources.faults)
    return tuple(found)


def _check(metric: OwnMetric) -> None:
    """What it says of itself can be used. Raises SweepError."""
    for said in ("name", "unit", "label", "wanted", "digits"):
        getattr(metric, said)


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
    """Whether a CFA has it; it gives the same alone and beside others. Raises SweepError where it does not.

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
