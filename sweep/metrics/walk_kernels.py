"""Compiled walk over brightness: the brightness at which a lamp's reading is nearest to another reading, with a proof.

It holds for readings as the law of the pixel has them (see `camera/noise/law.py`).

Between two brightnesses that are h apart a channel's mean is within (s2 - s)(s - s1) / (s2 - s1) h of its chord of
slope s, as its slope lies between s1 and s2, and so is its variance; no reading is nearer to the curve than to the
chord, less that. Distances in units of a noise whose variance is straight are convex along a chord. Segments are halved
where this bound is less than the smallest distance found. They release the GIL.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from ..camera.noise.law_kernels import Lamps, read_at, slopes_between
from .margin_kernels import balance, margin_at

_MOST_NODES, _DEPTH, _NARROW = 4000, 80, 1e-13
"""Brightnesses of a lamp, halvings of a segment, and its width relative to its brighter end, from which on it is left
unproven."""
_AT_ENDS, _APART = 0.05, 8.0
"""A segment is divided where its chord is nearest, unless that is so close to an end; in the geometric middle if its
ends are so many times apart."""
_NEWTONS, _CLOSE = 4, 1e-3
_GOLDEN, _POLISHES, _DIGITS = 0.3819660112501051, 40, 1e-7
_WIDER, _TIMES = 1.12, 40
"""Ratio of brightnesses beside a known one, and how often these are moved to where distances fall."""
Readings = tuple[FloatArray, FloatArray]
"""Means and variances, a row each."""


@njit(cache=True, nogil=True)
def _distance(
    w: float, floor: float, ours: Readings, r: int, theirs: Readings, at: int, enough: float, scratch: FloatArray
) -> tuple[float, float]:
    """Return the squared distance of two readings, in DN or 4 r^2, and the balance of it.

    Less than it is where, at a balance w, it is not below `enough`: then w stays.
    """
    total, share = 0.0, 4.0 * w / (1.0 + w)
    for c in range(scratch.shape[1]):
        apart = ours[0][r, c] - theirs[0][at, c]
        spread = 1.0 if floor <= 0.0 else (max(ours[1][r, c], floor) + w * max(theirs[1][at, c], floor)) / share
        total += apart * apart / spread
    if floor <= 0.0 or total >= enough:
        return total, w
    for c in range(scratch.shape[1]):
        scratch[0, c] = ours[0][r, c] - theirs[0][at, c]
        scratch[1, c], scratch[2, c] = max(ours[1][r, c], floor), max(theirs[1][at, c], floor)
    w = balance(scratch[0], scratch[1], scratch[2], w)
    return 4.0 * margin_at(w, scratch[0], scratch[1], scratch[2]) ** 2, w


@njit(cache=True, nogil=True)
def _is_beyond(
    floor: float,
    ours: Readings,
    r: int,
    means: FloatArray,
    low: int,
    high: int,
    most: FloatArray,
    at: int,
    off: FloatArray,
    enough: float,
) -> bool:
    """Return whether the box around a segment is farther from a reading than a squared distance."""
    box = 0.0
    for c in range(off.shape[1]):
        x, m0, m1 = ours[0][r, c], means[low, c], means[high, c]
        outside = max(min(m0, m1) - x, x - max(m0, m1)) - off[0, c]
        if outside > 0.0:
            box += (
                outside
                * outside
                * (1.0 if floor <= 0.0 else 2.0 / (max(ours[1][r, c], floor) + max(most[at, c], floor)))
            )
            if box >= enough:
                return True
    return False


@njit(cache=True, nogil=True)
def _bound(
    w: float,
    floor: float,
    ours: Readings,
    r: int,
    theirs: Readings,
    low: int,
    high: int,
    off: FloatArray,
    scratch: FloatArray,
) -> tuple[float, float]:
    """Return a distance that no point of a segment is nearer than, and where along its chord the nearest one is.

    `off`: how far from their chords means, and variances, are at most.
    """
    share, place, before, total, slope, far = 4.0 * w / (1.0 + w), 0.5, 0.5, 0.0, 0.0, 0.0
    for c in range(off.shape[1]):
        v0, v1 = 1.0, 1.0
        if floor > 0.0:
            own = max(ours[1][r, c], floor)
            v0 = (own + w * max(theirs[1][low, c] + off[1, c], floor)) / share
            v1 = (own + w * max(theirs[1][high, c] + off[1, c], floor)) / share
        scratch[0, c], scratch[1, c] = v0, v1
        scratch[2, c], scratch[3, c] = (
            ours[0][r, c] - theirs[0][low, c],
            theirs[0][high, c] - theirs[0][low, c],
        )
        far += off[0, c] * off[0, c] / min(v0, v1)
    for _ in range(_NEWTONS):
        before, total, slope, bend = place, 0.0, 0.0, 0.0
        for c in range(off.shape[1]):
            per = 1.0 / ((1.0 - place) * scratch[0, c] + place * scratch[1, c])
            apart = scratch[2, c] - place * scratch[3, c]
            turns = scratch[3, c] + apart * per * (scratch[1, c] - scratch[0, c])
            total += apart * apart * per
            slope -= apart * per * (scratch[3, c] + turns)
            bend += 2.0 * turns * turns * per
        place = min(max(place - slope / bend, 0.0), 1.0) if bend > 0.0 else place
        if abs(place - before) < _CLOSE:
            break
    total -= max(slope * before, slope * (before - 1.0))  # it is convex
    return math.sqrt(max(total, 0.0)) - math.sqrt(far), before


@njit(cache=True, nogil=True)
def _polished(
    low: float,
    x: float,
    high: float,
    lamp: int,
    lamps: Lamps,
    floor: float,
    ours: Readings,
    r: int,
    scratch: FloatArray,
) -> tuple[float, float]:
    """Return a squared distance with none smaller around it, and where: Brent's method from x in a range."""
    mean, variance = scratch[4:5], scratch[5:6]
    w, v, of_balance = x, x, 1.0
    fx = fw = fv = np.inf
    step = before = 0.0
    for number in range(_POLISHES):
        u = x
        if number:
            middle, close = 0.5 * (low + high), _DIGITS * x + 1e-300
            if abs(x - middle) <= 2.0 * close - 0.5 * (high - low):
                break
            p, q, golden = 0.0, 0.0, True
            if abs(before) > close and fv < np.inf:  # the vertex of the parabola through three points
                r1, q1 = (x - w) * (fx - fv), (x - v) * (fx - fw)
                p, q = (x - v) * q1 - (x - w) * r1, 2.0 * (q1 - r1)
                p, q = (-p, q) if q > 0.0 else (p, -q)
                golden = not (abs(p) < abs(0.5 * q * before) and q * (low - x) < p < q * (high - x))
            if golden:
                before = (high if x < middle else low) - x
                step = _GOLDEN * before
            else:
                before, step = step, p / q
            u = x + (step if abs(step) >= close else math.copysign(close, step))
        read_at(u, lamp, lamps, mean, variance, 0)
        fu, of_balance = _distance(of_balance, floor, ours, r, (mean, variance), 0, np.inf, scratch)
        if fu <= fx:
            low, high = (x, high) if u > x else (low, x if u < x else high)
            v, fv, w, fw, x, fx = w, fw, x, fx, u, fu
        else:
            low, high = (u, high) if u < x else (low, u)
            if fu <= fw or w == x:
                v, fv, w, fw = w, fw, u, fu
            elif fu <= fv or v in (x, w):
                v, fv = u, fu
    return fx, x


@njit(cache=True, nogil=True)
def _downhill(
    at: float,
    ends: tuple[float, float],
    enough: float,
    lamp: int,
    lamps: Lamps,
    floor: float,
    ours: Readings,
    r: int,
    scratch: FloatArray,
) -> tuple[float, float]:
    """Return the squared distance to where it falls from a brightness, between two ends, and that brightness.

    No smaller one where it is not below `enough` among the neighbors of the last place.
    """
    mean, variance, places, squared = scratch[4:5], scratch[5:6], np.empty(3), np.full(3, np.nan)
    places[1] = min(max(at, ends[0]), ends[1])
    for _ in range(_TIMES):
        places[0], places[2] = max(places[1] / _WIDER, ends[0]), min(places[1] * _WIDER, ends[1])
        for k in range(3):
            if math.isnan(squared[k]):
                read_at(places[k], lamp, lamps, mean, variance, 0)
                squared[k], _ = _distance(1.0, floor, ours, r, (mean, variance), 0, np.inf, scratch)
        if squared[0] < squared[1]:
            places[1], squared[1], squared[2], squared[0] = places[0], squared[0], squared[1], np.nan
        elif squared[2] < squared[1]:
            places[1], squared[1], squared[0], squared[2] = places[2], squared[2], squared[1], np.nan
        else:
            break
    if squared[1] <= enough and places[2] > places[0]:
        return _polished(places[0], places[1], places[2], lamp, lamps, floor, ours, r, scratch)
    return squared[1], places[1]


@njit(cache=True, nogil=True)
def nearest(  # noqa: PLR0912, PLR0915  (one walk over curves, readings and segments)
    lamps: Lamps,
    ours: Readings,
    reading: IndexArray,
    curve: IndexArray,
    starts: FloatArray,
    of_roots: FloatArray,
    floor: float,
    margin: float,
    polished: float,
    known: float,
    exact: float,
    out: tuple[FloatArray, FloatArray],
) -> int:
    """Find for each pair, ordered by curve, the brightness of the lamp whose reading is nearest.

    `starts`: brightnesses of each lamp, ascending, between whose ends it may lie; `of_roots`: means, variances and the
    largest variances up to there, row by row; `floor`: least variance, above 0 for distances in units of the noise;
    `out`: squared distances and brightnesses. Pairs that are farther than `margin` times the smallest squared distance
    of all, or than `known`, may be said to be farther than they are; those within `polished` times the smallest are
    polished. Distances are told `exact` to this share, and this many DN or units of the noise. Returns how many
    segments are left unproven.
    """
    n_channels, n_starts, unproven = ours[0].shape[1], starts.shape[1], 0
    (squared, factor), root_mean, root_variance, root_most = out, of_roots[0], of_roots[1], of_roots[2]
    roots = (root_mean, root_variance)
    na, tree = np.empty(_MOST_NODES), (np.empty((_MOST_NODES, n_channels)), np.empty((_MOST_NODES, n_channels)))
    ends_of, child = np.empty((2 * _MOST_NODES, 2), np.intp), np.empty(2 * _MOST_NODES, np.intp)
    off, most = np.empty((2 * _MOST_NODES, 2, n_channels)), np.empty((2 * _MOST_NODES, n_channels))
    slopes, scratch = np.empty((4, n_channels)), np.empty((6, n_channels))
    stack, balances = np.empty((2 * _DEPTH + n_starts, 2), np.intp), np.empty(2 * _DEPTH + n_starts)
    # Means rise but for `drop`, so that the box around a segment is known from its ends.
    drop, no_off, n_nodes, n_segments = np.zeros((2, n_channels)), np.zeros((2, n_channels)), 0, 0
    weights, most_drop = lamps[11], lamps[10].max()
    for c in range(n_channels):
        for p in range(weights.shape[0]):
            drop[0, c] += weights[p, c] * most_drop if weights[p, c] >= 0.0 else np.inf
    close, close_q, close_k, close_at = np.inf, -1, 0, 0.0
    for q in range(reading.size):
        r, j = reading[q], curve[q]
        squared[q], factor[q] = np.inf, starts[j, 0]
        for k in range(n_starts - 1):
            i = j * n_starts + k
            if not _is_beyond(floor, ours, r, root_mean, i, i + 1, root_most, i + 1, no_off, close):
                chord, place = _bound(1.0, floor, ours, r, roots, i, i + 1, no_off, scratch)
                if chord * chord < close:
                    close, close_q, close_k = chord * chord, q, k
                    close_at = starts[j, k] + place * (starts[j, k + 1] - starts[j, k])
    best = np.inf
    if close_q >= 0:  # first the pair whose chord is nearest, so that few others are looked at
        r, j = reading[close_q], curve[close_q]
        found = _polished(starts[j, close_k], close_at, starts[j, close_k + 1], j, lamps, floor, ours, r, scratch)
        best, squared[close_q], factor[close_q] = found[0], found[0], found[1]
    begun = -1
    for q in range(reading.size):
        r, j, top = reading[q], curve[q], 0
        far = min(squared[q], margin * best, known)
        for k in range(n_starts - 1):
            i = j * n_starts + k
            if starts[j, k + 1] > starts[j, k] and not _is_beyond(
                floor, ours, r, root_mean, i, i + 1, root_most, i + 1, drop, far
            ):
                stack[top, 0], stack[top, 1], balances[top] = k, 0, 1.0
                top += 1
        if top and begun != j:  # another curve: its tree of segments begins anew
            begun, n_nodes, n_segments = j, n_starts, n_starts - 1
            for k in range(n_starts):
                na[k] = starts[j, k]
                for c in range(n_channels):
                    tree[0][k, c], tree[1][k, c] = root_mean[j * n_starts + k, c], root_variance[j * n_starts + k, c]
            for k in range(n_segments):
                ends_of[k, 0], ends_of[k, 1], child[k] = k, k + 1, -2
        while top > 0:
            top -= 1
            at, depth, w = stack[top, 0], stack[top, 1], balances[top]
            i, k = ends_of[at, 0], ends_of[at, 1]
            width = na[k] - na[i]
            if child[at] == -2:
                slopes_between(na[i], na[k], j, lamps, slopes)
                for c in range(n_channels):
                    for row in range(2):
                        rise = (tree[row][k, c] - tree[row][i, c]) / width
                        down, up = max(rise - slopes[2 * row, c], 0.0), max(slopes[2 * row + 1, c] - rise, 0.0)
                        off[at, row, c] = down * up / (down + up) * width if down + up > 0.0 else 0.0
                    most[at, c] = max(tree[1][i, c], tree[1][k, c]) + off[at, 1, c]
                child[at] = -1
            enough = math.sqrt(min(squared[q], margin * best, known)) * (1.0 - exact) - exact
            if enough <= 0.0 or _is_beyond(floor, ours, r, tree[0], i, k, most, at, off[at], enough * enough):
                continue
            bound, place = _bound(w, floor, ours, r, tree, i, k, off[at], scratch)
            if not bound < enough:
                continue
            for end in range(2 if at < n_starts - 1 else 0):
                here, _ = _distance(w, floor, ours, r, tree, ends_of[at, end], squared[q], scratch)
                if here < squared[q]:
                    squared[q], factor[q] = here, na[ends_of[at, end]]
                    best = min(best, here)
            if depth >= _DEPTH or n_nodes >= _MOST_NODES - 1 or width <= _NARROW * na[k]:
                unproven += 1
                continue
            if child[at] == -1:
                a = na[i] + width * (place if _AT_ENDS < place < 1.0 - _AT_ENDS else 0.5)
                if 0.0 < _APART * na[i] < na[k]:
                    a = math.sqrt(na[i] * na[k])
                na[n_nodes] = a
                read_at(a, j, lamps, tree[0], tree[1], n_nodes)
                child[at] = n_segments
                for side in range(2):
                    ends_of[n_segments, 0], ends_of[n_segments, 1] = (i, n_nodes) if side == 0 else (n_nodes, k)
                    child[n_segments] = -2
                    n_segments += 1
                n_nodes += 1
            middle = ends_of[child[at], 1]
            here, w = _distance(w, floor, ours, r, tree, middle, min(squared[q], far), scratch)
            if here < squared[q]:
                squared[q], factor[q] = here, na[middle]
                best = min(best, here)
            nearer = 0 if na[i] + place * width < na[middle] else 1
            for entry in range(2):
                stack[top + entry, 0] = child[at] + (nearer if entry else 1 - nearer)
                stack[top + entry, 1], balances[top + entry] = depth + 1, w
            top += 2
    for q in range(reading.size):
        if squared[q] <= polished * best and squared[q] > 0.0:
            ends = starts[curve[q], 0], starts[curve[q], n_starts - 1]
            found = _downhill(factor[q], ends, np.inf, curve[q], lamps, floor, ours, reading[q], scratch)
            if found[0] < squared[q]:
                squared[q], factor[q] = found
    return unproven


@njit(cache=True, nogil=True)
def follow(
    lamps: Lamps,
    scales: FloatArray,
    reading: IndexArray,
    curve: IndexArray,
    least: float,
    largest: float,
    floor: float,
    near: float,
    squared: FloatArray,
    factor: FloatArray,
) -> None:
    """Find the brightnesses at which pairs are nearest, from those in `factor`, at which they are elsewhere.

    `reading`: lamps of the first of the `scales`, then those of the next. Distances fall from `factor` between the
    `least` and the `largest` brightness; pairs that are farther than `near` times the smallest squared distance of all
    may be said to be farther than they are.
    """
    n_lamps, n_channels, best = lamps[0].shape[0], lamps[11].shape[1], np.inf
    scratch, ours = np.empty((6, n_channels)), (np.empty((1, n_channels)), np.empty((1, n_channels)))
    for q in range(reading.size):
        read_at(scales[reading[q] // n_lamps], reading[q] % n_lamps, lamps, ours[0], ours[1], 0)
        squared[q], factor[q] = _downhill(
            factor[q], (least, largest), near * best, curve[q], lamps, floor, ours, 0, scratch
        )
        best = min(best, squared[q])
