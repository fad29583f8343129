"""Quantities of designs, a block at a time; a block that fails is halved down to the design that does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray
from ..camera.forward import AllPhases, ForwardModel, forward_model
from ..camera.setup import Setup
from ..designs.block import CurveBlock, edges_of
from ..designs.space import Space
from ..designs.tolerance import AS_DESIGNED, Tolerance
from ..metrics.evaluate import Spent, evaluate, family_quantities, image_quantities
from ..metrics.objective import COMBINED, Objective, columns_of
from ..metrics.own import OwnMetric
from ..metrics.quantity import OF_A_SHARE, WORST_CASE, YIELD, Asked, Columns, Quantity
from ..results.identity import CHUNK
from ..results.tables import FEW
from ..vision.section import Vision

_MOST_LETTERS = 200
_CHUNKS_BY_EDGES = 4
"""In a block of designs that are seen by their edges alone: these take little memory."""


@dataclass(frozen=True)
class Request:
    """What is wanted of each design: quantities, the objective, how far off it may come out, images and their seed."""

    asked: Asked
    objective: Objective
    tolerance: Tolerance
    vision: Vision | None = None
    seed: int = 0
    drawn: bool = False
    """Whether raw patches are drawn of plain CFAs and named designs, from the same readout."""

    def imager(self, kind: str, setup: Setup) -> ForwardModel:
        """The imager of a setup for designs of a `kind` of rows."""
        return forward_model(setup, AllPhases if self.drawn and kind in FEW else ForwardModel)

    @property
    def needs_curves(self) -> bool:
        """Return whether designs need their curves, or the whole readout at once."""
        asked = self.asked
        worst = any(quantity.extreme == WORST_CASE for quantity in self.quantities.values())
        return bool(self.vision is not None or asked.states or asked.wanted_yield or worst)

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Every column by its name."""
        return columns_of(self.asked, self.objective)


@dataclass(frozen=True)
class Found:
    """Quantities of designs, ndarray[n_designs] each; what is wrong with which design.

    `spent_s`: see `metrics.evaluate.Spent`.
    """

    columns: Columns
    faults: dict[int, str]
    spent_s: float = 0.0


def found_of(space: Space, start: int, points: FloatArray, setup: Setup, request: Request) -> Found:
    """Quantities of designs of a space from `start` on, of which these are the `points`.

    They are computed in blocks that stay in the cache: by their edges where the family is separable, else from their
    curves. A block that fails is halved, down to the design that does, whose fault it is, as is a number that is not
    finite.
    """
    faults: dict[int, str] = {}
    spent = Spent()

    def computed(begin: int, end: int) -> list[Columns]:
        try:
            return [_columns(space, start + begin, setup, points[begin:end], request, spent)]
        except Exception as error:  # one design must not take the others with it
            if end - begin > 1:
                middle = (begin + end) // 2
                return computed(begin, middle) + computed(middle, end)
            faults[begin] = f"error: {text_of(error)}"
            return [dict.fromkeys(request.quantities, np.array([np.nan]))]

    size = CHUNK * (1 if request.needs_curves else _CHUNKS_BY_EDGES)
    parts = [part for begin in range(0, len(points), size) for part in computed(begin, min(begin + size, len(points)))]
    names = request.quantities.keys() & set.intersection(*map(set, parts))
    columns = {name: np.concatenate([part[name] for part in parts]) for name in names}
    return Found(columns, _not_finite(columns, setup, request) | faults, spent.seconds)


def text_of(error: Exception) -> str:
    """An error on one line, cut where it is long."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:_MOST_LETTERS]


def _columns(space: Space, start: int, setup: Setup, points: FloatArray, request: Request, spent: Spent) -> Columns:
    """Every quantity of a block of designs, ndarray[n_designs] each."""
    size = setup.camera.grid.size
    imager = request.imager(space.kind, setup)
    edges = edges_of(space, start, start + len(points))
    designs = CurveBlock(space.curves(points, size)) if edges is None else edges
    asked = request.asked
    columns = evaluate(imager, designs, asked.states, probabilities=asked.probabilities, own=asked.own, spent=spent)
    columns |= family_quantities(None if space.filter is None else space.filter.family, points)
    if request.vision is not None:
        columns |= image_quantities(setup, space.curves(points, size), request.vision, request.seed)
    worst = [quantity for quantity in request.quantities.values() if quantity.extreme == WORST_CASE]
    if worst:
        columns |= worst_cases(space, imager, points, columns, worst, request.tolerance, asked.own, spent)
    if request.asked.wanted_yield:
        columns |= of_a_share(space, setup, points, request)
    if request.objective.column == COMBINED:
        columns[COMBINED] = request.objective.of(columns)
    return columns


def worst_cases(
    space: Space,
    imager: ForwardModel,
    points: FloatArray,
    nominal: Columns,
    worst: Sequence[Quantity],
    tolerance: Tolerance,
    own: Sequence[OwnMetric] = (),
    spent: Spent | None = None,
) -> Columns:
    """Worst cases of designs over how far off they may come out, and of CSDs over the population of the lights.

    `nominal`: what `evaluate` gives of them; `worst`: the quantities that are asked for; `own`, `spent`:
    see `evaluate`.
    """
    setup = imager.setup
    places = [off for off in tolerance.places if any(off)] if space.filter is not None else []
    curves = [space.curves(points, setup.camera.grid.size, off) for off in (AS_DESIGNED, *places)]
    cases = [nominal, *(evaluate(imager, shifted, own=own, spent=spent) for shifted in curves[1:])]
    if setup.lights.population is not None:
        from ..metrics.members import population_imager  # noqa: PLC0415  (only where lights have a population)

        members = population_imager(setup)
        cases = [case | members.worst(shifted) for case, shifted in zip(cases, curves, strict=True)]
    return {quantity.name: quantity.worse([case[quantity.of] for case in cases]) for quantity in worst}


def of_a_share(space: Space, setup: Setup, points: FloatArray, request: Request) -> Columns:
    """What the wanted share of random lamps and cameras has of each design, see `LampsAndCameras`."""
    from ..metrics.drawn import LampsAndCameras  # noqa: PLC0415  (only where a share of lamps and cameras counts)
    from ..metrics.members import population_imager  # noqa: PLC0415

    tolerance = request.tolerance if space.filter is not None else Tolerance()
    drawn = LampsAndCameras(population_imager(setup), tolerance, request.seed)
    pairs = [q.pair for q in request.quantities.values() if q.extreme == OF_A_SHARE and q.pair is not None]
    found = drawn.columns(lambda off, some: space.curves(points[some], setup.camera.grid.size, off), len(points), pairs)
    return {YIELD + name: values for name, values in found.items()}


def _not_finite(columns: Columns, setup: Setup, request: Request) -> dict[int, str]:
    """Designs with a quantity that is no finite number, though each of them has it."""
    lacking = _may_lack(setup, request)
    infinite = {name for name, quantity in request.quantities.items() if quantity.infinite}
    faulty: set[int] = set()
    for name in columns.keys() - lacking:
        finite = np.isfinite(columns[name])
        if not finite.all():
            finite |= (columns[name] == np.inf) & (name in infinite)
            faulty |= set(np.flatnonzero(~finite).tolist())
    return dict.fromkeys(sorted(faulty), "not finite")


def _may_lack(setup: Setup, request: Request) -> set[str]:
    """Quantities that a design may not have: those of a family; of a plain CFA, all that a modified channel has."""
    without = ("family", "own") if setup.camera.modified else ("family", "own", "modified")
    lacking = {name for name, quantity in request.quantities.items() if quantity.needs in without}
    if lacking & set(request.objective.weights):
        lacking.add(COMBINED)
    return lacking


def spent_in_words(names: Sequence[str], spent_s: float, rows_s: float) -> list[str]:
    """A line on what metrics of the whole readout take; none where there are none."""
    if not names:
        return []
    what = f"metric {names[0]} needs" if len(names) == 1 else f"metrics {', '.join(names)} need"
    return [f"{what} the whole readout of a design: {spent_s:,.2f} s of the workers' {rows_s:,.2f} s for all rows"]
