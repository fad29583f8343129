"""Worst case over a population of lights: the nearest members of two signal types.

It is that of the response before clipping and rounding, which is linear in a spectrum's shift between whole steps of
the grid (see `curves.members`): the smallest distance over all shifts is found exactly, not by samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.types import Array, DesignCurves, Float, IndexArray, Int, PerDesign
from ..camera.linear import LinearModel, linear_model
from ..camera.setup import Setup
from ..spectra.lights import Pair, class_pairs
from ..spectra.members import Members
from .separation import csd_name

_HELD = 4_000_000
"""Values of responses that are held at once."""


@dataclass(frozen=True)
class NearestMembers:
    """Nearest members of each two lights of two types, in each part of their region.

    `squared`: squared distance, DN^2; infinite where there are none.
    """

    squared: Float[Array, "first second parts"]
    steps: Int[IndexArray, "*batch 2"]
    shares: Float[Array, "*batch 2"]
    first: Int[IndexArray, " first"]
    second: Int[IndexArray, " second"]

    def of(self, values: Float[Array, "... spectra channels"], side: int) -> Float[Array, " ..."]:
        """Return values of the nearest members on one side."""
        starts = self.first[:, None, None] if side == 0 else self.second[None, :, None]
        rows, share = starts + self.steps[..., side], self.shares[..., side, None]
        return np.asarray(values[..., rows, :] * (1 - share) + values[..., rows + 1, :] * share, dtype=float)


class PopulationModel:
    """Scene with all members of the population of its lights."""

    parts = 5

    def __init__(self, setup: Setup) -> None:
        """Store the setup with every effect, since a plan's bounds do not cover other members."""
        self.members = Members(setup.lights, setup.camera.grid)
        self.setup = replace(setup.with_all_effects, lights=self.members.lights)
        self._tables: dict[Pair, tuple[NDArray[Any], ...]] = {}

    @cached_property
    def linear(self) -> LinearModel:
        """Linear model of every spectrum of the members."""
        return linear_model(self.setup)

    def worst(self, curves: DesignCurves, pairs: Sequence[Pair] = ()) -> dict[str, PerDesign]:
        """Return the smallest CSD of each pair over all members and field positions, DN.

        `pairs`: pairs; all if there are none. NaN where the response is NaN.
        """
        pairs = pairs or class_pairs(self.setup.lights.classes)
        smallest = {pair: np.full(len(curves), np.nan) for pair in pairs}
        step = max(1, _HELD // (self.linear.n_cases * self.setup.lights.photons.shape[0] * len(self.setup.camera.qe)))
        for start in range(0, len(curves), step):
            for index, response in enumerate(self.linear.smooth(curves[start : start + step]), start):
                if np.isfinite(response).all():
                    for pair in pairs:
                        least = min(float(self.nearest(case, pair, alone=True).squared.min()) for case in response)
                        smallest[pair][index] = np.sqrt(least)
        return {csd_name(pair): values for pair, values in smallest.items()}

    def nearest(
        self, response: Float[Array, "spectra channels"], pair: Pair, *, parts: int = 1, alone: bool = False
    ) -> NearestMembers:
        """Return the nearest members of two types.

        `response`: response to every spectrum, DN.
        """
        from .member_kernels import nearest_members  # noqa: PLC0415  (compiled: kept off the start-up path)

        first, second, which, starts, cells, spans, along = self._table(pair)
        shape = (first.size, second.size, parts)
        squared, steps, shares = np.empty(shape), np.zeros((*shape, 2), dtype=np.intp), np.zeros((*shape, 2))
        part = np.minimum((along * parts).astype(np.intp), parts - 1)
        region = which, starts, cells, spans, part
        nearest_members(np.ascontiguousarray(response), first, second, *region, alone, squared, steps, shares)
        return NearestMembers(squared, steps, shares, first, second)

    def _table(self, pair: Pair) -> tuple[NDArray[Any], ...]:
        """Return the regions of two types as `nearest_members` takes them."""
        if pair not in self._tables:
            regions, which = self.members.regions(pair)
            starts = np.cumsum([0, *(len(region.cells) for region in regions)])
            joined = [np.concatenate([getattr(of, name) for of in regions]) for name in ("cells", "shares", "along")]
            self._tables[pair] = (*(self.members.rows[name] for name in pair), which, starts, *joined)
        return self._tables[pair]


@lru_cache(maxsize=16)
def population_model(setup: Setup) -> PopulationModel:
    """Return the population of a setup's lights; recent ones are kept."""
    return PopulationModel(setup)
