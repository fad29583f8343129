"""Usable ranges of designs: the numbers between two scenarios at which an error is the allowed one."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import DesignCurves, delayed
from ..camera.model import SceneModel
from ..metrics.columns.chromatic import CHROMATIC_ERROR
from ..metrics.columns.confusion import STATE_ERROR
from ..metrics.evaluate import evaluate_some
from ..metrics.quantity import RequestedQuantities
from ..metrics.registry import quantities_of
from ..spectra.lights import class_pairs, pair_name
from ..study import Study
from ..study.axes import series_of
from .analysis import Analysis, Calls, designs_between
from .between import Between, inner_numbers, or_nan

if TYPE_CHECKING:
    import pandas as pd

_LEAST = 1e-300
_CLOSE = 1e-3
"""Tolerance of the number: relative, or of the interval."""
_STEPS = 3
"""Numbers between two neighboring scenarios at which an error that may come back is computed."""
_NEAR = 2.5
"""Between two scenarios whose d' are both so many times the allowed one, or less, errors are not looked for."""
_SCHEMA = pa.schema(
    [("design_id", pa.int64())]
    + [(name, pa.string()) for name in ("name", "series", "key", "quantity")]
    + [(name, pa.float64()) for name in ("at", "error")]
    + [("rises", pa.bool_())]
)


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Find all numbers at which an error of a design passes the allowed one, with all effects.

    One row per series of scenarios (`series`, `key`), design, kind of error (`quantity`: lamps of equal brightness, or
    of any) and crossing: `rises` if the error is larger beyond `at`.
    """
    recognition = study.section.recognition
    assert recognition is not None
    for design in designs_between(study, rows):
        of_any = [pair_name(CHROMATIC_ERROR, pair) for pair in class_pairs(study.states)]
        by_scene = design.rows.set_index("scenario")
        errors = by_scene[[STATE_ERROR]].assign(**{CHROMATIC_ERROR: by_scene[of_any].max(axis=1)})
        errors = errors.reindex(list(design.numbers)).set_axis(list(design.numbers.values()))
        if np.isfinite(errors.to_numpy()).all():
            known = {name: errors[name].to_dict() for name in errors}
            between = ErrorsBetween(design.scenes, design.curves, study.states)
            yield design.key, delayed(_of_design, between, known, recognition.error_max)


class ErrorsBetween:
    """Errors of the worst pair of states of a design over the numbers of a series."""

    def __init__(self, scenes: Between, curves: DesignCurves, states: tuple[str, ...]) -> None:
        self._scenes, self._curves, self._states = scenes, curves, states
        known = quantities_of(RequestedQuantities(scenes.setup.lights.classes, states))
        of_pairs = [known[pair_name(CHROMATIC_ERROR, pair)] for pair in class_pairs(states)]
        self._quantities = {STATE_ERROR: [known[STATE_ERROR]], CHROMATIC_ERROR: of_pairs}

    def at(self, number: float, quantity: str) -> float:
        """Return the error of lamps of equal brightness, or of any, which is no smaller."""
        model = SceneModel(self._scenes.at(number))
        return max(evaluate_some(model, self._curves, self._quantities[quantity], self._states).values())


def _of_design(
    errors: ErrorsBetween, known: Mapping[str, Mapping[float, float]], allowed: float
) -> list[dict[str, Any]]:
    """Return the crossings of both kinds of errors."""
    return [
        {"quantity": quantity} | crossing
        for quantity, numbers in known.items()
        for crossing in crossings_of(or_nan(partial(errors.at, quantity=quantity)), numbers, allowed)
    ]


def crossings_of(
    computed: Callable[[float], float], known: Mapping[float, float], allowed: float
) -> list[dict[str, Any]]:
    """Return the numbers at which an error is the allowed one, in order.

    `known`: errors at the numbers of a series, `computed` between them. The logarithms of both are nearly on a line
    between two neighboring ones.
    """
    from scipy.optimize import brentq  # noqa: PLC0415  (few studies ask for it)
    from scipy.special import ndtri  # noqa: PLC0415

    by_ratio = min(known) > 0

    def decades(number: float) -> float:
        error = known[number] if number in known else computed(number)
        return math.log10(max(error, _LEAST) / allowed)

    def at(position: float) -> float:
        return math.exp(position) if by_ratio else position

    def of_ends(number: float, ends: tuple[float, float]) -> float:
        """Return the decades at a number, at an end itself where rounding has moved it there."""
        return decades(next((end for end in ends if math.isclose(end, number, rel_tol=1e-14)), number))

    found = []
    for low, high in pairwise(known):
        dprimes = -ndtri(np.clip([known[low], known[high], allowed], _LEAST, 0.5))
        passes = (known[low] <= allowed) != (known[high] <= allowed)
        if not passes and (dprimes[:2].min() > _NEAR * dprimes[2] or dprimes[:2].max() * _NEAR < dprimes[2]):
            continue
        grid = [low, *inner_numbers([low, high], _STEPS)[1:-1], high]
        grid = [number for number in grid if not math.isnan(decades(number))]
        for before, after in pairwise(grid):
            if (decades(before) <= 0) == (decades(after) <= 0):
                continue
            ends = (math.log(before), math.log(after)) if by_ratio else (before, after)
            tolerance = _CLOSE * (1.0 if by_ratio else abs(after - before))
            number = at(
                brentq(lambda position, ends=(before, after): of_ends(at(position), ends), *ends, xtol=tolerance)
            )
            error = allowed * 10 ** decades(number)
            found.append({"at": number, "error": error, "rises": decades(after) > 0})
    return found


def _is_asked(study: Study) -> bool:
    return study.section.recognition is not None and bool(series_of(study.scenarios))


USABLE_RANGES = Analysis("where designs stop being usable", _is_asked, lambda _: _SCHEMA, _calls)
