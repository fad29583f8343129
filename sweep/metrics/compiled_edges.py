"""Compiled inner loop of CSDs over grids of edges: designs side by side, from their edges to the nearest pairs.

Digital numbers of up to 12 bits are whole, and a float32 holds their squares exactly, and sums of these up to 2^24; a
larger sum is rounded to no less than that. So squared distances up to there are those of doubles. Where one of all
designs side by side may be farther, they are summed in doubles.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.machine_code import njit
from ..base.types import BoolArray, FloatArray, IndexArray
from ..designs.vectorized import larger, smaller
from .nearest import LANES, bounds_of_pairs, nearest_in_lanes

MOST_DN = 4095
"""Digital numbers up to here have squares that a float32 holds."""
_EXACT = 2.0**24
_NUMBERS = {"nnan", "nsz"}

Floats32 = np.ndarray[tuple[int, ...], np.dtype[np.float32]]
_MOST_RUNS = 8
"""Of designs side by side: with more of them, each design is read by itself."""
Edges = tuple[FloatArray, FloatArray, FloatArray, FloatArray, IndexArray, IndexArray, FloatArray]
"""Electrons/s of the channel by the edges: of the base, ndarray[n_signals], what the left and what the right edges
change, ndarray[n_edges, n_signals] each, and the latter the other way round, ndarray[n_signals, n_edges]; which edges
each design has, and its depth, ndarray[n_designs] each."""
Exposed = tuple[FloatArray, FloatArray, float]
"""Electrons/s of the channel that no design changes, ndarray[n_signals], those of each design that are the same for
every signal, ndarray[n_designs], and the exposure, s."""
ReadAs = tuple[float, float, float, float]
"""Electrons from which nothing is read any more, DN per electron, pedestal and full scale, DN."""


@njit(cache=True, nogil=True)
def _number(held_e: float, top_e: float, dn_per_e: float, rest: float, whole: float, full_scale_dn: float) -> float:
    """Digital number of what a pixel holds; the pedestal is `whole` and `rest`."""
    held_e = top_e if held_e > top_e else held_e
    steps = np.floor((held_e * dn_per_e + rest) + 0.5) + whole
    steps = 0.0 if steps < 0.0 else steps
    return full_scale_dn if steps > full_scale_dn else steps


@njit(cache=True, nogil=True)
def _read(edges: Edges, exposed: Exposed, line: ReadAs, begin: int, rows: Floats32) -> None:
    """Digital numbers of the designs from `begin` on, ndarray[LANES, n_signals]; behind the last, of the first.

    The sums of `designs.compiled.through_edges`, `camera.compiled.expose` and `whole_numbers`, in their order.
    """
    base, left, right, _, at_left, at_right, depth = edges
    fixed, uniform, time_s = exposed
    top_e, dn_per_e, offset_dn, full_scale_dn = line
    whole = math.floor(offset_dn)
    rest = offset_dn - whole
    for lane in range(LANES):
        d = begin + lane if begin + lane < depth.size else begin
        one, other, deep, more = left[at_left[d]], right[at_right[d]], depth[d], uniform[d]
        for s in range(base.size):
            held_e = ((fixed[s] + (base[s] + deep * (one[s] - other[s]))) + more) * time_s
            rows[lane, s] = np.float32(_number(held_e, top_e, dn_per_e, rest, whole, full_scale_dn))


@njit(cache=True, nogil=True)
def _runs(edges: Edges, begin: int, starts: IndexArray) -> int:
    """How many runs of one left edge and right edges one after the other the designs from `begin` on are.

    `starts`: lanes where they begin, and the end of the last; not filled where there are more than _MOST_RUNS.
    """
    at_left, at_right = edges[4], edges[5]
    count, until = 1, min(LANES, at_left.size - begin)
    starts[0] = 0
    for lane in range(1, until):
        d = begin + lane
        if at_left[d] != at_left[d - 1] or at_right[d] != at_right[d - 1] + 1:
            if count == _MOST_RUNS:
                return count + 1
            starts[count] = lane
            count += 1
    starts[count] = until
    return count


@njit(cache=True, nogil=True)
def _read_runs(
    edges: Edges, exposed: Exposed, line: ReadAs, begin: int, starts: IndexArray, order: IndexArray, lanes: Floats32
) -> None:
    """`_read` of runs of designs, signal by signal in some order, ndarray[n_signals, LANES]."""
    base, left, _, across, at_left, at_right, depth = edges
    fixed, uniform, time_s = exposed
    top_e, dn_per_e, offset_dn, full_scale_dn = line
    whole = math.floor(offset_dn)
    rest = offset_dn - whole
    for run in range(starts.size - 1):
        d = begin + starts[run]
        n, edge, other = starts[run + 1] - starts[run], left[at_left[d]], at_right[d]
        deep, more = depth[d : d + n], uniform[d : d + n]
        for s in range(order.size):
            signal = order[s]
            one, own, light = edge[signal], fixed[signal], base[signal]
            fall, out = across[signal, other : other + n], lanes[s, starts[run] : starts[run + 1]]
            for k in range(n):
                held_e = ((own + (light + deep[k] * (one - fall[k]))) + more[k]) * time_s
                out[k] = np.float32(_number(held_e, top_e, dn_per_e, rest, whole, full_scale_dn))
    for s in range(order.size):
        lanes[s, starts[-1] :] = lanes[s, 0]


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _smallest(of: Floats32, k: int, step: int) -> float:
    """Smallest of eight numbers, from `k` on."""
    a, b, c, d = of[k], of[k + step], of[k + 2 * step], of[k + 3 * step]
    e, f, g, h = of[k + 4 * step], of[k + 5 * step], of[k + 6 * step], of[k + 7 * step]
    return smaller(smaller(smaller(a, b), smaller(c, d)), smaller(smaller(e, f), smaller(g, h)))


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _largest(of: Floats32, k: int, step: int) -> float:
    """Largest of eight numbers, from `k` on."""
    a, b, c, d = of[k], of[k + step], of[k + 2 * step], of[k + 3 * step]
    e, f, g, h = of[k + 4 * step], of[k + 5 * step], of[k + 6 * step], of[k + 7 * step]
    return larger(larger(larger(a, b), larger(c, d)), larger(larger(e, f), larger(g, h)))


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _largest_lane(lanes: Floats32, room: Floats32) -> float:
    """Largest of one number of each lane; `room`: ndarray[8], to work in."""
    for k in range(8):
        room[k] = _largest(lanes, k, 8)
    return float(_largest(room, 0, 1))


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _ranges_of_runs(lanes: Floats32, least: Floats32, most: Floats32, low: Floats32, high: Floats32) -> None:
    """Smallest and largest value of each signal over the lanes; `least`, `most`: ndarray[8], to work in."""
    for s in range(lanes.shape[0]):
        row = lanes[s]
        for k in range(8):
            least[k] = _smallest(row, k, 8)
        low[s], high[s] = _smallest(least, 0, 1), _largest_lane(row, most)


@njit(cache=True, nogil=True)
def _mend(rows: Floats32, room: Floats32, begin: int, bad: BoolArray) -> None:
    """Make designs with NaN 0; `bad` says which. `room`: ndarray[n_signals], to work in."""
    room[:] = np.float32(0.0)
    for lane in range(LANES):
        for s in range(room.size):
            room[s] += rows[lane, s]
    if np.isnan(room).any():
        for lane in range(LANES):
            if np.isnan(rows[lane]).any():
                rows[lane] = np.float32(0.0)
                if begin + lane < bad.size:
                    bad[begin + lane] = True


@njit(cache=True, nogil=True)
def _turn(rows: Floats32, order: IndexArray, lanes: Floats32) -> None:
    """The same, signal by signal in some order, ndarray[n_signals, LANES]."""
    for s in range(order.size):
        signal = order[s]
        for lane in range(LANES):
            lanes[s, lane] = rows[lane, signal]


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _ranges(rows: Floats32, order: IndexArray, room: Floats32, low: Floats32, high: Floats32) -> None:
    """Smallest and largest value of each signal over the lanes, in some order; `room`: to work in."""
    room[:] = rows[0]
    for lane in range(1, LANES):
        for s in range(order.size):
            room[s] = smaller(room[s], rows[lane, s])
    for s in range(order.size):
        low[s] = room[order[s]]
    room[:] = rows[0]
    for lane in range(1, LANES):
        for s in range(order.size):
            room[s] = larger(room[s], rows[lane, s])
    for s in range(order.size):
        high[s] = room[order[s]]


@njit(cache=True, nogil=True)
def _in_doubles(lanes: Floats32, fixed: FloatArray, first: IndexArray, second: IndexArray, lane: int) -> float:
    """Smallest squared distance of one design, of any size."""
    best = np.inf
    for k in range(fixed.size):
        apart = np.float64(lanes[first[k], lane]) - np.float64(lanes[second[k], lane])
        best = min(best, fixed[k] + apart * apart)
    return best


@njit(cache=True, nogil=True)
def nearest_by_edges(
    edges: Edges,
    exposed: Exposed,
    line: ReadAs,
    finite: bool,
    order: IndexArray,
    fixed: FloatArray,
    first: IndexArray,
    second: IndexArray,
    starts: IndexArray,
    out: FloatArray,
    bad: BoolArray,
) -> int:
    """`nearest.nearest_along_squared` of designs by their edges, whose digital numbers are whole and at most MOST_DN.

    `finite`: whether no number of `edges` and `exposed` is NaN, nor so large that a sum of them may be infinite.
    `order`: the signals of both, one class after the other.
    """
    n_signals = edges[0].size
    rows, lanes = np.empty((LANES, n_signals), np.float32), np.empty((n_signals, LANES), np.float32)
    low, high = np.empty(n_signals, np.float32), np.empty(n_signals, np.float32)
    room, best, folded = np.empty(n_signals, np.float32), np.empty(LANES, np.float32), np.empty((2, 8), np.float32)
    most = 0
    for pair in range(starts.size - 1):
        most = max(most, starts[pair + 1] - starts[pair])
    bound, some, halved = np.empty(most), np.empty(most + 3, np.intp), fixed.astype(np.float32)
    computed, runs = 0, np.empty(_MOST_RUNS + 1, np.intp)
    for begin in range(0, out.shape[1], LANES):
        count = _runs(edges, begin, runs) if finite else _MOST_RUNS + 1
        if count <= _MOST_RUNS:
            _read_runs(edges, exposed, line, begin, runs[: count + 1], order, lanes)
            _ranges_of_runs(lanes, folded[0], folded[1], low, high)
        else:
            _read(edges, exposed, line, begin, rows)
            _mend(rows, room, begin, bad)
            _turn(rows, order, lanes)
            _ranges(rows, order, room, low, high)
        for pair in range(starts.size - 1):
            own = slice(starts[pair], starts[pair + 1])
            count, lead = bounds_of_pairs(fixed[own], first[own], second[own], low, high, bound)
            best[:] = np.inf
            some[:4] = lead
            nearest_in_lanes(lanes, halved[own], first[own], second[own], some[:4], best)
            enough, left = _largest_lane(best, folded[0]), 0
            exact = enough < _EXACT
            for k in range(count * exact):
                some[left] = k
                left += bound[k] < enough
            some[left : left + 3] = lead  # to a multiple of four
            nearest_in_lanes(lanes, halved[own], first[own], second[own], some[: (left + 3) & ~3], best)
            computed += 4 + ((left + 3) & ~3)
            until = min(LANES, out.shape[1] - begin)
            if exact:
                for lane in range(until):
                    out[pair, begin + lane] = best[lane]
            else:
                for lane in range(until):
                    out[pair, begin + lane] = _in_doubles(lanes, fixed[own], first[own], second[own], lane)
    return computed
