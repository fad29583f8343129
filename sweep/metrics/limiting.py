"""Limiting lights of a separation: the nearest two, at the worst phase and moment."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..base.types import DesignCases, IndexArray, Int
from ..camera.model import SceneModel
from ..camera.setup import Setup
from ..designs.block import Block
from ..spectra.lights import Pair, class_pairs, pair_name

BETWEEN = " / "
LimitingLights = Mapping[Pair, NDArray[np.object_]]
"""The two lights `one / other` that limit the CSD of each pair of signal types, for each design; None: no distance."""


def limited_by_name(pair: Pair) -> str:
    """Return the column name of the two lights that limit a pair's CSD."""
    return pair_name("limited_by", pair)


def limiting_lights(setup: Setup, response: DesignCases) -> LimitingLights:
    """Return the two lights that limit each CSD.

    The light of the first type stands first; over the lattice where all phases count.
    """
    from .separation_kernels import nearest_pairs  # noqa: PLC0415  (compiled: kept off the start-up path)

    members = [setup.members[name] for name in setup.lights.classes]
    bounds = np.cumsum([0, *map(len, members)])
    pairs = class_pairs(setup.lights.classes)
    nearest = np.empty((len(response), len(pairs), 2), dtype=np.intp)
    if pairs:
        nearest_pairs(np.ascontiguousarray(response, dtype=float), np.concatenate(members), bounds, nearest)
    return {pair: _named(setup, nearest[:, at]) for at, pair in enumerate(pairs)}


def _named(setup: Setup, lights: Int[IndexArray, "rows 2"]) -> NDArray[np.object_]:
    """Return the names of two lights each; empty for -1."""
    distinct, which = np.unique(lights, axis=0, return_inverse=True)
    names = [
        None if first < 0 else BETWEEN.join((setup.lights.names[first], setup.lights.names[second]))
        for first, second in distinct
    ]
    return np.array(names, dtype=object)[which.reshape(-1)]


def limiting_lights_of(model: SceneModel, block: Block) -> LimitingLights:
    """Return the limiting lights of a batch of designs."""
    along = model.along(block)
    if along is None:
        return limiting_lights(model.setup, model.read(block.curves())[0])
    all_channels = along.whole(slice(None))
    response = np.empty((len(block), *all_channels.shape[1:]))
    response[along.which] = all_channels
    if not along.which.all():
        response[~along.which] = model.read(block.subset(np.flatnonzero(~along.which)).curves())[0]
    return limiting_lights(model.setup, response)
