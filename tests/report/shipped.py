"""Studies of the project whose finished runs tests look at."""

from __future__ import annotations

import pytest

FAST = ("stopband",)
LONG = ("robust", "noise", "angle")
SEARCHED = (
    "stopband",
    "least_loss",
    "least_loss_by_pixel",
    "chromatic",
    "robust",
    "angle",
    "dye",
    "band",
    "dual",
    "freeform",
    "producible",
    "rccb",
    "balanced",
    "measured",
)
"""Those with a search."""
SLOW = (
    "least_loss",
    "least_loss_by_pixel",
    "chromatic",
    "dye",
    "band",
    "dual",
    "paper",
    "freeform",
    "producible",
    "rccb",
    "distance",
    "accuracy",
    "scorecard",
    "balanced",
)
EVERY = [
    *FAST,
    *(pytest.param(name, marks=[pytest.mark.slow, pytest.mark.long]) for name in LONG),
    *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW),
    pytest.param("measured", marks=pytest.mark.slow),
]
