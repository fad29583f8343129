"""How shares are told: what is not all is never said to be all, and what is not nothing never nothing."""

from __future__ import annotations

_MOST_DIGITS = 10
_ROUNDING = 1e-12
"""Shares that are nearer to none or to all are these, but for the rounding of floats."""


def told_share(share: float, digits: int = 1) -> str:
    """Percent with `digits` after the point, and with more where rounding would make it none or all."""
    if min(abs(share), abs(1 - share)) < _ROUNDING:
        return f"{share:.0%}"
    enough = (few for few in range(digits, _MOST_DIGITS) if float(f"{share:.{few + 2}f}") not in (0, 1))
    return f"{share:.{next(enough, _MOST_DIGITS)}%}"
