"""Code of a user's own that a study names: allowed or refused, read, digested, and tried before any work."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from pydantic import ValidationError

from ..base.disk import is_file
from ..base.errors import Fault, SweepError, ValidationIssue, faults_of, unknown
from ..base.user_code import (
    CODE_OF,
    Installed,
    Offered,
    UserCode,
    beside,
    file_of,
    installed,
    is_in_file,
    offers,
    read_code,
)
from ..camera.irradiance import scene_irradiance
from ..camera.scene import Scene
from ..camera.setup import Setup
from ..camera.user_effects import UserEffect
from ..designs.space import Space
from ..metrics.quantity import WORST, RequestedQuantities
from ..metrics.registry import every_feature, quantities_of
from ..metrics.smooth import smooth_response
from ..metrics.user_metrics import Readings, UserMetric
from ..spectra.formats import digest
from .model import Study
from .schema import StudySection
from .schema_curves import LightsSection, SensorSection
from .sources import Sources
from .tree import KeyPath

_Curves = TypeVar("_Curves", SensorSection, LightsSection)
_Made = TypeVar("_Made")
RESERVED = (
    *("design_id", "filter_id", "kind", "name", "space", "cfa", "family", "scenario", "objective"),
    *("upper_bound", "gap", "feasible", "violation", "pareto", "simulation_key", "omitted_effects_bound_dn", "status"),
)
"""Columns that are no quantities."""
_SAME = 1e-9


def is_from_outside(name: str, group: Offered, known: Iterable[str]) -> bool:
    """Return True if a name refers to code of a file or an installed package.

    False for built-in and unknown names.
    """
    return is_in_file(name) or (name not in known and name in offers(group))


def allowed(sources: Sources, path: KeyPath, name: str) -> bool:
    """Return True if code may run; add an issue otherwise.

    True if `--allow-code` or `allow_code` was given.
    """
    if not sources.allow_code:
        whose = "a Python file" if is_in_file(name) else "a plugin of an installed package"
        problem = f"the study names {whose}, whose code would run"
        sources.refuse(Fault(path, problem, name, "--allow-code, if you trust it"))
    return bool(sources.allow_code)


def code_of(sources: Sources, name: str, group: Offered) -> UserCode:
    """Read code of a file or an installed package, and record its digest.

    Raises SweepError if it does not exist.
    """
    if not is_in_file(name):
        offer = installed(group, name)
        if offer is None:
            raise SweepError(ValidationIssue("no installed package offers it", value=name))
        _digested(sources, f"{CODE_OF}{offer.description} ({group}: {name})", offer.digest)
        return UserCode(name, None, group, offer.digest)
    file = file_of(name)
    place = next((folder / file for folder in sources.folders if is_file(folder / file)), None)
    if place is None:
        raise SweepError(ValidationIssue("no such file", value=file, allowed=f"a path relative to {sources.searched}"))
    source, own = read_code(place)
    _digested(sources, file, own)
    for needed in beside(place, source):
        _digested(sources, f"{CODE_OF}{file}: {needed.relative_to(place.parent).as_posix()}", digest(needed))
    return UserCode(name, source)


def _digested(sources: Sources, name: str, digest: str) -> None:
    """Note the digest; raises SweepError where only other code may run."""
    if not isinstance(sources.allow_code, bool) and sources.allow_code.get(name) != digest:
        raise SweepError(ValidationIssue("not the code that the run had", value=name))
    sources.digests[name] = digest


def offered_curves(sources: Sources, at: KeyPath, section: _Curves, group: Offered, known: Iterable[str]) -> _Curves:
    """Return a section with the keys that an installed package provides.

    A package provides a mapping with `files`, which it contains, or a function that returns one. Keys of the study
    take
    precedence.

    Returns unchanged if it names no package. Raises StudyError if the package cannot be used.
    """
    name = section.builtin
    if name is None or not is_from_outside(name, group, known):
        return section
    if not allowed(sources, at, name):
        raise sources.error
    try:
        code = code_of(sources, name, group)
        stated = code.called(code.loaded) if callable(code.loaded) else code.loaded
        if not isinstance(stated, Mapping) or stated.get("builtin") == name:
            raise SweepError(
                ValidationIssue(f"{name} says nothing of curves", value=stated, allowed="a mapping with `files`")
            )
        curves: _Curves = type(section).model_validate(dict(stated))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        sources.refuse(Fault(at, f"the plugin gives no such section: {where}: {first['msg']}", name))
        raise sources.error from None
    except SweepError as error:
        sources.refuse(*faults_of(at, error))
        raise sources.error from None
    package: Installed | None = installed(group, name)
    sources.folders = [*([] if package is None else package.folders), *sources.folders]
    added = {key: getattr(section, key) for key in section.model_fields_set - {"builtin", "files"}}
    return curves.model_copy(update={"name": curves.name or name, "files": [*curves.files, *section.files], **added})


def user_metrics(section: StudySection, sources: Sources) -> tuple[UserMetric, ...]:
    """Load the user's metrics.

    Raises StudyError if one cannot be loaded.
    """

    def make(code: UserCode) -> UserMetric:
        metric = UserMetric(code)
        for stated in ("name", "unit", "label", "direction", "digits"):
            getattr(metric, stated)
        return metric

    metrics = _read_user_code("metrics", section.metrics, "sweep.metrics", make, sources)
    for name in section.metrics:
        whose = "that file" if is_in_file(name) else "an installed package"
        sources.warnings.append(
            f"{name} runs code of {whose}: the tolerance of {section.tolerance_dn:g} DN is of CSDs, and nothing is "
            "promised or proven of this metric; a search takes its gradient by differences"
        )
    return metrics


def user_effects(section: StudySection, sources: Sources) -> tuple[UserEffect, ...]:
    """Load the user's effects.

    Raises StudyError if one cannot be loaded.
    """
    return _read_user_code("effects", section.effects, "sweep.effects", UserEffect, sources)


def _read_user_code(
    key: str, names: Sequence[str], group: Offered, make: Callable[[UserCode], _Made], sources: Sources
) -> tuple[_Made, ...]:
    is_list = isinstance(sources.document.data.get(key), list)
    loaded, failed = [], set[str]()
    for index, name in enumerate(names):
        path: KeyPath = (key, index) if is_list else (key,)
        if not is_from_outside(name, group, ()):
            sources.refuse(unknown(path, key.removesuffix("s"), name, offers(group) or ["FILE.py:NAME"]))
        elif allowed(sources, path, name):
            try:
                loaded.append(make(code_of(sources, name, group)))
            except SweepError as error:
                if str(error) not in failed:  # several names may be of one file
                    sources.refuse(*faults_of(path, error))
                failed.add(str(error))
    if len(loaded) < len(names):
        raise sources.error
    return tuple(loaded)


def try_effects(study: Study) -> Iterator[Fault]:
    """Apply the user's effects in every scenario, up to the first that fails."""
    for name in study.scenarios if study.user_effects else ():
        try:
            scene_irradiance(study.setup(study.spaces[0], name))
        except SweepError as error:
            yield from faults_of(("effects",), error)
            return


def check_names(
    user_metrics: Sequence[UserMetric], requested: RequestedQuantities, spaces: Sequence[Space]
) -> Iterator[Fault]:
    """Check that every column has a single meaning."""
    if not user_metrics:
        return
    widest = replace(
        requested, user_metrics=(), states=requested.classes, any_place=True, edge_shift=True, population=True
    )
    taken = {*quantities_of(replace(widest, features=every_feature())), *RESERVED}
    taken |= {name for space in spaces for name in space.parameters}
    for metric in user_metrics:
        if metric.name in taken:
            problem = "another column has this name; the metric can say `name`"
            yield Fault(("metrics",), problem, metric.name, "another name")
            return
        taken.add(metric.name)


def try_metrics(study: Study) -> Iterator[Fault]:
    """Compute the user's metrics of every CFA, for a light that fills the field."""
    if not study.user_metrics:
        return
    setups = {space.cfa: study.setup(space, next(iter(study.scenarios))) for space in study.spaces}
    searched = None if study.search is None else study.search.space.cfa
    requested = {*study.objective.weights, *study.constraints}
    for metric in study.user_metrics:
        without: list[str] = []
        try:
            without = [cfa for cfa, setup in setups.items() if not _tried(metric, setup)]
        except SweepError as error:
            yield from faults_of(("metrics",), error)  # it fails on the other CFAs, too
        if searched in without and {metric.name, WORST + metric.name} & requested:
            problem = f"{metric.code.name} gives None for {searched}, which is searched"
            yield Fault(("metrics",), problem, metric.name)


def _tried(metric: UserMetric, setup: Setup) -> bool:
    """Return whether a CFA has it; it gives the same alone and beside others. Raises SweepError where it does not.

    Its filters are the curves that they replace, and darker ones.
    """
    plain = replace(setup, scene=Scene(), left_out=frozenset()).with_camera(technologies=())
    base = plain.camera.base_qe[None]
    response = smooth_response(plain, np.concatenate([base, 0.9 * base, 0.8 * base]))[:, 0]
    together = metric.parts(Readings.of_setup(setup, response))
    alone = [metric.parts(Readings.of_setup(setup, response[[at]])) for at in range(len(response))]
    parts = [values for values in alone if values is not None]
    if together is None:
        return False
    joined = np.concatenate(parts) if len(parts) == len(together) else np.empty(0)
    if joined.shape != together.shape or not np.allclose(
        joined, together, rtol=_SAME, atol=_SAME * np.abs(together).max()
    ):
        raise SweepError(ValidationIssue(f"{metric.code.name}: a design's number depends on the designs beside it"))
    return True
