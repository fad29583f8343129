"""Which two lights limit a separation: the nearest ones, at the worst place and moment of the light."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray
from ..camera.view import View
from ..curves.lights import Pair, class_pairs, pair_name

BETWEEN = " / "


def limited_by_name(pair: Pair) -> str:
    """How a table calls the two lights that limit a pair's CSD."""
    return pair_name("limited_by", pair)


def limiting_lights(view: View, cases: FloatArray) -> dict[Pair, tuple[str, str]]:
    """The two lights that limit each CSD of one design, the first of the first type of a pair.

    `cases`: its readout, DN, ndarray[n_cases, n_signals, n_channels]. Of a light that may fall anywhere, the places are
    those of the method's lattice. A pair without a distance is left out.
    """
    limiting: dict[Pair, tuple[str, str]] = {}
    for pair in class_pairs(view.lights.classes):
        first, second = (view.members[name] for name in pair)
        # Differences come before squares, and no square is too large: nearly equal points lose no digits.
        apart = np.hypot.reduce(cases[:, first, None] - cases[:, None, second], axis=-1)
        if np.isfinite(apart).all():
            _, one, other = np.unravel_index(int(apart.argmin()), apart.shape)
            limiting[pair] = view.lights.names[first[one]], view.lights.names[second[other]]
    return limiting
