"""Looks at designs for the tables of the report, all read from one forward model of the scene."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.forward import AllPhases, ForwardModel, forward_model
from ..camera.setup import Setup
from ..curves.lights import Pair
from ..metrics.limiting import limiting_lights
from ..metrics.recognition import recognize
from ..results.designs import computed_rows, row_curves
from ..results.tables import FEW, FOUND, LIMITED_BY, POINTS, RECOGNITION
from ..study import Study

if TYPE_CHECKING:
    import pandas as pd

_AT_ONCE = 64
_Row = Mapping[Hashable, Any]
_Seen = tuple[int, FloatArray, frozenset[str]]
"""A design's id, its curves, ndarray[1, n_modified, n_wavelengths], and for which tables it is looked at."""


@dataclass(frozen=True)
class Look:
    """What is seen of a design, as far as it was looked for.

    `limited_by`: of each pair of types the two lights that limit its separation; `dn`: digital numbers at the first
    place, ndarray[n_signals, n_channels]; `recognized`: see `recognize`.
    """

    limited_by: Mapping[Pair, str | None] | None = None
    dn: FloatArray | None = None
    recognized: Mapping[str, float] | None = None


@dataclass(frozen=True)
class Looking:
    """How a study looks at designs. `tables`: those that are to be made; `drawn`: the scenario of which signals are
    drawn; `states`, `patches`, `seed`: of raw patches.
    """

    tables: frozenset[str]
    drawn: str
    states: tuple[str, ...]
    patches: int
    seed: int

    @classmethod
    def of(cls, study: Study, tables: Collection[str]) -> Looking:
        """For some of a study's tables."""
        asked = study.section.recognition
        patches = 0 if asked is None else asked.patches or 0
        first = next(iter(study.scenarios))
        return cls(
            frozenset({LIMITED_BY, POINTS, RECOGNITION} & {*tables}), first, study.states, patches, study.section.seed
        )

    def wanted(self, kind: str, scenario: str, *, on_front: bool = False) -> frozenset[str]:
        """For which tables a row is looked at."""
        found = {LIMITED_BY}
        if on_front or scenario == self.drawn or kind == FOUND:
            found.add(POINTS)
        if self.patches and kind in FEW:
            found.add(RECOGNITION)
        return self.tables & found

    def at(self, setup: Setup, seen: _Seen) -> Look:
        """Look at a design. The random numbers of its patches follow from the study's seed and its id."""
        design_id, curves, wanted = seen
        imager = forward_model(setup, AllPhases if RECOGNITION in wanted else ForwardModel)
        limited_by = dn = recognized = None
        if wanted & {LIMITED_BY, POINTS}:
            response = imager.read(curves)[0]
            limited_by = {pair: lights[0] for pair, lights in limiting_lights(setup, response).items()}
            dn = response[0, 0].copy()
        if RECOGNITION in wanted:
            rng = np.random.default_rng((self.seed, design_id))
            assert isinstance(imager, AllPhases)
            recognized = recognize(imager, curves, self.states, self.patches, rng)
        return Look(limited_by, dn, recognized)


def looks_of(
    study: Study,
    looking: Looking,
    rows: pd.DataFrame,
    on_front: pd.DataFrame,
    parallel: Parallel,
    progress: Progress,
) -> dict[int, Look]:
    """Looks at the designs to draw and those on the front, by their ids."""
    found: dict[int, Look] = {}
    groups: dict[tuple[str, ...], list[_Seen]] = {}
    setups: dict[tuple[str, ...], Setup] = {}
    for row, wanted in _shown(looking, rows, on_front):
        if wanted:
            space, curves = row_curves(study, row)
            key = (str(row["scenario"]), space.cfa, *(() if space.filter is None else space.filter.channels))
            setups.setdefault(key, study.setup(space, key[0]))
            groups.setdefault(key, []).append((int(row["design_id"]), curves, wanted))
    parts = [
        (setups[key], own[start : start + _AT_ONCE])
        for key, own in groups.items()
        for start in range(0, len(own), _AT_ONCE)
    ]
    # The CFAs of a scene share its kernels: in one call, where few designs of each are looked at.
    calls: list[list[tuple[Setup, list[_Seen]]]] = []
    for _, own_parts in groupby(parts, lambda part: part[0].scene):
        scene = list(own_parts)
        calls += [scene] if sum(len(designs) for _, designs in scene) <= _AT_ONCE else [[part] for part in scene]
    for looks in parallel(delayed(_looked, looking, call) for call in calls):
        found |= looks
        progress("lights and patches", len(found), sum(map(len, groups.values())))
    return found


def _shown(looking: Looking, rows: pd.DataFrame, on_front: pd.DataFrame) -> Iterator[tuple[_Row, frozenset[str]]]:
    """Rows that are shown, each once, and for which tables they are looked at; not those that failed."""
    front = {*on_front["design_id"]}
    for row in computed_rows(rows, on_front):
        kind, scenario = str(row["kind"]), str(row["scenario"])
        yield row, looking.wanted(kind, scenario, on_front=row["design_id"] in front)


def _looked(looking: Looking, parts: Sequence[tuple[Setup, Sequence[_Seen]]]) -> dict[int, Look]:
    return {seen[0]: looking.at(setup, seen) for setup, designs in parts for seen in designs}
