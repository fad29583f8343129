"""How far a share that was counted is trusted."""

from __future__ import annotations

import math

_Z = 1.959963984540054
"""Of a two-sided 95 % interval of a normal distribution."""


def share_interval(kept: int, n: int) -> tuple[float, float]:
    """The 95 % interval of a share, of which `kept` of `n` were counted (Wilson, J. Am. Stat. Assoc. 22, 209, 1927)."""
    share, z = kept / n, _Z**2 / n
    middle, half = share + z / 2, _Z * math.sqrt(share * (1 - share) / n + z / (4 * n))
    return max(0.0, (middle - half) / (1 + z)), min(1.0, (middle + half) / (1 + z))
