"""Relative illumination: off axis, a lens without vignetting gives cos^4 of the light."""

from __future__ import annotations

import math

from ..view import Setup

METHODS = ("skip", "cos4")


def skip_is_exact(setup: Setup) -> str | None:
    """Why leaving it out changes nothing; None when it does."""
    return "on axis" if setup.scenario.off_axis_deg == 0 else None


def factor(setup: Setup, method: str) -> float:
    """cos^4 of the field angle, or 1."""
    return 1.0 if method == "skip" else math.cos(math.radians(setup.scenario.off_axis_deg)) ** 4
