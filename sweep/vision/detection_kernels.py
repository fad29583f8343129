"""Compiled inner loops of detections: which finds which target, and average precision under weights of the images."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..base.machine_code import njit

_SURELY = 1 - 1e-10


@njit(cache=True, nogil=True)
def _overlap(found: NDArray[np.float64], target: NDArray[np.float64]) -> float:
    """Return the intersection of two boxes over their union."""
    wide = min(found[0] + found[2], target[0] + target[2]) - max(found[0], target[0])
    high = min(found[1] + found[3], target[1] + target[3]) - max(found[1], target[1])
    if wide <= 0 or high <= 0:
        return 0.0
    both = wide * high
    return float(both / (found[2] * found[3] + target[2] * target[3] - both))


@njit(cache=True, nogil=True)
def match(
    found: NDArray[np.float64],
    of_found: NDArray[np.intp],
    targets: NDArray[np.float64],
    of_targets: NDArray[np.intp],
    thresholds: NDArray[np.float64],
    out: NDArray[np.intp],
) -> None:
    """Write the target that each detection finds at each threshold, or -1, as pycocotools does.

    `found`: by image, best first, left, top, width and height; `of_found`, `of_targets`: first of each
    image. A detection takes the target with the largest overlap that no better one has taken; of equal ones the last.
    """
    for at in range(thresholds.size):
        taken = np.zeros(len(targets), dtype=np.bool_)
        for image in range(of_found.size - 1):
            for i in range(of_found[image], of_found[image + 1]):
                best, which = min(thresholds[at], _SURELY), -1
                for j in range(of_targets[image], of_targets[image + 1]):
                    if not taken[j]:
                        overlap = _overlap(found[i], targets[j])
                        if overlap >= best:
                            best, which = overlap, j
                out[at, i] = which
                if which >= 0:
                    taken[which] = True


@njit(cache=True, nogil=True)
def average_precisions(
    hits: NDArray[np.int8],
    image: NDArray[np.intp],
    weights: NDArray[np.float64],
    targets: NDArray[np.float64],
    recalls: NDArray[np.float64],
    precision: NDArray[np.float64],
    recall: NDArray[np.float64],
) -> None:
    """Write average precision and largest recall at each threshold under each set of weights of the images.

    `hits`: 1 for detections that find a target, 0 for false ones, -1 for those that do not count, by falling score;
    `targets`: weight of all targets; `recalls`: at which the largest precision of that recall or more is averaged.
    """
    n = image.size
    at_recall, best = np.empty(n), np.empty(n)
    for draw in range(len(weights)):
        for at in range(len(hits)):
            if not targets[draw] > 0:
                precision[draw, at] = recall[draw, at] = np.nan
                continue
            right, false, count = 0.0, 0.0, 0
            for i in range(n):
                weight = weights[draw, image[i]]
                if hits[at, i] < 0 or weight == 0:
                    continue
                if hits[at, i]:
                    right += weight
                else:
                    false += weight
                at_recall[count], best[count] = right / targets[draw], right / (right + false)
                count += 1
            for i in range(count - 2, -1, -1):
                best[i] = max(best[i], best[i + 1])
            total, i = 0.0, 0
            for wanted in recalls:
                while i < count and at_recall[i] < wanted:
                    i += 1
                if i == count:
                    break
                total += best[i]
            precision[draw, at] = total / recalls.size
            recall[draw, at] = right / targets[draw]
