"""Shares: how far one that was counted is trusted, and how they are told."""

from __future__ import annotations

import math

_Z = 1.959963984540054
"""Of a two-sided 95 % interval of a normal distribution."""

_MOST_DIGITS = 10
_ROUNDING = 1e-12
"""Shares that are nearer to none or to all are these, but for the rounding of floats."""


def share_interval(kept: int, n: int) -> tuple[float, float]:
    """The 95 % interval of a share, of which `kept` of `n` were counted (Wilson, J. Am. Stat. Assoc. 22, 209, 1927)."""
    share, z = kept / n, _Z**2 / n
    middle, half = share + z / 2, _Z * math.sqrt(share * (1 - share) / n + z / (4 * n))
    return max(0.0, (middle - half) / (1 + z)), min(1.0, (middle + half) / (1 + z))


def told_share(share: float, digits: int = 1) -> str:
    """Percent with `digits` after the point, and with more where rounding would say none or all of what is neither."""
    if min(abs(share), abs(1 - share)) < _ROUNDING:
        return f"{share:.0%}"
    enough = (few for few in range(digits, _MOST_DIGITS) if float(f"{share:.{few}%}"[:-1]) not in (0, 100))
    return f"{share:.{next(enough, _MOST_DIGITS)}%}"
