"""Compiled look-up of a function in a table of polynomials. It releases the GIL."""

from __future__ import annotations

from ..base.machine_code import njit
from ..base.types import FloatArray


@njit(cache=True, nogil=True, fastmath={"contract"})
def of_products(one: FloatArray, other: FloatArray, pieces: FloatArray, per_unit: float, out: FloatArray) -> None:
    """Put a function of the products of two vectors into `out`, ndarray[n_one, n_other].

    `pieces`: of each piece from 0 on, 1 / `per_unit` long, the coefficients of a polynomial of the seventh order of how
    far a number is from its middle, in halves of its length; ndarray[n_pieces, 8].
    """
    for row in range(one.size):
        scale = one[row] * per_unit
        for column in range(other.size):
            at = scale * other[column]
            piece = int(at)
            t = 2 * (at - piece) - 1
            c = pieces[piece]
            low = (c[0] + c[1] * t) + (c[2] + c[3] * t) * (t * t)
            high = (c[4] + c[5] * t) + (c[6] + c[7] * t) * (t * t)
            out[row, column] = low + high * (t * t) * (t * t)
