"""Compiled exposure and readout of many designs: the same sums as in NumPy, in the same order, in one pass."""

from __future__ import annotations

import math

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray


@njit(cache=True, nogil=True)
def expose(rates: FloatArray, fixed: FloatArray, uniform: FloatArray, time_s: float) -> None:
    """(rates + fixed + uniform) time_s in the place of `rates`, electrons/s, ndarray[n_designs, n_cases, n_signals].

    `fixed`: ndarray[n_cases, n_signals]; `uniform`: ndarray[n_designs, n_cases].
    """
    for d in range(rates.shape[0]):
        for case in range(rates.shape[1]):
            for s in range(rates.shape[2]):
                rates[d, case, s] = ((fixed[case, s] + rates[d, case, s]) + uniform[d, case]) * time_s


@njit(cache=True, nogil=True)
def whole_numbers(
    electrons: FloatArray, top_e: float, dn_per_e: float, offset_dn: float, full_scale_dn: float, out: FloatArray
) -> None:
    """`quantization.rounded` of `electrons`, held at `top_e`; ndarray[n], NaN stays NaN."""
    whole = math.floor(offset_dn)
    rest = offset_dn - whole
    for i in range(electrons.size):
        held = electrons[i]
        held = top_e if held > top_e else held
        steps = np.floor((held * dn_per_e + rest) + 0.5) + whole
        steps = 0.0 if steps < 0.0 else steps
        out[i] = full_scale_dn if steps > full_scale_dn else steps
