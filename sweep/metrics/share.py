"""Confidence intervals and text of shares."""

from __future__ import annotations

import math

_Z = 1.959963984540054
"""Standard deviations to either end of a 95 % interval of a normal distribution."""

_MOST_DIGITS = 10
_ROUNDING = 1e-12
"""Shares that are nearer to none or to all are these, but for the rounding of floats."""


def share_interval(successes: int, n: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson, J. Am. Stat. Assoc. 22, 209, 1927)."""
    share, z = successes / n, _Z**2 / n
    middle, half = share + z / 2, _Z * math.sqrt(share * (1 - share) / n + z / (4 * n))
    return max(0.0, (middle - half) / (1 + z)), min(1.0, (middle + half) / (1 + z))


def format_share(share: float, digits: int = 1) -> str:
    """Format a share in percent, with more digits where rounding would give 0 or 100 %."""
    if min(abs(share), abs(1 - share)) < _ROUNDING:
        return f"{share:.0%}"
    enough = (
        shown_digits
        for shown_digits in range(digits, _MOST_DIGITS)
        if float(f"{share:.{shown_digits}%}"[:-1]) not in (0, 100)
    )
    return f"{share:.{next(enough, _MOST_DIGITS)}%}"
