"""Ends of ranges: numbers between two scenarios at which an error is the allowed one, or two designs change places."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
from pydantic import ValidationError

from ..base.types import Array, DesignCurves, Float, delayed
from ..camera.model import SceneModel
from ..metrics.columns.chromatic import CHROMATIC_ERROR
from ..metrics.columns.confusion import STATE_ERROR
from ..metrics.evaluate import evaluate_some
from ..metrics.quantity import Quantity, RequestedQuantities
from ..metrics.registry import quantities_of
from ..results.tables import CROSSINGS, RGGB
from ..spectra.lights import class_pairs, pair_name
from ..study import Study
from ..study.axes import series_of
from .analysis import Calls, DesignBetween, designs_between, table_of_calls
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
    + [(name, pa.string()) for name in ("name", "series", "key", "quantity", "against")]
    + [(name, pa.float64()) for name in ("at", "error", "value")]
    + [("rises", pa.bool_())]
)


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Find all numbers at which a range ends, with all effects.

    One row per series of scenarios (`series`, `key`), design, `quantity` and crossing. Of errors (of lamps of equal
    brightness, or of any) those at which it is the allowed one; of the separation of the front those at which it is
    that of another design (`against`) that leads beside it, or of RGGB. `rises`: it is larger beyond `at`.
    """
    designs = [*designs_between(study, rows)]
    if study.section.recognition is not None:
        yield from _error_calls(study, designs)
    column = study.trade_off[0]
    quantity = quantities_of(RequestedQuantities(study.lights.classes, study.states)).get(column)
    if quantity is not None:
        yield from _swap_calls(study, designs, quantity)


def _swap_calls(study: Study, designs: Sequence[DesignBetween], quantity: Quantity) -> Calls:
    values: dict[tuple[str, str], dict[str, DesignBetween]] = {}
    for design in designs:
        values.setdefault((design.key["series"], design.key["key"]), {})[design.key["name"]] = design
    for of_series in values.values():
        known = {name: _along(design, quantity.name) for name, design in of_series.items()}
        most = np.max([*known.values()], axis=0)
        numbers = [*next(iter(of_series.values())).numbers.values()]
        for first, second in combinations(of_series, 2):
            apart = known[first] - known[second]
            leads = np.maximum(known[first], known[second]) >= most
            for at in np.flatnonzero(apart[:-1] * apart[1:] < 0):
                if RGGB in (first, second) or leads[at : at + 2].all():
                    swap = Swap(quantity, study.states, (of_series[first], of_series[second]))
                    key = of_series[first].key | {"quantity": quantity.name, "against": second}
                    yield key, delayed(swap.row, *numbers[at : at + 2], *apart[at : at + 2].tolist())


def _along(design: DesignBetween, column: str) -> Float[Array, " numbers"]:
    """Return a column of a design at the numbers of its series."""
    by_scene = design.rows.set_index("scenario")[column]
    return by_scene.reindex(list(design.numbers)).to_numpy(dtype=float)


@dataclass(frozen=True)
class Swap:
    """Two designs that change places between two numbers."""

    quantity: Quantity
    states: tuple[str, ...]
    designs: tuple[DesignBetween, DesignBetween]

    def row(self, low: float, high: float, apart_low: float, apart_high: float) -> list[dict[str, Any]]:
        """Return the number at which both have the same value; none where no study may have a scene between."""
        from scipy.optimize import brentq  # noqa: PLC0415  (few studies ask for it)

        by_ratio, known = low > 0, {0.0: apart_low, 1.0: apart_high}

        def number(share: float) -> float:
            return low * (high / low) ** share if by_ratio else low + share * (high - low)

        def apart(share: float) -> float:
            if share not in known:
                first, second = self._values(number(share))
                known[share] = first - second
            return known[share]

        size = math.log(high / low) if by_ratio else 1.0
        try:
            share = float(brentq(apart, 0.0, 1.0, xtol=_CLOSE / size, disp=False))
            value = self._values(number(share))[0]
        except ValidationError:
            return []
        return [{"at": number(share), "value": value, "rises": apart_high > 0}]

    def _values(self, number: float) -> tuple[float, float]:
        first, second = (
            evaluate_some(SceneModel(of.scenes.at(number)), of.curves, [self.quantity], self.states)
            for of in self.designs
        )
        return first[self.quantity.name], second[self.quantity.name]


def _error_calls(study: Study, designs: Sequence[DesignBetween]) -> Calls:
    recognition = study.section.recognition
    assert recognition is not None
    for design in designs:
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
    return bool(series_of(study.scenarios))


RANGES = table_of_calls(CROSSINGS, "where ranges end", _is_asked, lambda _: _SCHEMA, _calls)
