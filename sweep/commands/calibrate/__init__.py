"""Fit the built-in surrogate curves to published figures, and say how well and how surely."""

from .run import Calibration, fit_surrogate

__all__ = ["Calibration", "fit_surrogate"]
