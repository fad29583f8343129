"""Which two lights limit a separation: the nearest ones, at the worst place and moment of the light."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..base.types import FloatArray, IndexArray
from ..camera.forward import ForwardModel
from ..camera.setup import Setup
from ..curves.lights import Pair, class_pairs, pair_name
from ..designs.block import Block

BETWEEN = " / "
LimitingLights = Mapping[Pair, NDArray[np.object_]]
"""Of each pair of signal types the two lights that limit its CSD, `one / other`, for each design; None: no distance."""


def limited_by_name(pair: Pair) -> str:
    """How a table calls the two lights that limit a pair's CSD."""
    return pair_name("limited_by", pair)


def limiting_lights(setup: Setup, response: FloatArray) -> LimitingLights:
    """The two lights that limit each CSD of designs, the first of the first type of a pair, ndarray[n_designs] each.

    `response`: readouts, DN, ndarray[n_designs, n_cases, n_signals, n_channels]. Of a light that may fall anywhere, the
    places are those of the method's lattice.
    """
    from .nearest import nearest_pairs  # noqa: PLC0415  (compiled: kept off the start-up path)

    members = [setup.members[name] for name in setup.lights.classes]
    bounds = np.cumsum([0, *map(len, members)])
    pairs = class_pairs(setup.lights.classes)
    found = np.empty((len(response), len(pairs), 2), dtype=np.intp)
    if pairs:
        nearest_pairs(np.ascontiguousarray(response, dtype=float), np.concatenate(members), bounds, found)
    return {pair: _named(setup, found[:, at]) for at, pair in enumerate(pairs)}


def _named(setup: Setup, lights: IndexArray) -> NDArray[np.object_]:
    """Names of two lights each; `lights`: ndarray[n_designs, 2], -1 where there are none."""
    each, which = np.unique(lights, axis=0, return_inverse=True)
    names = [None if one < 0 else BETWEEN.join((setup.lights.names[one], setup.lights.names[two])) for one, two in each]
    return np.array(names, dtype=object)[which.reshape(-1)]


def limiting_lights_of(imager: ForwardModel, block: Block) -> LimitingLights:
    """`limiting_lights` of a block of designs, read out by the same route as `evaluate` reads them."""
    changing = imager.read_changing(block)
    if changing is None:
        return limiting_lights(imager.setup, imager.read(block.curves())[0])
    whole = changing.whole
    response = np.empty((len(block), *whole.shape[1:]))
    response[changing.which] = whole
    if not changing.which.all():
        response[~changing.which] = imager.read(block.some(np.flatnonzero(~changing.which)).curves())[0]
    return limiting_lights(imager.setup, response)
