"""Fit the built-in surrogate curves to published figures, and say how well and how surely."""

from .run import Calibration, calibrate

__all__ = ["Calibration", "calibrate"]
