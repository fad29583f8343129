"""Edge of a filter: from 0 to 1 over a stated width, exactly 0 and 1 outside it."""

from __future__ import annotations

import numpy as np

from ..base.types import Array, Float

_TENTH = 0.2466364532884666
"""Where the quintic 6 t^5 - 15 t^4 + 10 t^3 is 0.1; it is 0.9 at 1 - _TENTH."""
SPAN_PER_WIDTH = 1 / (1 - 2 * _TENTH)
"""Whole span of an edge over its 10-90 % width."""
_WALL_NM = 1e-9
"""An edge that is not wider is a brick wall: 600 nm in float64 resolves 1e-13 nm."""


def edge(
    wavelength_nm: Float[Array, "*#points"], center_nm: Float[Array, "*#points"], width_nm: Float[Array, "*#points"]
) -> Float[Array, "*points"]:
    """Return a rising edge, a quintic with two continuous derivatives (Perlin's smootherstep), 0 to 1.

    `wavelength_nm`: wavelengths, nm; all arguments broadcast; `center_nm`: center, where the edge is 0.5, nm;
    `width_nm`: width from 10 to 90 %, nm; 0 is a step with 0.5 at its center.
    """
    t = _position(wavelength_nm, center_nm, width_nm)
    return np.asarray(t * t * t * (t * (6 * t - 15) + 10), dtype=float)


def edge_gradient(
    wavelength_nm: Float[Array, "*#points"], center_nm: Float[Array, "*#points"], width_nm: Float[Array, "*#points"]
) -> tuple[Float[Array, "*points"], Float[Array, "*points"]]:
    """Return the derivatives of `edge`; 0 for a step, whose derivative is a distribution.

    Returns derivatives, 1/nm.
    """
    t = _position(wavelength_nm, center_nm, width_nm)
    slope = 30 * t * t * (1 - t) * (1 - t)
    span = np.asarray(width_nm, dtype=float) * SPAN_PER_WIDTH
    wide = span > _WALL_NM
    by_center = np.divide(-slope, span, out=np.zeros(np.broadcast_shapes(slope.shape, span.shape)), where=wide)
    offset = np.asarray(wavelength_nm, dtype=float) - center_nm
    by_width = np.divide(by_center * offset, width_nm, out=np.zeros_like(by_center), where=wide)
    return by_center, by_width


def per_span(width_nm: Float[Array, "*edges"]) -> Float[Array, "*edges"]:
    """Return 1 / span of edges, 1/nm; 0 of a step."""
    span = np.asarray(width_nm, dtype=float) * SPAN_PER_WIDTH
    return np.divide(1.0, span, out=np.zeros_like(span), where=span > _WALL_NM)


def _position(
    wavelength_nm: Float[Array, "*#points"], center_nm: Float[Array, "*#points"], width_nm: Float[Array, "*#points"]
) -> Float[Array, "*points"]:
    offset, per_nm = np.asarray(wavelength_nm, dtype=float) - center_nm, per_span(width_nm)
    return np.clip(np.where(per_nm == 0, np.sign(offset) / 2, offset * per_nm) + 0.5, 0.0, 1.0)
