"""Counted work of one design in the scenes of `studies/accuracy.yaml`: `python -m tests.work` keeps it.

Counts do not depend on the machine, unlike seconds: functions of the package that are entered, values that the camera
reads out, brightness curves that are walked along and followed, and evaluations of the search of `stopband`.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from sweep.camera.model import SceneModel
from sweep.camera.readout import Merged, ReadOnce
from sweep.metrics.brightness import BrightnessCurves
from sweep.metrics.evaluate import evaluate
from sweep.search.problem import starting_points
from sweep.search.solver import search_from
from sweep.study import load_study

ROOT = Path(__file__).parent.parent
FILE = ROOT / "tests" / "data" / "work.json"
PACKAGE = str(ROOT / "sweep")
Work = dict[str, dict[str, int]]


class Counter:
    """Counts while it is entered."""

    def __init__(self) -> None:
        self.calls = self.values = self.walks = self.follows = 0
        self._patch = pytest.MonkeyPatch()

    def __enter__(self) -> Counter:
        """Begin to count."""
        for readout in (ReadOnce, Merged):
            self._count(readout, "mean", lambda result: self._add("values", int(np.size(result))))
        self._count(BrightnessCurves, "nearest", lambda _: self._add("walks", 1))
        self._count(BrightnessCurves, "follow", lambda _: self._add("follows", 1))
        sys.setprofile(self._entered)
        return self

    def _count(self, owner: type, name: str, count: Callable[[Any], None]) -> None:
        method = getattr(owner, name)

        def counted(*args: Any, **options: Any) -> Any:
            result = method(*args, **options)
            count(result)
            return result

        self._patch.setattr(owner, name, counted)

    def _add(self, what: str, number: int) -> None:
        setattr(self, what, getattr(self, what) + number)

    def __exit__(self, *_: object) -> None:
        """Stop."""
        sys.setprofile(None)
        self._patch.undo()

    def _entered(self, frame: FrameType, event: str, _: object) -> None:
        self.calls += event == "call" and frame.f_code.co_filename.startswith(PACKAGE)


def work_of(name: str) -> dict[str, int]:
    """The work of one stopband, all columns, in a scene; once before, so that nothing is loaded or compiled."""
    study = load_study(ROOT / "studies" / "accuracy.yaml")
    space = study.spaces[-1]
    curves = space.curves(space.points(0, 1), study.grid.size)
    setup = study.setup(space, name)
    evaluate(SceneModel(setup), curves)
    with Counter() as counter:
        evaluate(SceneModel(setup), curves)
    return {what: getattr(counter, what) for what in ("calls", "values", "walks", "follows")}


def search_work() -> dict[str, int]:
    """Evaluations of four starts of the search of `stopband`."""
    study = load_study(ROOT / "studies" / "stopband.yaml").with_plans()
    assert study.search is not None
    problem = study.problem(study.search)
    runs = [search_from(problem, at, u, "SLSQP", 200, 1) for at, u in enumerate(starting_points(problem, 4, 1))]
    return {"evaluations": sum(len(run.log) for run in runs)}


SCENES = tuple(load_study(ROOT / "studies" / "accuracy.yaml").scenarios)

if __name__ == "__main__":
    counted: Work = {name: work_of(name) for name in SCENES} | {"search": search_work()}
    FILE.write_text(json.dumps(counted, indent=1) + "\n")
    print(FILE.read_text())
