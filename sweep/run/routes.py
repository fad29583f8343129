"""The routes from a block of designs to its quantities: the fast one, the ordinary one, and design by design.

Where a route fails the next one is taken, and how many designs took it is handed on: nothing is replaced in silence.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from ..camera.imager import imager_of
from ..camera.view import Setup
from ..designs.block import Block, Curves, Edges, edges_of
from ..designs.space import DIMENSIONS, Space
from ..metrics.evaluate import WORST, evaluate, noise_quantities, shiftable
from ..metrics.objective import COMBINED, Objective
from ..search.problem import SHIFTS
from ..types import FloatArray

BY_CURVES = "computed from their curves, since the fast way by their edges failed"
ALONE = "computed one by one, since their block failed"
_MOST_LETTERS = 200
Columns = dict[str, FloatArray]
Detours = Counter[tuple[str, str]]
"""How many designs took another route than their block's own: (BY_CURVES or ALONE, the fault of the own route)."""


@dataclass(frozen=True)
class Asked:
    """What is asked of each design: quantities, the objective, shifts of its edges, states to tell apart."""

    columns: tuple[str, ...]
    objective: Objective
    edge_shift_nm: float
    states: tuple[str, ...]


@dataclass(frozen=True)
class Found:
    """Quantities of a block, ndarray[n_designs] each; what is wrong with which design; detours that were taken."""

    columns: Columns
    faults: dict[int, str]
    detours: Detours


def block_of(space: Space, start: int, stop: int, setup: Setup, asked: Asked) -> Found:
    """Designs `start`..`stop`-1 of a space.

    By their edges where the family is separable, else from their curves. Where the fast way fails, all of them from
    their curves, whose numbers are the same up to rounding; where that fails, too, one by one, which gives the very
    numbers of a whole block, and what is wrong with a design is its fault. A number that is not finite is a fault.
    """
    points = space.points(start, stop)
    detours: Detours = Counter()
    faults: dict[int, str] = {}
    fast: Edges | None = None
    try:
        fast = edges_of(space, start, stop)
        columns = _columns(space, setup, points, asked, fast)
    except Exception as error:  # one design must not take the others with it
        own = text_of(error)
        try:
            columns = _columns(space, setup, points, asked)
            detours[BY_CURVES, own] = len(points)
        except Exception:
            columns, faults, detours = _one_by_one(space, start, setup, points, asked, own)
    return Found(columns, _not_finite(columns, setup, asked) | faults, detours)


def text_of(error: Exception) -> str:
    """An error on one line, cut where it is long."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:_MOST_LETTERS]


def _columns(space: Space, setup: Setup, points: FloatArray, asked: Asked, block: Block | None = None) -> Columns:
    """Every quantity of a block of designs, ndarray[n_designs] each; `block`: these very designs, if a faster one."""
    size = setup.grid.size
    imager = imager_of(setup)
    designs = Curves(space.curves(points, size)) if block is None else block
    columns = evaluate(imager, designs, asked.states) | space.dimensions(points)
    if asked.edge_shift_nm:
        shifts = [asked.edge_shift_nm * s for s in SHIFTS if s] if space.filter is not None else []
        cases = [columns, *(evaluate(imager, space.curves(points, size, shift)) for shift in shifts)]
        columns |= {WORST + n: np.min([case[n] for case in cases], axis=0) for n in shiftable(setup.lights)}
    if asked.objective.column == COMBINED:
        columns[COMBINED] = asked.objective.of(columns)
    return columns


def _one_by_one(
    space: Space, start: int, setup: Setup, points: FloatArray, asked: Asked, own: str
) -> tuple[Columns, dict[int, str], Detours]:
    """Each design by its own route, else from its curves; `own`: the fault of the whole block."""
    found: list[Columns | None] = []
    faults: dict[int, str] = {}
    detours: Detours = Counter()
    for index, point in enumerate(points):
        at = start + index
        try:
            found.append(_columns(space, setup, point[None], asked, edges_of(space, at, at + 1)))
            detours[ALONE, own] += 1
        except Exception as error:
            try:
                found.append(_columns(space, setup, point[None], asked))
                detours[BY_CURVES, text_of(error)] += 1
            except Exception as last:  # the row says what happened
                found.append(None)
                faults[index] = f"error: {text_of(last)}"
    nothing = np.array([np.nan])
    columns = {n: np.concatenate([nothing if c is None else c[n] for c in found]) for n in asked.columns}
    return columns, faults, detours


def _not_finite(columns: Columns, setup: Setup, asked: Asked) -> dict[int, str]:
    """Designs with a quantity that is no finite number, though each of them has it."""
    lacking = _may_lack(setup, asked)
    unbounded = set(noise_quantities(asked.states))  # a signal without noise is told apart for certain
    numbers = [
        np.where(values == np.inf, 0.0, values) if name in unbounded else values
        for name, values in columns.items()
        if name not in lacking
    ]
    return {int(index): "not finite" for index in np.flatnonzero(~np.isfinite(numbers).all(axis=0))}


def _may_lack(setup: Setup, asked: Asked) -> set[str]:
    """Quantities that a design may not have: dimensions; of a plain CFA, all that a modified channel has."""
    lacking = {*DIMENSIONS}
    if not setup.modified:
        lacking |= {"sensitivity", "slope_per_nm", "min_transmission", WORST + "sensitivity"}
        if lacking & set(asked.objective.weights):
            lacking.add(COMBINED)
    return lacking


def detours_in_words(detours: Detours) -> list[str]:
    """A line for each kind of detour: how many designs took it, and why."""
    lines = []
    for kind in (BY_CURVES, ALONE):
        why = Counter({fault: n for (which, fault), n in detours.items() if which == kind})
        if why:
            n, others = why.total(), len(why) - 1
            more = f", and {others:,} more" if others else ""
            lines.append(
                f"{n:,} {'design was' if n == 1 else 'designs were'} {kind} ({why.most_common(1)[0][0]}{more})"
            )
    return lines
