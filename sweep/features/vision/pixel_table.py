"""Distribution of what a pixel reads, by exact sums over Poisson electrons, tabulated over the expected electrons.

The order is the camera's: gain error, Poisson electrons, full well, read noise, gain and pedestal, ADC range, rounding,
and for an HDR pixel the merge. Between two nodes of the expected electrons the distributions are mixed linearly: the
mean is exact, and a mixture of two neighbors has up to 0.4 % more variance (1.6 % between some nodes of HDR pixels).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...base.types import Array, Float, PerValue
from ...camera.captures import Capture
from ...camera.noise import gaussian
from ...camera.noise.merge import light_of, saturating_e
from ...camera.noise.merged_readings import ROOT_STEP, nodes_of, readings_of
from ...camera.noise.moments import without_prnu
from ...camera.pixel import Pixel

_LEAST = 1e-30


@dataclass(frozen=True)
class PixelTable:
    """Distribution of a pixel's reading at nodes of the expected electrons.

    A reading is a digital number, the code of a companded HDR pixel, or a bin of an eighth of the noise of a merged
    value.

    `nodes_e`: expected electrons of a pixel of full sensitivity; `node_of_root`: the last node that is not above each
    multiple of `ROOT_STEP`, squared; at most the last but one; `values_dn`: value of each reading, DN; of a merged one
    those of the first capture.
    """

    nodes_e: Float[Array, " nodes"]
    node_of_root: NDArray[np.int32]
    shares: NDArray[np.float32]
    below: NDArray[np.float32]
    values_dn: Float[Array, " readings"]

    def at(self, electrons: Float[Array, " ..."]) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Return the node below each expected number of electrons, and the share of the next one.

        `electrons`: expected electrons of a pixel of full sensitivity.
        """
        root = np.minimum(np.sqrt(electrons) / ROOT_STEP, self.node_of_root.size - 1).astype(np.intp)
        node = self.node_of_root[root]
        # Linear in the electrons, not in their root, so that the mean is exact.
        share = (electrons - self.nodes_e[node]) / np.diff(self.nodes_e)[node]
        return node, np.clip(share, 0.0, 1.0).astype(np.float32)


@lru_cache(maxsize=4)
def pixel_table(pixel: Pixel) -> PixelTable:
    """Return the table of a pixel with its noise; cached.

    `pixel`: full well, gain, noise and ADC; captures of an HDR pixel have its QE and crosstalk.
    """
    from ...camera.noise.kernels import merged_shares  # noqa: PLC0415  (compiled: kept off the start-up path)

    merged = _merged(without_prnu(pixel))
    light, most_e = light_of(merged), saturating_e(merged)
    roots_e, is_node = nodes_of(merged, light)
    nodes_e = roots_e[is_node]
    readings = readings_of(merged, tuple(light))
    parts = readings.exposure, readings.passed, readings.starts, readings.columns, readings.shares
    shares = np.zeros((nodes_e.size, readings.n_bins))
    for of_node, electrons in zip(shares, nodes_e, strict=True):
        first, of_readings = merged_shares(np.minimum(electrons * light, most_e), 0.0, *parts, readings.n_bins)
        of_node[first : first + of_readings.size] = of_readings
    shares = _with_prnu(shares, nodes_e, pixel.prnu)
    logs = np.log(np.maximum(shares, _LEAST)).T
    logs -= logs.max(axis=1, keepdims=True)
    below = np.cumsum(shares, axis=1)
    below /= below[:, -1:]
    values_e = readings.bins.value(readings.first + np.arange(readings.n_bins))
    return PixelTable(
        nodes_e,
        np.minimum(np.cumsum(is_node) - 1, nodes_e.size - 2).astype(np.int32),
        np.ascontiguousarray(logs, dtype=np.float32),
        np.ascontiguousarray(below, dtype=np.float32),
        values_e * pixel.dn_per_e + pixel.offset_dn,
    )


def _merged(pixel: Pixel) -> Pixel:
    """Return a pixel that is read once as one of a single capture, whose codes are the digital numbers."""
    top = float(pixel.full_scale_dn)
    changes = {"captures": (Capture(),), "merge": "saturated", "companding": ((top, top),)}
    return pixel if pixel.captures else pixel.model_copy(update=changes)


def _with_prnu(
    shares: Float[Array, "functions wavelengths"], electrons: PerValue, prnu: float
) -> Float[Array, "functions wavelengths"]:
    """Return the mean over Gaussian gains of the pixels, by the trapezoidal rule between the nodes."""
    if not prnu:
        return shares
    from scipy.sparse import csr_matrix  # noqa: PLC0415  (slow to import: kept off the start-up path)

    z = np.linspace(-6, 6, 49)
    weight = gaussian.density(z) / gaussian.density(z).sum()
    scaled_electrons = np.minimum(electrons[:, None] * np.maximum(1 + prnu * z, 0.0), electrons[-1])
    left = np.clip(np.searchsorted(electrons, scaled_electrons, side="right") - 1, 0, electrons.size - 2)
    share = (scaled_electrons - electrons[left]) / np.diff(electrons)[left]
    rows = np.broadcast_to(np.arange(electrons.size)[:, None], scaled_electrons.shape).ravel()
    entries = np.concatenate([(weight * (1 - share)).ravel(), (weight * share).ravel()])
    columns = np.concatenate([left.ravel(), left.ravel() + 1])
    mixed = csr_matrix((entries, (np.tile(rows, 2), columns)), shape=(electrons.size, electrons.size))
    return np.asarray(mixed @ shares, dtype=float)
