"""Compiled inner loop that gathers what pixels take of the light. It releases the GIL."""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray


@njit(cache=True, nogil=True)
def gather(seen: FloatArray, shares: FloatArray, place: IndexArray, through: IndexArray, out: FloatArray) -> None:
    """Add what pixels get, ndarray[n_designs, n_cases, n_signals, n_units], pixel by pixel.

    `seen`: ndarray[n_designs, n_channels, n_places, n_signals]; `shares`: ndarray[n_parts]; `place`: ndarray[n_parts,
    n_cases, n_units]; `through`: the channel of `seen`, or -1 for one that does not count, ndarray[n_parts, n_units].
    """
    n_signals = out.shape[2]
    own = np.empty(n_signals)
    for design in range(out.shape[0]):
        for case in range(out.shape[1]):
            for unit in range(out.shape[3]):
                own[:] = 0.0
                some = False
                for part in range(shares.size):
                    channel = through[part, unit]
                    if channel >= 0:
                        some = True
                        share, light = shares[part], seen[design, channel, place[part, case, unit]]
                        for s in range(n_signals):
                            own[s] += share * light[s]
                if some:
                    for s in range(n_signals):
                        out[design, case, s, unit] += own[s]
